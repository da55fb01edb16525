// Texts and file names of users in figures: shown as they are, never carried out.
#include "host/report/gnuplot.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

namespace flexor::report {
namespace {

namespace fs = std::filesystem;

class GnuplotTest : public testing::Test {
 protected:
  GnuplotTest() : folder_(fs::path(testing::TempDir()) / ("flexor_gnuplot_" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
  }
  ~GnuplotTest() override { fs::remove_all(folder_); }

  std::string drawn(const std::string& commands) const {
    Gnuplot g;
    g.begin("figure", 300);
    g.add("{}", commands);
    g.run();
    return g.svg("figure");
  }

  fs::path folder_;
};

TEST_F(GnuplotTest, ShowsAnyTextAsItIs) {
  const std::string gone = (folder_ / "gone").string();
  const std::string text =
      "a_b^{c} @{d} {/Symbol e} `touch " + gone + "` $x %g \\ ' \" <script> &\nsystem 'touch " + gone + "'";
  const std::string shown =
      "a_b^{c} @{d} {/Symbol e} `touch " + gone + "` $x %g \\ ' \" &lt;script> &amp; system";
  for (const std::string& commands : {"set xlabel " + gnuplot_text(text) + " noenhanced; plot 1",
                                      "set title " + gnuplot_text(text) + " noenhanced; plot 1",
                                      "set ylabel " + gnuplot_text(text) + " noenhanced; plot 1",
                                      "plot 1 title " + gnuplot_text(text) + " noenhanced"}) {
    const std::string svg = drawn(commands);
    std::string plain = svg;
    for (std::size_t at = 0; (at = plain.find("&quot;", at)) != std::string::npos; ++at)
      plain.replace(at, 6, "\"");
    EXPECT_NE(plain.find(shown), std::string::npos) << commands << svg.substr(0, 3000);
    EXPECT_EQ(svg.find("<script"), std::string::npos);
  }
  EXPECT_FALSE(fs::exists(gone));
}

// gnuplot cuts the labels of tics after some fifty letters.
TEST_F(GnuplotTest, ShowsTheLabelOfATicAsItIs) {
  const std::string text = "a_b^{c} `touch gone` %g %% \\ ' <b>\n&";
  const std::string svg = drawn("set xtics (" + gnuplot_tic(text) + " 0) noenhanced; plot 1");
  EXPECT_NE(svg.find("a_b^{c} `touch gone` %g %% \\ ' &lt;b> &amp;"), std::string::npos) << svg;
  EXPECT_FALSE(fs::exists("gone"));
}

TEST_F(GnuplotTest, BytesThatAreNotUtf8BecomeQuestionMarks) {
  EXPECT_EQ(gnuplot_text("caf\xe9 \xc3\xa9 \xe2\x82"), "'caf? \xc3\xa9 ?\?'");
  EXPECT_EQ(gnuplot_text("it's\ttwo\nlines"), "'it''s two lines'");
}

TEST_F(GnuplotTest, AFileMayHaveAnyName) {
  const fs::path before = fs::current_path();
  fs::current_path(folder_);
  for (const char* name : {"< touch gone", "it's\n`touch gone`", "|touch gone"}) {
    io::write_file(folder_ / name, "0,1\n1,2\n");
    Gnuplot g;
    g.begin("figure", 300);
    g.add("set datafile separator ','; plot {} using 1:2 with lines", g.data_file(name));
    g.run();
    EXPECT_NE(g.svg("figure").find("<path"), std::string::npos) << name;
    EXPECT_FALSE(fs::exists("gone")) << name;
  }
  fs::current_path(before);
}

TEST_F(GnuplotTest, SaysWhatGnuplotSays) {
  Gnuplot g;
  g.begin("figure", 200);
  g.add("plot nonsense(");
  g.run();
  EXPECT_EQ(g.svg("figure"), "");
  EXPECT_EQ(g.undrawn().find('\n'), std::string::npos);
  EXPECT_NE(g.undrawn().find("nonsense"), std::string::npos) << g.undrawn();
}

}  // namespace
}  // namespace flexor::report
