#include "host/recording/csv.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cmath>
#include <sstream>

#include "host/io/io.hpp"
#include "host/recording/resample.hpp"

namespace flexor::recording {
namespace {

Recording parse(const std::string& text) { return parse_csv(text, "log.csv", {}); }

std::string reason(const std::string& text) {
  try {
    (void)parse(text);
  } catch (const io::InputError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << "one line";
    return error.what();
  }
  return "no error";
}

TEST(Csv, ALineWithoutEndIsRefusedAndNotTakenIntoMemory) {
  for (const char byte : {',', 'x', '\0'}) {
    const std::string what = reason("t_s,a\n0,1\n" + std::string(2'000'000, byte));
    EXPECT_NE(what, "no error");
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
  try {
    require_change(r, "a", "is the sensor plugged in?");
    FAIL();
  } catch (const io::InputError& error) {
    EXPECT_STREQ(error.what(), "log.csv: column \"a\" never changes (always 7); is the sensor plugged in?");
  }
}

}  // namespace
}  // namespace flexor::recording
