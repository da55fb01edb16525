// Logs as people have them, in the shapes that loggers, spreadsheets and terminals give them. Each is read,
// and what was assumed is said in one line; or it is refused in one line.
#include <gtest/gtest.h>

#include <ostream>
#include <sstream>

#include "host/io/io.hpp"
#include "host/recording/csv.hpp"

namespace flexor::recording {
namespace {

struct Shape {
  const char* name;
  std::string text;
  std::string column;                 // to read
  std::vector<double> since_first_s;  // expected, and
  std::vector<double> value;
  std::string said;     // in one of the notes; empty: nothing has to be said
  std::string refusal;  // instead: in the error
  std::string time_unit = {};

  friend std::ostream& operator<<(std::ostream& out, const Shape& s) { return out << s.name; }
};

std::string utf16(const std::string& ascii, bool little, bool mark) {
  std::string out = mark ? (little ? "\xFF\xFE" : "\xFE\xFF") : "";
  for (const char c : ascii) {
    if (little) out += {c, '\0'};
    if (!little) out += {'\0', c};
  }
  return out;
}

const std::vector<Shape>& shapes() {
  static const std::string kPlain = "t_s,flex\n0,10\n0.05,11\n0.1,12\n";
  static const std::vector<double> kT = {0, 0.05, 0.1};
  static const std::vector<double> kX = {10, 11, 12};
  static const std::vector<Shape> all = {
      {"Plain", kPlain, "flex", kT, kX, "", ""},
      {"ByteOrderMarkAndCrLf", "\xEF\xBB\xBFt_s,flex\r\n0,10\r\n0.05,11\r\n0.1,12\r\n", "flex", kT, kX, "",
       ""},
      {"SemicolonsAndDecimalCommas", "t_s;flex\n0;10\n0,05;11\n0,1;12\n", "flex", kT, kX, "decimal commas",
       ""},
      {"BlanksInNamesOverDecimalCommas", "Zeit;Finger 1\n0,0;10,0\n0,05;11,0\n0,1;12,0\n", "Finger 1", kT, kX,
       "decimal commas", ""},
      {"TabsAndBlanksInNamesOverDecimalCommas", "Zeit\tFinger 1\n0,0\t10,0\n0,05\t11,0\n0,1\t12,0\n",
       "Finger 1", kT, kX, "decimal commas", ""},
      {"Tabs", "t_s\tflex\n0\t10\n0.05\t11\n0.1\t12\n", "flex", kT, kX, "tabs", ""},
      {"Blanks", "  t_s   flex\n  0.00   10\n  0.05   11\n  0.10   12\n", "flex", kT, kX, "blanks", ""},
      {"SepLine", "sep=;\nt_s;flex\n0;10\n0,05;11\n0,1;12\n", "flex", kT, kX, "decimal commas", ""},
      {"Utf16LittleEndian", utf16(kPlain, true, true), "flex", kT, kX, "UTF-16", ""},
      {"Utf16BigEndian", utf16(kPlain, false, true), "flex", kT, kX, "UTF-16", ""},
      {"Utf16WithoutMark", utf16(kPlain, true, false), "flex", kT, kX, "UTF-16", ""},
      {"Latin1Header", "t_s,Beugung \xB0\n0,10\n0.05,11\n0.1,12\n", "Beugung °", kT, kX, "Latin-1", ""},
      {"Comments", "# glove 7, left hand\n# 2026\nt_s,flex\n0,10\n# touched\n0.05,11\n0.1,12\n", "flex", kT,
       kX, "", ""},
      {"HeaderInAComment", "# t_s,flex\n0,10\n0.05,11\n0.1,12\n", "flex", kT, kX, "", ""},
      {"UnitsRow",
       "time;flex\nms;V\n0;1,5\n50;1,6\n100;1,7\n",
       "flex",
       kT,
       {1.5, 1.6, 1.7},
       "row of units",
       ""},
      {"NoHeader", "0,10,7\n0.05,11,7\n0.1,12,7\n", "column2", kT, kX, "column1 to column3", ""},
      {"NoHeaderMilliseconds", "0,10\n50,11\n100,12\n", "column2", kT, kX, "no header", "", "ms"},
      {"NoHeaderAndNoUnit", "0,10\n50,11\n100,12\n", "column2", {}, {}, "", "--time-unit ms"},
      {"BeginsWithinALine", "3\n0,10\n0.05,11\n0.1,12\n", "column2", kT, kX, "left out", ""},
      {"BeginsWithinALineOfTheMonitor",
       "12:03:11.073 -> 6\n12:03:11.123 -> 10,323\n12:03:11.173 -> 11,323\n12:03:11.223 -> 12,323\n",
       "column1", kT, kX, "left out", ""},
      {"Greeting", "Glove v2 ready\nt_s,flex\n0,10\n0.05,11\n0.1,12\n", "flex", kT, kX, "left out", ""},
      {"OneNameOverDecimalCommas", "flex\n1,5\n1,6\n1,7\n", "flex", {}, {}, "", "no time column"},
      {"EmptyCell", "t_s,flex\n0,10\n0.02,\n0.05,11\n0.1,12\n", "flex", kT, kX, "1 of 4 rows have no flex",
       ""},
      {"NoNumber", "t_s,flex\n0,10\n0.02,NaN\n0.05,11\n0.1,12\n", "flex", kT, kX, "1 of 4 rows have no flex",
       ""},
      {"TwoLogsJoined",
       "t_s,a,flex\n0,1,10\n.01,1,\n.02,1,\n.03,1,\n.04,1,\n.05,,11\n.06,1,\n.07,1,\n.1,,12\n", "flex", kT,
       kX, "6 of 9 rows have no flex", ""},
      {"HalfLineAfterAReset", "t_s,flex,b\n0,10,1\n0.0\n0.05,11,1\n0.06,1t_s,flex,b\n0.1,12,1\n", "flex", kT,
       kX, "2 row(s)", ""},
      {"HeaderAgain", "t_s,flex\n0,10\nt_s,flex\n0.05,11\n0.1,12\n", "flex", kT, kX, "1 row(s)", ""},
      {"SeparatorAtTheEnd", "t_s,flex,\n0,10,\n0.05,11,\n0.1,12,\n", "flex", kT, kX, "", ""},
      {"ClockTime", "Time,flex\n23:59:59.950,10\n00:00:00.000,11\n00:00:00.050,12\n", "flex", kT, kX,
       "counter", ""},
      {"SerialMonitor",
       "12:03:11.123 -> 10,323,446\n12:03:11.173 -> 11,323,446\n12:03:11.223 -> 12,323,446\n", "column1", kT,
       kX, "no header", ""},
      {"SerialMonitorWithHeader",
       "12:03:11.100 -> A0,A1\n12:03:11.123 -> 10,323\n12:03:11.173 -> 11,323\n12:03:11.223 -> 12,323\n",
       "A0", kT, kX, "", ""},
      {"LucidGlovesOnAMonitor",
       "12:03:11.123 -> A10B323C446D350E360F511G511\n12:03:11.173 -> A11B323C446D350E360F511G511\n"
       "12:03:11.223 -> A12B323C446D350E360F511G511\n",
       "thumb", kT, kX, "VR drivers", ""},
      {"LucidGlovesWithoutTime",
       "A10B323C446D350E360F511G511\nA11B323C446D350E360F511G511\n",
       "thumb",
       {},
       {},
       "",
       "has no times"},
      {"Millis", "millis,flex\n1000,10\n1050,11\n1100,12\n", "flex", kT, kX, "", ""},
      {"Microseconds", "t_us,flex\n0,10\n50000,11\n100000,12\n", "flex", kT, kX, "", ""},
      {"DayFirstDots",
       "Datum;time;flex\nx;21.11.2026 12:00:00,000;10\nx;21.11.2026 12:00:00,050;11\n"
       "x;21.11.2026 12:00:00,100;12\n",
       "flex", kT, kX, "", ""},
      {"DayFirstSlashes",
       "time,flex\n21/11/2026 12:00:00.000,10\n21/11/2026 12:00:00.050,11\n"
       "21/11/2026 12:00:00.100,12\n",
       "flex", kT, kX, "", ""},
      {"AmbiguousDate",
       "time,flex\n05/06/2026 12:00:00.000,10\n05/06/2026 12:00:00.050,11\n",
       "flex",
       {},
       {},
       "",
       "row 2: column \"time\": \"05/06/2026 12:00:00.000\" can be read as two dates"},
      {"WholeSeconds",
       "time,flex\n10:00:01,8\n10:00:01,9\n10:00:02,10\n10:00:02,11\n10:00:02,12\n10:00:02,13\n10:00:03,14\n"
       "10:00:03,15\n10:00:03,16\n10:00:03,17\n10:00:04,18\n",
       "flex",
       {0, 0.75, 1, 1.25, 1.5, 1.75, 2, 2.25, 2.5, 2.75, 3},
       {8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18},
       "4 in most, are spread evenly",
       ""},
      {"WholeSecondsOfUnlikeNumbers",
       "t_s,flex\n1,8\n1,9\n2,1\n3,10\n3,11\n3,12\n3,13\n3,14\n4,1\n5,4\n5,4\n5,4\n5,4\n5,4\n6,1\n",
       "flex",
       {},
       {},
       "",
       "row 3: the times are whole seconds, 1 to 5 rows in each"},
      {"BurstsOnWholeSecondsAtFirst",
       "time_ms,flex\n1000,10\n1000,11\n1110,12\n1110,13\n1220,14\n",
       "flex",
       {0, 0, 0.11, 0.11, 0.22},
       {10, 11, 12, 13, 14},
       "taken as a burst",
       ""},
      {"LabelsOnAMonitor",
       "12:03:11.123 -> index:10,middle:323\n12:03:11.173 -> index:11,middle:323\n"
       "12:03:11.223 -> index:12,middle:323\n",
       "index", kT, kX, "", ""},
      {"LabelsWithATime", "t_ms:1000 A0:10 A1:7\nt_ms:1050 A0:11 A1:7\nt_ms:1100\tA0: 12, A1:7\n", "A0", kT,
       kX, "", ""},
      {"LabelsWithATornRow", "t_ms:1000,A0:10\nt_ms:1020,A0\nt_ms:1050,A0:11\nt_ms:1100,A0:12\n", "A0", kT,
       kX, "1 row(s)", ""},
      {"LabelsWithoutATime",
       "A0:10 A1:7\nA0:11 A1:7\n",
       "A0",
       {},
       {},
       "",
       "has no times: A0, A1; record with"},
      {"LabelThatIsNew", "t_s:0 A0:10\nt_s:1 B7:11\n", "A0", {}, {}, "", "row 2: \"B7\" is no label"},
      {"HalfDays", "Time,flex\n11:59:59.950 AM,10\n12:00:00.000 PM,11\n12:00:00.050pm,12\n", "flex", kT, kX,
       "", ""},
      {"DatesAndHalfDays",
       "time,flex\n11/21/2026 12:59:59.950 AM,10\n11/21/2026 1:00:00.000 AM,11\n11/21/2026 1:00:00.050 "
       "AM,12\n",
       "flex", kT, kX, "", ""},
      {"MinutesAndSeconds", "time,flex\n59:59.95,10\n00:00.00,11\n00:00.05,12\n", "flex", kT, kX, "counter",
       ""},
      {"HoursOrMinutes",
       "time,flex\n3:11,10\n3:12,11\n",
       "flex",
       {},
       {},
       "",
       "row 2: column \"time\": \"3:11\" may be hours and minutes, or minutes and seconds; write it as "
       "0:3:11"},
      {"GermanClock", "Uhrzeit;flex\n12:03:11,10;10\n12:03:11,15;11\n12:03:11,20;12\n", "flex", kT, kX, "",
       ""},
      {"CommentAboveTheHeader", "# time, flex, of glove 7\ntime_ms,flex,b\n0,10,1\n50,11,1\n100,12,1\n",
       "flex", kT, kX, "", ""},
      {"Iso8601",
       "timestamp,flex\n2026-11-21T12:00:00.000Z,10\n2026-11-21T12:00:00.050Z,11\n"
       "2026-11-21T12:00:00.100Z,12\n",
       "flex", kT, kX, "", ""},
      {"DateAndTimeApart",
       "Date,Time,flex\n2026-11-21,12:00:00.000,10\n2026-11-21,12:00:00.050,11\n"
       "2026-11-21,12:00:00.100,12\n",
       "flex", kT, kX, "", ""},
      {"PointsAndCommasMixed",
       "t_s;flex\n0;1.5\n0,05;11\n0,1;12\n",
       "flex",
       {},
       {},
       "",
       "decimal point and some"},
      {"DecimalCommasBetweenCommas",
       "t_s,flex\n0,0,10,5\n0,05,11,5\n",
       "flex",
       {},
       {},
       "",
       "need another separator"},
      {"ColumnTwice", "t_s,flex,flex\n0,10,1\n0.05,11,1\n0.1,12,1\n", "flex", {}, {}, "", "occurs twice"},
      {"HugeNumber",
       "t_s,flex\n0,10\n0.05,1e308\n0.1,12\n",
       "flex",
       {},
       {},
       "",
       "row 3: column \"flex\": 1e308"},
      {"Prose", "this is no table\nat all\n", "flex", {}, {}, "", "no time column"},
      {"MostRowsTorn", "t_s,flex\n0,10\n1\n2\n3\n4\n5\n6\n7\n8\n9\n", "flex", {}, {}, "", "are torn"}};
  return all;
}

class Shapes : public testing::TestWithParam<Shape> {};

TEST_P(Shapes, IsReadOrRefusedInOneLine) {
  const Shape& s = GetParam();
  std::istringstream stream(s.text);
  try {
    CsvReader reader(stream, "log.csv", {{s.column}, s.time_unit});
    const Recording r = read(reader);
    ASSERT_EQ(s.refusal, "") << "was read";
    ASSERT_EQ(r.t_s.size(), s.since_first_s.size());
    for (std::size_t k = 0; k < r.t_s.size(); ++k) {
      EXPECT_NEAR(r.t_s[k] - r.t_s[0], s.since_first_s[k], 1e-6);
    }
    EXPECT_EQ(r.column(s.column).value, s.value);
    bool said = s.said.empty();
    for (const std::string& note : r.warnings) {
      said = said || note.find(s.said) != std::string::npos;
      EXPECT_EQ(note.find('\n'), std::string::npos) << note;
      EXPECT_TRUE(note.starts_with("log.csv: ")) << note;
    }
    EXPECT_TRUE(said) << "nothing says: " << s.said;
  } catch (const io::InputError& error) {
    const std::string what = error.what();
    ASSERT_NE(s.refusal, "") << what;
    EXPECT_NE(what.find(s.refusal), std::string::npos) << what;
    EXPECT_EQ(what.find('\n'), std::string::npos) << what;
    EXPECT_TRUE(what.starts_with("log.csv: ")) << what;
  }
}

INSTANTIATE_TEST_SUITE_P(Log, Shapes, testing::ValuesIn(shapes()),
                         [](const auto& i) { return i.param.name; });

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
