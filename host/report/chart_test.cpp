// Texts of users in charts: shown as they are, never carried out.
#include "host/report/chart.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "host/io/io.hpp"
#include "host/report/templates.hpp"

namespace flexor::report {
namespace {

TEST(Chart, AnAxisThatSeriesShareIsWrittenOnceAndWhatIsNotKnownIsNull) {
  const Chart chart{
      {"a", "", ""},
      "x",
      {{"y", {{"one", "#000000", {0, 1}, {1, NAN}}, {"two", "#000000", {0, 1}, {1.0 / 3, 5}}}}}};
  const auto json = nlohmann::json::parse(to_json(chart));
  EXPECT_EQ(json.at("axes").dump(), "[[0.0,1.0]]");
  EXPECT_EQ(json.at("/panels/0/series/0/y"_json_pointer).dump(), "[1.0,null]");
  EXPECT_EQ(json.at("/panels/0/series/1/y"_json_pointer).dump(), "[0.33333,5.0]");
}

TEST(Chart, AnIntervalIsALineOfItsOwn) {
  const Series s = intervals("#000000", {0, 1}, {1, NAN}, {2, NAN});
  EXPECT_EQ(s.x, (std::vector<double>{0, 0, 0}));
  EXPECT_EQ(s.y[1], 2);
  EXPECT_TRUE(std::isnan(s.y[2]));
}

TEST(Chart, BytesThatAreNotUtf8AreSeenAndABreakIsASpace) {
  EXPECT_EQ(gnuplot_text("caf\xe9 \xc3\xa9 \xe2\x82"), "'caf\xef\xbf\xbd \xc3\xa9 \xef\xbf\xbd\xef\xbf\xbd'");
  EXPECT_EQ(gnuplot_text("it's\ttwo\nlines"), "'it''s two lines'");
}

TEST(Chart, FilesShowAnyTextAsItIsAndTheSameDataAreTheSameBytes) {
  const io::TemporaryFolder folder;
  const std::string gone = (folder.path() / "gone").string();
  const std::string text =
      "a_b^{c} @{d} `touch " + gone + "` $x %g \\ ' <script> &\nsystem 'touch " + gone + "'";
  const Chart chart{
      {"figure", "", ""}, text, {{text, {{text, "#0072B2", {0, 1}, {1, 2}}}}}, {{0.2, 0.4}}, {text, "b"}};
  std::string first[2];
  for (int turn = 0; turn < 2; ++turn) {
    draw_files({chart}, folder.path());
    const std::string svg = io::read_file(folder.path() / "figure.svg");
    const std::string pdf = io::read_file(folder.path() / "figure.pdf");
    EXPECT_NE(svg.find("a_b^{c} @{d} `touch "), std::string::npos);
    EXPECT_EQ(svg.find("<script"), std::string::npos);
    EXPECT_TRUE(pdf.starts_with("%PDF"));
    if (turn == 0) first[0] = svg, first[1] = pdf;
    EXPECT_EQ(svg, first[0]);
    EXPECT_EQ(pdf, first[1]);
  }
  EXPECT_FALSE(std::filesystem::exists(gone));
}

TEST(Chart, TheScriptHasItsNameForAPolicy) {
  EXPECT_TRUE(report_script_source().starts_with("'sha256-"));
  EXPECT_EQ(report_script_source().size(), 8U + 44U + 1U);
}

}  // namespace
}  // namespace flexor::report
