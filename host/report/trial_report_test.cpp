#include "host/report/trial_report.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <set>
#include <string>

#include "host/io/io.hpp"
#include "host/report/colours.hpp"

namespace flexor::report {
namespace {
namespace fs = std::filesystem;

fs::path fresh_folder(const std::string& name) {
  const fs::path path = fs::temp_directory_path() / ("flexor_trials_" + name + std::to_string(::getpid()));
  fs::remove_all(path);
  return path;
}

Plan plan(const std::string& gestures, int trials, const std::string& folder = "") {
  return {shipped_parameters(),
          motions(gestures),
          {compensator("raw", 10), compensator("published-hw", 10)},
          3,
          trials,
          2,
          folder};
}

TEST(TrialReport, WritesOnePageAndEveryFigureTwice) {
  const fs::path folder = fresh_folder("report");
  const Plan p = plan("2", 2, folder.string());
  const Result r = run(p, {});
  write_trial_report(p, r, {{{"as calibrated", {}}, r}}, folder);
  const std::string html = io::read_file(folder / "report.html");
  for (const char* part :
       {"width=device-width", "number two", "published-hw", "final posture", "as calibrated"}) {
    EXPECT_NE(html.find(part), std::string::npos) << part;
  }
  for (const char* name : {"errors", "response_1", "error_1", "posture_1"}) {
    EXPECT_TRUE(io::read_file(folder / (std::string(name) + ".svg")).starts_with("<svg")) << name;
    EXPECT_TRUE(io::read_file(folder / (std::string(name) + ".pdf")).starts_with("%PDF")) << name;
  }
  const auto json = nlohmann::json::parse(io::read_file(folder / "results.json"));
  EXPECT_EQ(json.at("cells").size(), 2U);
  EXPECT_TRUE(json.at("twin").contains("parameters"));
  fs::remove_all(folder);
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

Statistic statistic(std::initializer_list<double> values) {
  Statistic s;
  for (const double value : values) s.add(value);
  return s;
}

// gnuplot's SVG of the bars: a compensator's whiskers are one path in their own grey.
std::string whiskers(const std::string& svg) {
  std::string out;
  for (auto at = svg.find("stroke='rgb( 68,  68,  68)'"); at != std::string::npos;
       at = svg.find("stroke='rgb( 68,  68,  68)'", at + 1)) {
    out += svg.substr(at, svg.find("/>", at) - at);
  }
  return out;
}

// An interval that reaches below zero has no logarithm there: it is drawn down to the foot of the axis.
TEST(TrialFigures, EveryBarKeepsItsIntervalAndOneTrialHasNone) {
  const Plan p = plan("4", 2);
  Result r = run(p, {});
  r.cells[0].total_deg_s = statistic({10, 900});  // 455 +- 5654
  r.cells[1].total_deg_s = statistic({400, 420});
  const auto errors = [&] { return draw(p, r).front().svg; };
  EXPECT_EQ(count(whiskers(errors()), "M"), 2U) << whiskers(errors());
  r.cells[0].total_deg_s = statistic({455});
  EXPECT_EQ(count(whiskers(errors()), "M"), 1U) << whiskers(errors());
}

// A compensator has its colour whoever stands beside it, and no two of a run have the same.
TEST(TrialFigures, AColourBelongsToItsCompensatorNotToItsPlace) {
  EXPECT_EQ(colours_of({"raw", "published-w", "published-hw"}),
            (std::vector<std::string>{"#E69F00", "#56B4E9", "#D55E00"}));
  EXPECT_EQ(colours_of({"published-hw"}).front(), "#D55E00");
  EXPECT_EQ(colours_of({"mine", "raw"}).front(), colours_of({"published-hw", "mine"}).back());
  const std::vector<std::string> many =
      colours_of({"raw", "a", "b", "c", "published-w", "d", "e", "f", "published-hw"});
  EXPECT_EQ(std::set<std::string>(many.begin(), many.end()).size(), many.size());
  Plan p = plan("4", 2);
  p.compensators = {compensator("published-hw", 10)};
  for (const TrialFigure& figure : draw(p, run(p, {}))) {
    EXPECT_NE(figure.svg.find("rgb(213,  94,   0)"), std::string::npos) << figure.name;
  }
}

}  // namespace
}  // namespace flexor::report
