// Logs as people have them, in the shapes that loggers, spreadsheets and terminals give them: for tests, of every source.
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "host/recording/time.hpp"

namespace flexor::recording {

inline const std::vector<double> kT = {0, 0.05, 0.1};
inline const std::vector<double> kX = {10, 11, 12};
inline const std::vector<double> kMinusX = {-10, -11, -12};
inline const std::vector<double> kThousands = {1013.5, 998.5, 1001.5};

// Is read, and what is assumed is one of the notes.
struct Shape {
  const char* name;
  std::string text;
  std::string note = {};  // a part of it; empty: any or none
  std::string column = "flex";
  std::vector<double> since_first_s = kT;
  std::vector<double> value = kX;
  TimeOptions time = {};

  friend std::ostream& operator<<(std::ostream& out, const Shape& s) { return out << s.name; }
};

// Is refused in one line.
struct Misshape {
  const char* name;
  std::string text;
  std::string reason;  // a part of it
  std::string column = "flex";
  TimeOptions time = {};

  friend std::ostream& operator<<(std::ostream& out, const Misshape& s) { return out << s.name; }
};

inline TimeOptions column_of_time(const char* name) {
  TimeOptions out;
  out.columns = {"other", name};
  return out;
}

inline TimeOptions only_time(const char* name) {
  TimeOptions out;
  out.columns = {name};
  return out;
}

inline TimeOptions rows_a_second(double rate_hz) {
  TimeOptions out;
  out.log_rate_hz = rate_hz;
  return out;
}

template <class... Number>
std::vector<double> numbers(Number... number) {
  return {static_cast<double>(number)...};
}

inline std::string utf16(const std::string& ascii, bool little, bool mark) {
  std::string out = mark ? (little ? "\xFF\xFE" : "\xFE\xFF") : "";
  for (const char c : ascii) {
    if (little) out += {c, '\0'};
    if (!little) out += {'\0', c};
  }
  return out;
}

// Three rows of a pattern: @ is 000, 050, 100; ~ is 0, 0.05, 0.1; ^ is 0, 50, 100; and # 10, 11, 12.
inline std::string three(const std::string& pattern) {
  std::string out;
  for (std::size_t k = 0; k < 3; ++k) {
    for (const char c : pattern) {
      const std::size_t set = std::string("@~^#").find(c);
      static constexpr const char* kCells[4][3] = {
          {"000", "050", "100"}, {"0", "0.05", "0.1"}, {"0", "50", "100"}, {"10", "11", "12"}};
      out += set == std::string::npos ? std::string(1, c) : kCells[set][k];
    }
  }
  return out;
}

inline const std::string kPlain = "t_s,flex\n0,10\n0.05,11\n0.1,12\n";

inline const std::vector<Shape> kShapes = {
    {"Plain", kPlain},
    {"ByteOrderMarkAndCrLf", "\xEF\xBB\xBFt_s,flex\r\n0,10\r\n0.05,11\r\n0.1,12\r\n"},
    {"BlanksInNamesOverDecimalCommas", "Zeit;Finger 1\n0,0;10,0\n0,05;11,0\n0,1;12,0\n", "decimal commas",
     "Finger 1"},
    {"TabsAndBlanksInNamesOverDecimalCommas", "Zeit\tFinger 1\n0,0\t10,0\n0,05\t11,0\n0,1\t12,0\n",
     "decimal commas", "Finger 1"},
    {"Tabs", "t_s\tflex\n" + three("~\t#\n"), "tabs"},
    {"Blanks", "  t_s   flex\n" + three("  ~   #\n"), "blanks"},
    {"SepLine", "sep=;\nt_s;flex\n0;10\n0,05;11\n0,1;12\n", "decimal commas"},
    {"Utf16LittleEndian", utf16(kPlain, true, true), "UTF-16"},
    {"Utf16BigEndian", utf16(kPlain, false, true), "UTF-16"},
    {"Utf16WithoutMark", utf16(kPlain, true, false), "UTF-16"},
    {"Latin1Header", "t_s,Beugung \xB0\n0,10\n0.05,11\n0.1,12\n", "Latin-1", "Beugung °"},
    {"Comments", "# glove 7, left hand\n# 2026\nt_s,flex\n0,10\n# touched\n0.05,11\n0.1,12\n"},
    {"HeaderInAComment", "# t_s,flex\n" + three("~,#\n")},
    {"UnitsRow", "time;flex\nms;V\n0;1,5\n50;1,6\n100;1,7\n", "row of units", "flex", kT,
     numbers(1.5, 1.6, 1.7)},
    {"NoHeader", three("~,#,7\n"), "column1 to column3", "column2"},
    {"NoHeaderMilliseconds", three("^,#\n"), "no header", "column2", kT, kX, "ms"},
    {"BeginsWithinALine", "3\n" + three("~,#\n"), "left out", "column2"},
    {"BeginsWithinALineOfTheMonitor", "12:03:11.073 -> 6\n" + three("12:03:11.@ -> #,323\n"), "left out",
     "column1"},
    {"Greeting", "Glove v2 ready\nt_s,flex\n" + three("~,#\n"), "left out"},
    {"EmptyCell", "t_s,flex\n0,10\n0.02,\n0.05,11\n0.1,12\n", "1 of 4 rows have no flex"},
    {"TwoLogsJoined", "t_s,a,flex\n0,1,10\n.01,1,\n.02,1,\n.03,1,\n.04,1,\n.05,,11\n.06,1,\n.07,1,\n.1,,12\n",
     "6 of 9 rows have no flex"},
    {"HalfLineAfterAReset", "t_s,flex,b\n0,10,1\n0.0\n0.05,11,1\n0.06,1t_s,flex,b\n0.1,12,1\n", "2 row(s)"},
    {"SeparatorAtTheEnd", "t_s,flex,\n" + three("~,#,\n")},
    {"ClockTime", "Time,flex\n23:59:59.950,10\n00:00:00.000,11\n00:00:00.050,12\n", "counter"},
    {"SerialMonitor", three("12:03:11.@ -> #,323,446\n"), "no header", "column1"},
    {"SerialMonitorWithHeader", "12:03:11.100 -> A0,A1\n" + three("12:03:11.@ -> #,323\n"), "", "A0"},
    {"LucidGlovesOnAMonitor", three("12:03:11.@ -> A#B323C446D350E360F511G511\n"), "VR drivers",
     "thumb_count"},
    {"Millis", "millis,flex\n1000,10\n1050,11\n1100,12\n"},
    {"Microseconds", "t_us,flex\n0,10\n50000,11\n100000,12\n"},
    {"DayFirstDots", "Datum;time;flex\n" + three("x;21.11.2026 12:00:00,@;#\n")},
    {"DayFirstSlashes", "time,flex\n" + three("21/11/2026 12:00:00.@,#\n")},
    {"WholeSeconds",
     "time,flex\n10:00:01,8\n10:00:01,9\n10:00:02,10\n10:00:02,11\n10:00:02,12\n10:00:02,13\n10:00:03,14\n10:"
     "00:03,15\n10:00:03,16\n10:00:03,17\n10:00:04,18\n",
     "4 in most, are spread evenly", "flex", numbers(0, 0.75, 1, 1.25, 1.5, 1.75, 2, 2.25, 2.5, 2.75, 3),
     numbers(8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18)},
    {"BurstsOnWholeSecondsAtFirst", "time_ms,flex\n1000,10\n1000,11\n1110,12\n1110,13\n1220,14\n",
     "taken as a burst", "flex", numbers(0, 0, 0.11, 0.11, 0.22), numbers(10, 11, 12, 13, 14)},
    {"LabelsOnAMonitor", three("12:03:11.@ -> index:#,middle:323\n"), "", "index"},
    {"LabelsWithATime", "t_ms:1000 A0:10 A1:7\nt_ms:1050 A0:11 A1:7\nt_ms:1100\tA0: 12, A1:7\n", "", "A0"},
    {"LabelsWithAShortRow", "t_ms:1000,A0:10\nt_ms:1020,A0\nt_ms:1050,A0:11\nt_ms:1100,A0:12\n", "1 row(s)",
     "A0"},
    {"HalfDays", "Time,flex\n11:59:59.950 AM,10\n12:00:00.000 PM,11\n12:00:00.050pm,12\n"},
    {"DatesAndHalfDays",
     "time,flex\n11/21/2026 12:59:59.950 AM,10\n11/21/2026 1:00:00.000 AM,11\n11/21/2026 1:00:00.050 "
     "AM,12\n"},
    {"MinutesAndSeconds", "time,flex\n59:59.95,10\n00:00.00,11\n00:00.05,12\n", "counter"},
    {"GermanClock", "Uhrzeit;flex\n12:03:11,10;10\n12:03:11,15;11\n12:03:11,20;12\n"},
    {"CommentAboveTheHeader", "# time, flex, of glove 7\ntime_ms,flex,b\n" + three("^,#,1\n")},
    {"Iso8601", "timestamp,flex\n" + three("2026-11-21T12:00:00.@Z,#\n")},
    {"PackedDates", "time,flex\n20261121120000000,10\n20261121120000050,11\n20261121120000100,12\n"},
    {"PackedIso", "time,flex\n20261121T235959.950,10\n20261122T000000.000,11\n20261122T000000.050,12\n"},
    {"PackedClock", "time,flex\n95959950,10\n100000000,11\n100000050,12\n", "a clock as one number"},
    {"PackedClockWithAFraction", "time,flex\n095959.950,10\n100000.000,11\n100000.050,12\n",
     "a clock as one number"},
    {"PackedClockOfWholeSecondsWithoutAHeader",
     "095958,8\n095958,9\n095959,10\n095959,11\n100000,12\n100000,13\n", "a clock as one number", "column2",
     numbers(0, 0.5, 1, 1.5, 2, 2.5), numbers(8, 9, 10, 11, 12, 13)},
    {"PackedDatesWithAFraction",
     "time,flex\n20261120235959.950,10\n20261121000000.000,11\n20261121000000.050,12\n"},
    {"SecondsThatAreNoPackedClock", "time,flex\n95959.95,10\n95960.00,11\n95960.05,12\n"},
    {"DateAndTimeApart", "Date,Time,flex\n" + three("2026-11-21,12:00:00.@,#\n")},
    {"FirstRowsEmpty", "time,flex\n,\n,\n,\n" + three("~,#\n")},
    {"SecondsSince1970", "time,flex\n1700000000,10\n1700000001,11\n1700000002,12\n", "", "flex",
     numbers(0, 1, 2)},
    {"FirstCellsMissing", "t_s,flex\n0,\n0.01,NA\n0.02,None\n0.03,null\n0.04,-\n0.1,10\n0.15,11\n0.2,12\n",
     "5 of 8 rows have no flex"},
    {"TimesOfDayBesideACounter", "1,13:10:29.000,10\n2,13:10:29.050,11\n3,13:10:29.100,12\n",
     "column2 is the time", "column3"},
    {"ClockOfAnyNameBesideACounter",
     "t,stamp,flex\n1,13:10:29.000,10\n2,13:10:29.050,11\n3,13:10:29.100,12\n"},
    {"Manus", "Elapsed_Time_In_Milliseconds,flex\n" + three("^,#\n")},
    {"OpenSim",
     "ik\nversion=1\nnRows=3\nnColumns=2\ninDegrees=yes\nendheader\ntime\tflex\n" + three("~\t#\n"),
     "in deg by the titles"},
    {"Trc",
     "PathFileType\t4\nDataRate\tUnits\n20\tmm\nFrame#\tTime\tM1\t\t\n\t\tX1\tY1\tZ1\n\n" +
         three("1\t~\t#\t1\t2\n"),
     "rows 1 to 4 are titles", "X1"},
    {"Vicon",
     "Model Outputs\n20\n,,p:LIndex,,,p:LThumb,,\nFrame,Sub "
     "Frame,X,Y,Z,X,Y,Z\n,,deg,deg,deg,deg,deg,deg\n5,0,10,1,2,3,4,5\n6,0,11,1,2,3,4,5\n7,0,12,1,2,3,4,5\n",
     "row of units", "p:LIndex_X"},
    {"Motive",
     "Format,1\n\n,,Bone,Bone,Bone,Bone\n,,A,A,B,B\n,ID,1,1,2,2\n,,Rotation,Rotation,Rotation,Rotation\n"
     "Frame,Time (Seconds),X,Y,X,Y\n" +
         three("0,~,1,2,#,3\n"),
     "titles", "B_Rotation_X"},
    {"NamesAndValuesWithUnits", three("12:03:11.@ -> Flex 1 : # ohms, Bend : 32.1 degrees\n"), "", "Flex 1"},
    {"FingersAloneForVr", three("12:03:11.@ -> A#B323\n"), "VR drivers", "thumb_count"},
    {"Quotes", "t_s,\"a, \"\"quoted\"\"\"\n0,\"10\"\n0.05,11\n0.1,12\n", "", "a, \"quoted\""},
    {"WordsBesideNumbers", "Frame,Time(ms),Phase,∠ABC\n0,0,Flex,10\n1,50,Flex,11\n2,100,Flex,12\n", "",
     "∠ABC"},
    {"Zones",
     "timestamp,flex\n2024-02-29T23:59:59.95Z,10\n2024-03-01T01:00:00+01:00,11\n2024-03-01 "
     "00:00:00.05Z,12\n"},
    {"LastLineHalfWritten", "t_s,flex,b\n0,10,2\n0.05,11,3\n0.1,12,4\n0.15,4"},
    {"AChosenTime", "time_ms,other (ms),flex\n7,0,10\n8,50,11\n9,100,12\n", "", "flex", kT, kX,
     column_of_time("other (ms)")},
    {"ATimeBesideAnArrow",
     "13:11:09.000 -> time_ms:0,flex:10\n13:11:09.100 -> time_ms:50,flex:11\n13:11:09.105 -> "
     "time_ms:100,flex:12\n",
     "", "flex", kT, kX, column_of_time("time_ms")},
    {"ADateThatStandsBesideAClock", "Date,Time,flex\n" + three("20261121,13:11:09.@,#\n")},
    {"TimeOfDayBlankList", three("13:11:09.@ #,500\n"), "", "column1"},
    {"TimeOfDayTabList", three("13:11:09.@\t#,500\n"), "", "column1"},
    {"DateAndTimeBlankList", three("2026-05-01 13:11:09.@ #,500\n"), "", "column1"},
    {"DateAndTimeInBracketsTabList", three("[2026-05-01 13:11:09.@]\t#,500\n"), "", "column1"},
    {"LabelsWithEqualSigns", three("t_s=~ flex=# b=7\n")},
    {"LabelsBetweenSemicolonsOrBars", "t_s:0;flex:10\nt_s: 0.05 | flex: 11\nt_s:0.1;flex:12\n"},
    {"SerialStudio", "RX Date/Time,flex\n" + three("2026/05/01 12:03:11::@,#\n")},
    {"TitlesInPairs", "Name: Ann\nDate: 2026-05-01\nt_s;flex\n" + three("~;#\n"), "titles"},
    {"OldMot",
     "name walk.mot\ndatacolumns 2\ndatarows 3\nrange 0 0.1\nendheader\ntime\tflex\n" + three("~\t#\n"),
     "titles"},
    {"GreetingAboveLabels", "Flex glove v2\n" + three("t_s:~,flex:#\n"), "left out"},
    {"LabelsWithSeveralWords", three("t_s : ~, flex : #, State : in a grip\n")},
    {"ThousandthsBelowAWholeNumber", "t_s,flex\n0,200\n0.05,0.123\n0.1,0.200\n", "", "flex", kT,
     numbers(200, 0.123, 0.2)},
    {"ClockAsFileNamesHaveIt", "time,flex\n23-59-59.950,10\n00-00-00.000,11\n00-00-00-050,12\n", "counter"},
    {"DateAndClockAsFileNamesHaveThem",
     "time,flex\n2026-05-01_23-59-59.95,10\n2026-05-02_00-00-00.00,11\n2026-05-02_00-00-00.05,12\n"},
    {"UnitsRowWithAnUnknownUnit", "Time,flex,Force\n[s],[count],[N]\n" + three("~,#,1\n"), "row of units"},
    {"WordsAtFirst", "t_s,flex\n0,NA\n.01,-nan\n.02,nan(ind)\n.03,#NV\n.04,?\n" + three("1~,#\n"),
     "5 of 8 rows"},
    {"MinusSigns", "t_s,flex\n" + three("~,\xE2\x88\x92#\n"), "", "flex", kT, kMinusX},
    {"AnglesAround", three("<~;#;7>\n"), "semicolons", "column2"},
    {"ZoneOfDigits",
     "time,flex\n2026/05/31 13:05:00.00+0200,10\n2026/05/31 13:05:00.05+0200,11\n2026/05/31 "
     "11:05:00.10 UTC,12\n"},
    {"CounterAndARate", "time,flex\n0,10\n1,11\n2,12\n", "20 rows are a second", "flex", kT, kX,
     rows_a_second(20)},
    {"UnitBehindASlash", "% Time/ms,flex\n" + three("^,#\n")},
    {"CarriageReturnsAlone", "t_s,flex\r0,10\r0.05,11\r0.1,12\r"},
    {"HeaderAgainInOtherCapitals", "t_s,flex\n0,10\nT_S,Flex\n0.05,11\n0.1,12\n", "1 row(s)"},
    {"GermanThousands", "t_s;flex\n0,00;1.013,5\n0,05;998,5\n0,10;1.001,5\n", "decimal commas", "flex", kT,
     kThousands},
    {"EnglishThousands", "t_s;flex\n0.00;1,013.5\n0.05;998.5\n0.10;1,001.5\n", "semicolons", "flex", kT,
     kThousands},
    {"MillisecondsSince1970", "timestamp,flex\n" + three("1700000000@,#\n"), "ms since 1970"},
    {"NanosecondsSince1970", "timestamp,flex\n" + three("1700000000@000000,#\n"), "ns since 1970"},
    {"WholeSecondsBesideTheirMilliseconds",
     "Time,ms,flex\n10:00:01,900,9\n10:00:01,950,10\n10:00:02,0,11\n10:00:02,250,12\n10:00:02,500,13\n"
     "10:00:02,750,14\n10:00:03,0,15\n10:00:03,250,16\n10:00:03,500,17\n10:00:03,750,18\n10:00:04,0,19\n",
     "are one time", "flex", numbers(0, 0.05, 0.1, 0.35, 0.6, 0.85, 1.1, 1.35, 1.6, 1.85, 2.1),
     numbers(9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19)},
    {"ACounterWithAUnitBesideAClock",
     "t_s,clock,flex\n0,13:10:29.00,10\n1,13:10:29.05,11\n2,13:10:29.10,12\n"},
    {"NoHeaderAndTheLastCellOfTheFirstRowMissing", "0,10,\n0.05,11,7\n0.1,12,8\n", "column1 to column3",
     "column2"},
    {"RowsMostlyMissingUnderTitles",
     "Exported by X 3.1\nby: Ann\ntime,a,flex,b\n0,,10,\n0.01,1,,\n0.05,,11,\n0.06,,,1\n0.1,,12,\n",
     "titles"},
    {"OneOfManyIsFilledUnderATitle",
     "Joined\nt_s,flex,a,b,c,d\n0,10,,,,\n0.01,,1,,,\n0.05,11,,,,\n0.06,,,,,2\n0.1,12,,,,\n", "left out"},
    {"ViconWithAFrameMissing",
     "Joints\n20\n,,P1:RIndex,,\nFrame,Sub Frame,X,Y,Z\n,,deg,deg,deg\n5,0,10,1,2\n6,0,11,1,2\n8,0,12,1,2\n",
     "20 rows are a second", "X", numbers(0, 0.05, 0.15)},
    {"MotiveWithIdsThatHaveNoLabel",
     "Format,1\n,,Bone,Bone,Bone,Bone\n,,A,A,B,B\n,,A1,A1,A2,A2\n,,Rotation,Rotation,Rotation,Rotation\n"
     "Frame,Time (Seconds),X,Y,X,Y\n" +
         three("0,~,1,2,#,3\n"),
     "titles", "B_Rotation_X"},
    {"StorageOfOpenSimIsInRadians", "Results\nversion=3\nendheader\ntime\tflex\n" + three("~\t#\n"),
     "in rad by the titles"},
    {"TicksOfDotNet", "time,flex\n639000000000000000,10\n639000000001024000,11\n639000000002048000,12\n",
     "since the year 1", "flex", numbers(0, 0.1024, 0.2048)},
    {"TicksOfWindows", "time,flex\n" + three("13400000000@0000,#\n"), "since 1601"},
    {"ClockWithoutZeros", "time,flex\n9:59:59.950,10\n10:0:0.000,11\n10:0:0.050,12\n"},
    {"ClockWithAColonBeforeTheMilliseconds", "time,flex\n9:59:59:950,10\n10:0:0:0,11\n10:0:0:50,12\n"},
    {"ClockInBrackets", three("[13:00:17.@] #\n"), "", "column1"},
    {"ClockInBracketsAndLabels", three("[13:00:17.@] flex:#\n")},
    {"DateInBracketsAndBlanks", three("[2026-05-01 13:00:17.@] # 310\n"), "", "column1"},
    {"DateInBracketsAndSemicolons", three("[2026-05-01 13:00:17.@]: #;310\n"), "", "column1"},
    {"TeraTerm", three("[Fri May 01 13:00:17.@ 2026] #,310\n"), "", "column1"},
    {"TeraTermElapsed", three("[0 00:00:17.@] #\t310\n"), "", "column1"},
    {"DateBlankClockBlankValue", three("2026-05-01 13:00:17.@ #\n"), "", "column1"},
    {"ClockCommaLabels", three("13:00:17.@, flex:#, b:7\n")},
    {"DecimalCommasBehindADate", "Date Time a flex\n" + three("01.05.2026 13:00:17.@ 3,5 #,0\n"), "blanks"},
    {"LevelsBeforeRows", "Date Time level info flex\n" + three("2026-05-01 13:00:17.@ INFO 1 #\n")},
    {"LevelsAsLabels", three("12:03:11.@ -> debug: 1 flex: #\n")},
    {"HeaderBehindAClock", "2026-05-01 13:00:16.9,A0,flex\n" + three("2026-05-01 13:00:17.@,1,#\n")},
    {"SourceBehindAClock", three("May 01 13:00:17.@ pi glove[7]: #,310\n"), "", "column1"},
    {"RowsOfMatlab", three("[~ # 310];\n"), "blanks", "column2"},
    {"RuleBelowTheNames", "t_s  flex\n---- ----\n" + three("~ #\n"), "blanks"},
    {"PythonsLogging", three("2026-05-01 13:00:17,@ - glove - INFO - #,310\n"), "", "column1"},
    {"PythonsBytes", three("[13:00:17.@] b'#,310,311,312,313,314,315\\r\\n'\n"), "", "column1"},
    {"SecondsSince1970BlankList", three("1777640417.@ #,310\n"), "", "column1"},
    {"EspIdfInColours", three("\x1b[0;32mI (1@) glove: flex=# b=7\x1b[0m\n")},
    {"EspIdfBelowOtherTags", "I (900) main: starts\n" + three("I (1@) glove: flex: #, b: 7\n"), "left out"},
    {"ArduinoOnEsp32", three("[  1@][I][glove.ino:9] loop(): flex=# b=7\n")},
    {"Zephyr", three("[00:00:01.@,000] <inf> glove: flex=#\n")},
    {"LoggerOfRos", three("[INFO] [1777640417.@000000] [glove]: flex=# b=7\n")},
    {"YearOfTwoDigits", three("01.05.26 13:00:17,@;#\n"), "", "column2"},
    {"MonthFirstWithHalfDays", "time,flex\n" + three("05/01/2026 01:00:17.@ PM,#\n"), "month first"},
    {"MonthByName", "Time,flex\n" + three("01-May-2026 13:00:17.@,#\n")},
    {"MonthByItsGermanName",
     "Zeit;flex\n1-Dez-2026 23:59:59.95;10\n2. Dezember 2026 0:00:00,00;11\n2-Dez-2026 0:00:00.05;12\n"},
    {"RateWithItsUnitInATitle", "Sampling rate (Hz): 20\nflex,b\n" + three("#,1\n"), "20 rows are a second"},
    {"CardThatLostPower", "t_s,flex\n0,10\n.02,1" + std::string(8, '\0') + "\n0.05,11\n0.1,12\n", "1 row(s)"},
    {"DateOfJavaScript", "time,flex\n" + three("Fri May 01 2026 13:00:17.@ GMT+0200,#\n")},
    {"TimedeltaOfPandas", ",flex\n" + three("0 days 00:00:01.@000,#\n")},
    {"IndexOfPandas", ",flex\n" + three("~,#\n")},
    {"UnitInEachCell", "Time,flex\n" + three("~ sec,#\n")},
    {"DateAndZone", "time,flex\n" + three("2026-05-01 13:00:17.@ CEST,#\n")},
    {"DateOfUnix", "time,flex\n" + three("Fri May  1 13:00:17.@ CET 2026,#\n")},
    {"HourMinuteSecond", "rtc_hour,rtc_minute,rtc_second,flex\n" + three("9,5,7.@,#\n"), "are one time"},
    {"HourMinuteSecondOverMidnight", "h,m,s,ms,flex\n23,59,59,950,10\n0,0,0,0,11\n0,0,0,50,12\n"},
    {"EachInAUnitOfItsOwn",
     "t_h,t_min,t_s,flex\n0,0,0,10\n1.38889e-5,8.3333e-4,0.05,11\n2.77778e-5,1.66667e-3,0.1,12\n", "", "flex",
     kT, kX, only_time("t_s")},
    {"SecondsAndNanoseconds", "a.stamp.sec,a.stamp.nanosec,flex\n" + three("7,@000000,#\n"), "are one time"},
    {"SecondsAndMicroseconds", "tv_sec,tv_usec,flex\n7,950000,10\n8,0,11\n8,50000,12\n", "are one time"},
    {"StampOfRos", "f.header.stamp,flex\n" + three("1700000000@000000,#\n"), "ns since 1970"},
    {"FrenchTime", "Temps (ms);flex\n" + three("^;#\n")},
    {"UnixTime", "unix_time,flex\n" + three("~,#\n")},
    {"ElapsedOfAnApp", "seconds_elapsed,flex\n" + three("~,#\n")},
    {"JapaneseTime", "時間,flex\n" + three("~,#\n")},
    {"LabView",
     "LabVIEW Measurement\t\nTime\t13:00:17.1\n***End_of_Header***\t\nY_Unit_Label\tVolts\nX0\t0.0\n"
     "***End_of_Header***\t\nX_Value\tflex\tb\tComment\n" +
         three("~\t#\t1\n"),
     "in V by the titles"},
    {"LabViewWithoutTimes",
     "LabVIEW Measurement\t\nX_Columns\tNo\n***End_of_Header***\t\nX0\t0.0\t0.0\nDelta_X\t0.05\t0.05\n"
     "***End_of_Header***\t\nX_Value\tflex\tb\tComment\n" +
         three("\t#\t1\n"),
     "20 rows are a second"},
    {"Qualisys", "FREQUENCY\t20\nDATA_INCLUDED\t3D\nflex\tM1 Y\n" + three("#\t1\n"), "20 rows are a second"},
    {"CounterOf16Bits", "time_ms,flex\n65500,10\n14,11\n64,12\n", "passes its end"},
    {"SignedCounterOf16Bits", "time_ms,flex\n32750,10\n-32736,11\n-32686,12\n", "passes its end"},
    {"CounterOf32Bits", "t_us,flex\n4294950000,10\n32704,11\n82704,12\n", "passes its end"},
    {"GreetingOfAsManyWords", "Flex glove v1.2 ready\n" + three("~ # 7 8\n"), "left out", "column2"},
    {"Bars", "t_s | flex\n" + three("~ | #\n"), "bars"},
    {"BarsAround", "| t_s | flex |\n|---|---|\n" + three("| ~ | # |\n"), "bars"},
    {"BarsAroundBehindAClock", three("12:03:11.@ -> |#|7|\n"), "bars", "column1"},
    {"ATimeThatStandsBesideOne", "t_s,clock_ms,flex\n" + three("0,^,#\n")},
    {"NoTimeAtAll", "10,7\n11,8\n12,9\n", "20 rows are a second", "column1", kT, kX, rows_a_second(20)}};

inline const std::vector<Misshape> kMisshapes = {
    {"NoHeaderAndNoUnit", "0,10\n50,11\n100,12\n", "--time-unit ms", "column2"},
    {"OneNameOverDecimalCommas", "flex\n1,5\n1,6\n1,7\n", "no time column"},
    {"LucidGlovesWithoutTime", "A10B323C446D350E360F511G511\nA11B323C446D350E360F511G511\n", "has no times",
     "thumb_count"},
    {"AmbiguousDate", "time,flex\n05/06/2026 12:00:00.000,10\n05/06/2026 12:00:00.050,11\n",
     "row 2: column \"time\": \"05/06/2026 12:00:00.000\" can be read as two dates"},
    {"WholeSecondsOfUnlikeNumbers",
     "t_s,flex\n1,8\n1,9\n2,1\n3,10\n3,11\n3,12\n3,13\n3,14\n4,1\n5,4\n5,4\n5,4\n5,4\n5,4\n6,1\n",
     "row 3: the times are whole seconds, 1 to 5 rows in each"},
    {"LabelsWithoutATime", "A0:10 A1:7\nA0:11 A1:7\n", "has no times: A0, A1; record with", "A0"},
    {"LabelThatIsNew", "t_s:0 A0:10\nt_s:1 B7:11\n", "1 row(s) of data", "A0"},
    {"HoursOrMinutes", "time,flex\n3:11,10\n3:12,11\n",
     "row 2: column \"time\": \"3:11\" may be hours and minutes, or minutes and seconds; write it as 0:3:11"},
    {"PointsAndCommasMixed", "t_s;flex\n0;1.5\n0,05;11\n0,1;12\n", "decimal point and some"},
    {"DecimalCommasBetweenCommas", "t_s,flex\n0,0,10,5\n0,05,11,5\n", "need another separator"},
    {"ColumnTwice", "t_s,flex,flex\n0,10,1\n0.05,11,1\n0.1,12,1\n", "occurs twice"},
    {"HugeNumber", "t_s,flex\n0,10\n0.05,1e308\n0.1,12\n", "row 3: column \"flex\": 1e308"},
    {"Prose", "this is no table\nat all\n", "no time column"},
    {"MostRowsMalformed", "t_s,flex\n0,10\n1\n2\n3\n4\n5\n6\n7\n8\n9\n", "are malformed"},
    {"TwoClocks", "0.1,13:10:29.000,10\n0.2,13:10:29.050,11\n",
     "\"column1\" and \"column2\" could both be the time", "column3"},
    {"MillisecondsTakenForAClock", "time,flex\n95959900,1\n95959950,2\n95960000,3\n", "add --time-unit ms"},
    {"StepsOfRowsOrMilliseconds", "time,flex\n0,1\n4,2\n8,3\n", "milliseconds, --time-unit ms"},
    {"TwoGlovesInTurn", "t_s,hand,flex\n" + three("~,L,1\n~,R,2\n") + three("1~,L,1\n1~,R,2\n"),
     "by \"hand\" (L, R)"},
    {"TwoGlovesInOneFile", "t_s,flex\n0,1\n0.05,2\nt_s,thumb\n0.1,9\n0.15,9\n", "the rows of another glove"},
    {"SeparatorOfThousands", "t_s,flex\n0,980\n0.05,990\n0.1,1.010\n", "what separates the thousands"},
    {"Json", "{\"t\":0,\"flex\":1}\n{\"t\":1,\"flex\":1}\n", "is JSON"},
    {"Nanoseconds", "time,flex\n0,1\n50000000,2\n100000000,3\n", "--time-unit ns"},
    {"NanosecondsTakenForMilliseconds", "time,flex\n0,1\n50000000,2\n100000000,3\n", "--time-unit ns", "flex",
     "ms"},
    {"FirstReadingTakenForTheTime", "432,1\n431,1\n433,1\n430,1\n429,1\n428,1\n", "--log-rate 50", "column2"},
    {"BadCell", "t_s,flex\n0,1\n1,x7\n", "row 3: column \"flex\": \"x7\" is not a number"},
    {"BadTime", "t_s,flex\n0,1\nbad,2\n", "row 3: column \"t_s\""},
    {"Infinite", "t_s,flex\n0,1\n1,-inf\n", "row 3: column \"flex\": -inf is not a measurement"},
    {"NoSuchColumn", "sep=;\nZeit(s);t_s;A\n0,5;0,5;1,5\n1,5;1,5;2,5\n",
     "no column \"B\"; there are: Zeit(s), t_s, A", "B"},
    {"Reset", "t_s,flex\n0,1\n1,2\n2,3\n0,1\n1,2\n", "row 5: time does not increase"},
    {"OneTime", "t_s,flex\n3,1\n3,2\n3,3\n", "row 3: time does not increase"},
    {"Empty", "", "is empty"},
    {"HeaderAlone", "t_s,flex\n", "has a header but no data"},
    {"OneRow", "t_s,flex\n0,1\n", "at least two"},
    {"DegreeSigns", "t_s,flex\n0,12.3°\n0.05,12.4°\n", "\"flex\": \"12.3°\" has its unit behind it"},
    {"Percents", "t_s,flex\n0,43.5%\n0.05,44%\n", "\"43.5%\" has its unit behind it"},
    {"Shuffled", "t_s,flex\n0.4,1\n0.1,2\n0.3,3\n0,4\n0.2,5\n0.15,6\n", "sort the log by time"},
    {"Matlab", "MATLAB 5.0 MAT-file\x01\x02", "is a MATLAB file"},
    {"Matlab73", "MATLAB 7.3 MAT-file, Platform: GLNXA64\x01", "is a MATLAB file"},
    {"JsonOverLines", "[\n  {\"t\":0,\"flex\":1},\n  {\"t\":1,\"flex\":1}\n]\n", "is JSON"},
    {"WebPage", "<!DOCTYPE html>\n<html>\n", "is HTML"},
    {"CountsFrames", "time,flex\n9:59:59:08,10\n9:59:59:09,11\n", "is no time"},
    {"Workbook", "PK\x03\x04\x14", "is an Excel workbook"},
    {"Compressed", "\x1F\x8B\x08", "gunzip it"},
    {"DaysOfASpreadsheet", "time,flex\n45321.5,1\n45321.5000006,2\n45321.5000012,3\n", "as a spreadsheet"},
    {"AMistypedTimeColumn", "time_ms,flex\n0,1\n50,2\n", "no column \"tme_ms\"; there are: time_ms, flex",
     "flex", only_time("tme_ms")},
    {"AMistypedTimeColumnOfOneFile", "time_ms,flex\n0,1\n50,2\n",
     "each file takes the first that it has: --time-column tme_ms time_ms", "flex", only_time("tme_ms")},
    {"OneOfTwoClocksGoesBack", "t_s,board_ms,flex\n5,0,1\n4,50,2\n3,100,3\n2,150,4\n1,200,5\n0,250,6\n",
     "at least 4 rows do not follow the one before); sort the log by time; or take the other time: "
     "--time-column \"board_ms\""},
    {"NoSectionHasIt",
     "Joints\n20\n,,p\nFrame,Sub Frame,X\n,,deg\n1,0,1\n2,0,1\n\nDevices\n20\n,,q\nFrame,Sub Frame,"
     "Y\n,,V\n1,0,1\n1,1,1\n",
     "there are: Frame, Sub Frame, X, Frame, Sub Frame, Y"},
    {"MillisecondsWithoutZeros", "time,flex\n13:00:17.0,1\n13:00:17.50,2\n13:00:17.100,3\n13:00:17.150,4\n",
     "of 17.005"},
    {"RoundedBySpreadsheet", "time,flex\n1.77763E+12,1\n1.77763E+12,2\n", "give the cells the format 0"},
    {"DaysThatStand", "time,flex\n46143.54,1\n46143.54,2\n", "as a spreadsheet"},
    {"ATimeThatStands", "t_s,count_ms,flex\n0,0,1\n0,50,2\n", "--time-column \"count_ms\""},
    {"NumbersBeforeLabels", "1000 flex:1\n1050 flex:2\n1100 flex:3\n", "--time-unit ms"},
    {"LabViewWithoutItsEnd", "LabVIEW Measurement\t\nSeparator\tTab\n0\t1\n", "no time column"},
    {"OtherBytes", "a,\x01\x02\n", "is no text"}};

}  // namespace flexor::recording
