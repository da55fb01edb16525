#include "host/recording/csv.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cmath>

#include "host/io/io.hpp"
#include "host/recording/resample.hpp"

namespace flexor::recording {
namespace {

Recording parse(const std::string& text, const std::vector<std::string>& columns = {}) {
  return parse_csv(text, "log.csv", columns);
}

std::string reason(const std::string& text, const std::vector<std::string>& columns = {}) {
  try {
    (void)parse(text, columns);
  } catch (const io::InputError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << "one line";
    return error.what();
  }
  return "no error";
}

TEST(Csv, ReadsAGloveLogWithMarkNonAsciiNamesTextAndMilliseconds) {
  const auto r = parse(
      "\xEF\xBB\xBF"
      "Frame,Time(ms),Phase,∠ABC_smooth\r\n0,1000,Flex,30.5\r\n1,1033,Flex,31\r\n");
  ASSERT_EQ(r.columns.size(), 2u);
  EXPECT_EQ(r.columns[1].name, "∠ABC_smooth");
  EXPECT_DOUBLE_EQ(r.t_s[1], 1.033);
  EXPECT_EQ(r.column("∠ABC_smooth").value, (std::vector<double>{30.5, 31}));
}

TEST(Csv, ReadsSemicolonsTabsAndQuotes) {
  EXPECT_EQ(parse("t_s;a\n0;1\n1;2\n").column("a").value[1], 2);
  EXPECT_EQ(parse("t_s\ta\n0\t1\n1\t2\n").column("a").value[1], 2);
  EXPECT_EQ(parse("t_s,\"a, \"\"quoted\"\"\"\n0,\"1\"\n1,2\n").columns[0].name, "a, \"quoted\"");
}

TEST(Csv, ReadsIso8601WithZones) {
  const auto r =
      parse("timestamp,a\n2024-02-29T23:59:59.500Z,1\n2024-03-01T01:00:00+01:00,2\n2024-03-01 00:00:01Z,3\n");
  EXPECT_NEAR(r.t_s[1] - r.t_s[0], 0.5, 1e-6);
  EXPECT_NEAR(r.t_s[2] - r.t_s[0], 1.5, 1e-6);
  EXPECT_NEAR(r.t_s[0], 1709251199.5, 1e-6);
}

TEST(Csv, TimeUnitComesFromTheName) {
  EXPECT_DOUBLE_EQ(parse("time_us,a\n0,1\n500000,2\n").t_s[1], 0.5);
  EXPECT_DOUBLE_EQ(parse("Time [s],a\n0,1\n0.5,2\n").t_s[1], 0.5);
}

TEST(Csv, KeepsABurstThatSharesATimeAndSaysSo) {
  const auto r = parse("t_s,a\n0,1\n1,2\n1,4\n2,8\n");
  EXPECT_EQ(r.t_s, (std::vector<double>{0, 1, 1, 2}));
  EXPECT_EQ(r.column("a").value, (std::vector<double>{1, 2, 4, 8}));
  ASSERT_EQ(r.warnings.size(), 1u);
  EXPECT_NE(r.warnings[0].find("1 row(s) repeat the time"), std::string::npos);
}

TEST(Csv, DropsAFewBackwardRowsAndRefusesMany) {
  std::string text = "t_s,a\n";
  for (int k = 0; k < 200; ++k) text += std::to_string(k == 100 ? 50 : k) + ",1\n";
  const auto r = parse(text);
  EXPECT_EQ(r.t_s.size(), 199u);
  EXPECT_NE(r.warnings.at(0).find("first is row 102"), std::string::npos) << r.warnings[0];
  const auto why = reason("t_s,a\n0,1\n1,2\n2,3\n0,1\n1,2\n");
  EXPECT_NE(why.find("log.csv: row 5: time does not increase"), std::string::npos) << why;
  EXPECT_NE(reason("t_s,a\n3,1\n3,2\n3,3\n").find("row 3: time does not increase"), std::string::npos);
}

TEST(Csv, NamesRowAndColumnOfABadCell) {
  EXPECT_NE(reason("t_s,a\n0,1\n1,x7\n").find("log.csv: row 3: column \"a\": \"x7\" is not a number"),
            std::string::npos);
  EXPECT_NE(reason("t_s,a\n0,1\n1,-inf\n").find("row 3: column \"a\": -inf is not a measurement"),
            std::string::npos);
  EXPECT_NE(reason("t_s,a\n0,1\nbad,2\n").find("row 3: column \"t_s\""), std::string::npos);
  EXPECT_NE(reason("t_s,a\n0,1\n1,2,3\n").find("row 3: 3 cells, the header has 2"), std::string::npos);
}

TEST(Csv, WithoutAColumnOfNumbersTheFirstCellThatIsNoneIsShown) {
  const std::string what = reason("t_s,flex\n0,12.3°\n0.05,12.4°\n");
  EXPECT_NE(what.find("row 2"), std::string::npos) << what;
  EXPECT_NE(what.find("\"flex\" holds \"12.3°\""), std::string::npos) << what;
}

TEST(Csv, ALineWithoutEndIsRefusedAndNotTakenIntoMemory) {
  for (const char byte : {',', 'x', '\0'}) {
    const std::string what = reason("t_s,a\n0,1\n" + std::string(2'000'000, byte));
    EXPECT_NE(what, "no error");
    EXPECT_LT(what.size(), 300u);
  }
}

TEST(Csv, ALongCellIsShownWithoutCuttingALetterInTwo) {
  std::string cell = "x";
  for (int i = 0; i < 40; ++i) cell += "\u00e9";
  EXPECT_TRUE(is_utf8(reason("t_s,a\n0,1\n1," + cell + "\n")));
}

TEST(Csv, MissingColumnsAreAnsweredWithThoseThereAre) {
  const auto why = reason("t_s,SensorA1,SensorA2\n0,1,2\n1,2,3\n", {"SensorA9"});
  EXPECT_NE(why.find("no column \"SensorA9\"; there are: t_s, SensorA1, SensorA2"), std::string::npos) << why;
  EXPECT_NE(reason("x,a\n0,1\n1,2\n").find("no time column"), std::string::npos);
}

TEST(Csv, MissingColumnsAreAnsweredBehindSemicolonsAndDecimalCommasToo) {
  for (const char* text : {"Zeit(s);t_s;Finger A;Finger B\n0,5;0,5;1,5;2,5\n1,5;1,5;2,5;3,5\n",
                           "sep=;\nZeit(s);t_s;Finger A;Finger B\n0,5;0,5;1,5;2,5\n1,5;1,5;2,5;3,5\n"}) {
    EXPECT_EQ(reason(text, {"Finger C"}),
              "log.csv: no column \"Finger C\"; there are: Zeit(s), t_s, Finger A, Finger B");
    EXPECT_EQ(parse(text, {"Finger B"}).column("Finger B").value, (std::vector<double>{2.5, 3.5}));
  }
  EXPECT_EQ(reason("time;a\n0,5;1,5\n0,6;2,5\n", {"b"}), "log.csv: no column \"b\"; there are: time, a");
  EXPECT_NE(reason("x;a\n0,5;1,5\n0,6;2,5\n", {"a"}).find("there are: x, a"), std::string::npos);
}

// Rows of one time are averaged: no reading may be so large that a sum of them is none.
TEST(Csv, HugeReadingsAtOneTimeNeverBecomeInfinite) {
  for (const char* huge : {"1e308", "-1e308", "1.7976931348623157e308", "1.0001e30"}) {
    const std::string rows = std::string("1,") + huge + "\n1," + huge + "\n";
    const std::string why = reason("t_s,a\n0,1\n" + rows + "2,3\n");
    EXPECT_NE(why.find("log.csv: row 3: column \"a\": " + std::string(huge) + " is not a measurement"),
              std::string::npos)
        << why;
  }
  std::string text = "t_s,a\n0,1\n";
  for (int k = 0; k < 1000; ++k) text += k % 2 == 0 ? "1,1e30\n" : "1,9e29\n";
  const Recording r = parse(text + "2,3\n");
  const Series series = r.series("a");
  for (const double v : resample(series, 0.5, 5).value) EXPECT_LE(std::abs(v), 1e30);
  EXPECT_NEAR(resample(series, 0.5, 5).value.at(3), 9.5e29, 1e27);
}

TEST(Csv, EmptyHeaderOnlyAndSingleRowAreRefused) {
  EXPECT_NE(reason("").find("is empty"), std::string::npos);
  EXPECT_NE(reason("t_s,a\n").find("has a header but no data"), std::string::npos);
  EXPECT_NE(reason("t_s,a\n0,1\n").find("at least two"), std::string::npos);
}

TEST(Csv, MillisecondsTakenForSecondsAreRefused) {
  EXPECT_NE(reason("time,a\n0,1\n16,2\n32,3\n").find("milliseconds"), std::string::npos);
}

TEST(Csv, ALastLineCutOffWhileWritingIsLeftOut) {
  const auto r = parse("t_s,a,b\n0,1,2\n1,2,3\n2,4");
  EXPECT_EQ(r.t_s.size(), 2u);
  EXPECT_TRUE(r.warnings.empty());
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
