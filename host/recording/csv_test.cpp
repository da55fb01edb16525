#include "host/recording/csv.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cmath>
#include <limits>
#include <sstream>

#include "host/io/refusal_test.hpp"
#include "host/recording/resample.hpp"

namespace flexor::recording {
namespace {

Recording parse(const std::string& text) { return parse_csv(text, "log.csv", {}); }

std::string reason(const std::string& text) {
  return io::refusal_of([&] { (void)parse(text); });
}

TEST(Csv, ALineWithoutEndIsRefusedAndNotTakenIntoMemory) {
  for (const char byte : {',', 'x', '\0'}) {
    const std::string what = reason("t_s,a\n0,1\n" + std::string(2'000'000, byte));
    EXPECT_NE(what, "accepted");
    EXPECT_LT(what.size(), 300u);
  }
}

TEST(Csv, OfALiveLogALineWithoutEndIsAMalformedRow) {
  std::istringstream lines("t_s,a\n0,1\n1,2\n2," + std::string(1'100'000, '3') + "\n3,4\n");
  CsvReader reader(lines, "log.csv", {{}, {}, Holes::none, From::pipe});
  const Recording r = read(reader);
  EXPECT_EQ(r.t_s, (std::vector{0.0, 1.0, 3.0}));
  EXPECT_NE(r.warnings.at(0).find("1 row(s) are malformed"), std::string::npos) << r.warnings[0];
}

TEST(Csv, ALongCellIsShownWithoutCuttingALetterInTwo) {
  std::string cell = "x";
  for (int i = 0; i < 40; ++i) cell += "\u00e9";
  EXPECT_TRUE(is_utf8(reason("t_s,a\n0,1\n1," + cell + "\n")));
}

TEST(Csv, ALineThatABoardSaysBeforeItsRowsIsNoHeader) {
  const std::string rows = "0.1,601,611,621,631\n0.2,602,612,622,632\n0.3,603,613,623,633\n";
  for (const char* first : {"rst cause:2, boot mode:(3,6)", "x01,600,610,620,630"}) {
    const Recording r = parse(std::string(first) + "\n" + rows);
    EXPECT_EQ(r.t_s, (std::vector{0.1, 0.2, 0.3}));
    EXPECT_EQ(r.columns.at(3).name, "column5");
    EXPECT_NE(r.warnings.at(0).find("row 1 (\""), std::string::npos) << r.warnings[0];
  }
  EXPECT_EQ(parse("t_s,1,2,3,4\n" + rows).columns.at(0).name, "1");
  EXPECT_NE(reason("idle,0.05,10\nidle,0.06,11\n").find("column \"column1\""), std::string::npos);
}

// Rows of one time are averaged: no reading may be so large that a sum of them is none.
TEST(Csv, HugeReadingsAtOneTimeNeverBecomeInfinite) {
  std::string text = "t_s,a\n0,1\n";
  for (int k = 0; k < 1000; ++k) text += k % 2 == 0 ? "1,1e30\n" : "1,9e29\n";
  const Recording r = parse(text + "2,3\n");
  const Series series = r.series("a");
  for (const double v : resample(series, 0.5, 5).value) EXPECT_LE(std::abs(v), 1e30);
  EXPECT_NEAR(resample(series, 0.5, 5).value.at(3), 9.5e29, 1e27);
}

TEST(Csv, WideCsvRoundTripsEveryDouble) {
  EXPECT_TRUE(rc::check([](const std::vector<double>& values) {
    RC_PRE(values.size() >= 2u);
    Recording r;
    r.columns = {{"∠ a, \"b\" (deg)", values}};
    for (std::size_t k = 0; k < values.size(); ++k) r.t_s.push_back(static_cast<double>(k) * 0.1);
    const auto back = parse_csv(to_csv(r), "log.csv", {});
    RC_ASSERT(back.t_s == r.t_s);
    RC_ASSERT(back.columns[0].name == r.columns[0].name);
    RC_ASSERT(back.columns[0].value == values);
  }));
}

TEST(Recording, AConstantSignalIsNamedWithAMend) {
  const auto r = parse("t_s,a\n0,7\n1,7\n");
  EXPECT_EQ(io::refusal_of([&] { require_change(r, "a", "is the sensor plugged in?"); }),
            "log.csv: column \"a\" never changes (always 7); is the sensor plugged in?");
}

constexpr double kHole = std::numeric_limits<double>::quiet_NaN();

Log log_of(std::vector<double> t_s, std::vector<double> index, std::vector<double> thumb) {
  Recording out;
  out.source = "held";
  out.t_s = std::move(t_s);
  out.columns = {{"index_V", std::move(index), "V"}, {"thumb_V", std::move(thumb), "V"}};
  return Log(std::move(out));
}

Recording read_all(const Log& log, const TableOptions& options) { return read(*open_log(log, options)); }

TEST(LogInMemory, RowsWithoutAReadingOfTheColumnsAreLeftOut) {
  const Log log = log_of({0, 1, 2, 3}, {5, kHole, 6, 7}, {1, 2, kHole, 3});
  const Recording one = read_all(log, {{"index_V"}, {}});
  EXPECT_EQ(one.t_s, (std::vector<double>{0, 2, 3}));
  EXPECT_EQ(one.column("index_V").unit, "V");
  EXPECT_EQ(one.warnings.size(), 1U);
  EXPECT_EQ(read_all(log, {{}, {}}).t_s, (std::vector<double>{0, 3}));
  EXPECT_EQ(read_all(log, {{}, {}, Holes::all}).t_s.size(), 4U);
}

TEST(LogInMemory, IsRefusedAsAFileIs) {
  const auto refusal = [](const Log& log, const std::string& column) {
    return io::refusal_of([&] { (void)read_all(log, {{column}, {}}); });
  };
  EXPECT_NE(refusal(log_of({0, 1}, {1, 2}, {1, 2}), "ring_V").find("no column"), std::string::npos);
  EXPECT_NE(refusal(log_of({0}, {1}, {1}), "index_V").find("at least two"), std::string::npos);
  EXPECT_NE(refusal(log_of({0, 1}, {1, HUGE_VAL}, {1, 2}), "index_V").find("row 2"), std::string::npos);
}

}  // namespace
}  // namespace flexor::recording
