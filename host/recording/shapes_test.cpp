#include "host/recording/shapes_test.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "host/io/refusal_test.hpp"
#include "host/recording/csv.hpp"

namespace flexor::recording {
namespace {

Recording recording_of(const std::string& text, const TableOptions& options) {
  std::istringstream stream(text);
  CsvReader reader(stream, "log.csv", options);
  return read(reader);
}

class Shapes : public testing::TestWithParam<Shape> {};

TEST_P(Shapes, IsReadAndWhatIsAssumedIsNoted) {
  const Shape& s = GetParam();
  const Recording r = recording_of(s.text, {{s.column}, s.time});
  ASSERT_EQ(r.t_s.size(), s.since_first_s.size());
  for (std::size_t k = 0; k < r.t_s.size(); ++k) EXPECT_NEAR(r.t_s[k] - r.t_s[0], s.since_first_s[k], 1e-6);
  EXPECT_EQ(r.column(s.column).value, s.value);
  bool is_noted = s.note.empty();
  for (const std::string& note : r.warnings) {
    is_noted = is_noted || note.find(s.note) != std::string::npos;
    EXPECT_TRUE(note.starts_with("log.csv: ") && note.find('\n') == std::string::npos) << note;
  }
  EXPECT_TRUE(is_noted) << "nothing says: " << s.note;
}

INSTANTIATE_TEST_SUITE_P(Log, Shapes, testing::ValuesIn(kShapes), [](const auto& i) { return i.param.name; });

class Misshapes : public testing::TestWithParam<Misshape> {};

TEST_P(Misshapes, IsRefusedInOneLine) {
  const Misshape& s = GetParam();
  const std::string what = io::refusal_of([&] { (void)recording_of(s.text, {{s.column}, s.time}); });
  EXPECT_NE(what.find(s.reason), std::string::npos) << what;
  EXPECT_TRUE(what.starts_with("log.csv: ") && what.find('\n') == std::string::npos) << what;
  EXPECT_LT(what.size(), 400U);
}

INSTANTIATE_TEST_SUITE_P(Log, Misshapes, testing::ValuesIn(kMisshapes),
                         [](const auto& i) { return i.param.name; });

// Two lines that ran into one end no log, a bad cell no live one; in a file it is named.
TEST(Shapes, AMalformedRowAmongGoodOnesIsLeftOutAndCounted) {
  for (const char* bad : {"1.5,10,1.55,11\n", "1.5,1x0\n", "half past one,10\n", "1.5,1e99\n"}) {
    std::string text = "t_s,flex\n";
    for (int k = 0; k < 60; ++k) text += std::to_string(k * 0.05) + ",10\n" + (k == 30 ? bad : "");
    const Recording r = recording_of(text, {{"flex"}, {}, Holes::none, From::pipe});
    EXPECT_EQ(r.t_s.size(), 60U) << bad;
    EXPECT_EQ(r.warnings, std::vector<std::string>{
                              "log.csv: 1 row(s) are malformed and were left out, the first is row 33"});
    const std::string of_file = io::refusal_of([&] { (void)recording_of(text, {{"flex"}}); });
    EXPECT_NE(of_file.find(bad[3] == ',' && bad[6] == ',' ? "accepted" : "row 33"), std::string::npos)
        << of_file;
  }
}

TEST(Shapes, AFileTakesTheFirstSegmentThatItHas) {
  TimeOptions time;
  time.segments = {"clock", "trial"};
  for (const auto& [text, trials] :
       {std::pair("t_s,trial,flex\n0,a,1\n2,a,2\n4,b,3\n6,b,4\n8,c,3\n10,c,4\n", 3U),
        {"t_s,trial,flex\n0,,9\n2,a,1\n4,,2\n6,,3\n8,a,3\n10,,4\n12,,4\n", 2U},
        {"t_s,flex\n0,1\n2,2\n4,2\n0,3\n2,4\n", 2U}}) {
    std::istringstream stream(text);
    CsvReader reader(stream, "log.csv", {{"flex"}, time});
    EXPECT_EQ(read_segments(reader, time).size(), trials);
  }
}

TEST(Shapes, TwoClocksOfUnlikeRatesAreRefusedNamingBoth) {
  for (const auto& [step_ms, is_refused] : {std::pair(51, true), {50, false}}) {
    std::string text = "time_ms,timestamp_s,flex\n";
    for (int k = 0; k < 600; ++k) text += fmt::format("{},{},{}\n", 50 * k, 7 + step_ms * k / 1000.0, k);
    const std::string what = io::refusal_of([&] { (void)recording_of(text, {{"flex"}}); });
    EXPECT_EQ(what.find("\"time_ms\" and \"timestamp_s\" could both be the time: say which") != what.npos,
              is_refused)
        << what;
    EXPECT_EQ(recording_of(text, {{"flex"}, only_time("timestamp_s")}).t_s.size(), 600U);
  }
}

TEST(Shapes, SecondsWithAPauseAreNoClockAsOneNumber) {
  for (const double first_s : {20010.0, 12345600.05}) {
    std::string text = "time,flex\n";
    for (int k = 0; k < 400; ++k)
      text += fmt::format("{:.2f},{}\n", first_s + 0.05 * k + (k < 200 ? 0 : 85), k);
    const Recording r = recording_of(text, {{"flex"}});
    EXPECT_NEAR(r.t_s.back() - r.t_s.front(), 399 * 0.05 + 85, 1e-6) << first_s;
  }
}

// Of a file alone: what comes from a board has none.
TEST(Shapes, OfViconsSectionsTheOneWithTheColumnIsRead) {
  const Recording r = recording_of(
      "Joints\n20\n,,p\nFrame,Sub Frame,X\n,,deg\n1,0,1\n2,0,1\n\nDevices\n20\n,,Flex\nFrame,Sub Frame,flex\n"
      ",,V\n1,0,10\n1,1,11\n2,0,12\n\nTrajectories\n20\n,,M\nFrame,Sub Frame,Y\n,,mm\n1,0,1\n",
      {{"flex"}});
  EXPECT_EQ(r.columns[0].value, kX);
  EXPECT_NEAR(r.t_s[2] - r.t_s[0], 0.1, 1e-9);
  EXPECT_EQ(r.warnings[0], "log.csv: rows 1 to 7 are a section without the column");
}

TEST(Shapes, ColumnsAreOfNumbersByTheFirstCellThatIsNotMissing) {
  std::istringstream stream("t_s,a_deg,event,b_deg,c_count\n0,,,,x\n1,2,grasp,,y\n2,,,,z\n");
  CsvReader reader(stream, "log.csv", {});
  EXPECT_EQ(reader.columns(), std::vector<std::string>{"a_deg"});
  EXPECT_NE(reader.notes().at(0).find("left out: b_deg, c_count;"), std::string::npos);
}

TEST(Shapes, OfLogsBesideEachOtherEachHasItsTime) {
  std::string text = "t_s,flex,t_cam_s,deg\n";
  for (int k = 0; k < 60; ++k)
    text += fmt::format("{},{},{}\n", 0.05 * k, k, k < 40 ? fmt::format("{},{}", 0.06 * k, k) : ",");
  TimeOptions both;
  both.columns = {"t_s", "t_cam_s"};
  EXPECT_NEAR(recording_of(text, {{"deg"}, times_of_reference("a", "a", both)}).t_s.back(), 39 * 0.06, 1e-9);
  EXPECT_EQ(recording_of(text, {{"flex"}, both}).t_s.size(), 60U);
}

TEST(Shapes, AMissingReadingIsNaNAndTheOthersOfItsRowStay) {
  const std::string text = "t_s,a,b,c\n0,1,,7\n0.05,nan,2,8\n0.1,,,\n0.15,3,4,9\n";
  const Recording r = recording_of(text, {{"a", "b"}, {}, Holes::some});
  EXPECT_EQ(r.t_s, (std::vector{0.0, 0.05, 0.15}));
  EXPECT_TRUE(r.columns[0].value[0] == 1 && std::isnan(r.columns[0].value[1]));
  EXPECT_TRUE(std::isnan(r.columns[1].value[0]) && r.columns[1].value[1] == 2);
  EXPECT_EQ(r.warnings.at(0), "log.csv: 1 of 3 rows have no a");
  EXPECT_EQ(r.warnings.at(2), "log.csv: 1 of 4 rows have no a or b and were left out, the first is row 4");
  EXPECT_EQ(parse_csv("t_s,a,b\n0,1,\n1,2,3\n2,3,4\n", "log", {}).warnings.at(0),
            "log: 1 of 3 rows have no b and were left out, the first is row 2");
}

TEST(Shapes, AUnitComesFromTheNameAndFromTheRowOfUnits) {
  std::istringstream stream("time_ms,index_V,middle_adc,ring (deg),pinky\n0,1,2,3,4\n50,1,2,3,4\n");
  const CsvReader named(stream, "log.csv", {});
  EXPECT_EQ(named.units(), (std::vector<std::string>{"V", "count", "deg", ""}));
  std::istringstream below("time,index,middle\nms,V,counts\n0,1,2\n50,1,2\n");
  const CsvReader row(below, "log.csv", {});
  EXPECT_EQ(row.units(), (std::vector<std::string>{"V", "count"}));
}

}  // namespace
}  // namespace flexor::recording
