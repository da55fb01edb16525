// Reports, from the job to the page: drawn from what was saved alone, and the same bytes whenever they are drawn.
#include "host/report/render.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <set>

#include "host/identify/identify.hpp"
#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/io/refusal_test.hpp"
#include "host/recording/csv.hpp"
#include "host/report/colours.hpp"
#include "host/study/boards.hpp"
#include "host/study/plan_test.hpp"
#include "host/study/results.hpp"

namespace flexor {
namespace report_test {
namespace fs = std::filesystem;

class ReportTest : public testing::Test {
 protected:
  std::string read(const std::string& name) const { return io::read_file(folder_ / name); }

  std::map<std::string, std::string> files() const {
    std::map<std::string, std::string> out;
    for (const auto& entry : fs::recursive_directory_iterator(folder_))
      if (entry.is_regular_file())
        out[entry.path().lexically_relative(folder_)] = io::read_file(entry.path());
    return out;
  }

  // Without the script of its charts.
  std::string page(const std::string& name) const {
    const std::string html = read(name);
    return html.substr(0, html.find("<script type=\"module\">"));
  }

  // Whatever stands in the place of a value: text on the page, or one line.
  void expect_no_harm(const Json& whole, const Json::json_pointer& at) const {
    const auto& here = whole.at(at);
    for (const Json& value : {Json::object(), here.is_primitive() ? Json("<script>../x") : Json::array()}) {
      auto json = whole;
      json[at] = value;
      io::write_file(folder_ / "results.json", json.dump());
      const std::string why = io::refusal_of([&] { report::render(folder_); });
      EXPECT_EQ(why.find('\n'), std::string::npos) << at << why;
      for (const auto& [name, bytes] : files())
        EXPECT_TRUE(name == "results.json" || bytes.find("<script>..") == std::string::npos) << at << name;
    }
    if (here.is_object())
      for (const auto& item : here.items())
        if (item.key() != "twin" && item.key() != "thumb") expect_no_harm(whole, at / item.key());
    if (here.is_array() && !here.empty()) expect_no_harm(whole, at / 0);
  }

  // Draws, takes away all that was drawn, and draws again.
  void expect_the_same_once_more() const {
    const auto saved = files();
    report::render(folder_, true);
    const auto first = files();
    EXPECT_GT(first.size(), saved.size());
    for (const auto& [name, bytes] : first)
      if (!saved.contains(name)) fs::remove(folder_ / name);
    report::render(folder_, true);
    EXPECT_EQ(files(), first);
    expect_no_harm(Json::parse(read("results.json")), Json::json_pointer());
    io::write_file(folder_ / "results.json", first.at("results.json"));
    report::render(folder_);
    EXPECT_TRUE(first.contains("report.html"));
    for (const auto& [name, bytes] : first) {
      if (!name.ends_with(".html")) continue;
      for (const char* part : {"<script>", "href=\"http", "{{"})
        EXPECT_EQ(page(name).find(part), std::string::npos) << name << part;
      EXPECT_NE(bytes.find("width=device-width"), std::string::npos) << name;
      EXPECT_NE(bytes.find("<th scope=\"row\">hold drift</th><td>how far"), std::string::npos) << name;
    }
  }

  const io::TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path();
};

// Every text in `json` but the kind of job, spoilt; names of members, too, where they are fingers.
void spoil(Json& json, const std::string& evil, const std::string& key = "") {
  if (json.is_string() && key != "kind") json = json.get<std::string>() + evil;
  if (json.is_array()) {
    for (auto& element : json) spoil(element, evil);
  }
  if (!json.is_object()) return;
  auto out = Json::object();
  for (auto& [name, value] : json.items()) {
    spoil(value, evil, name);
    out[name == "index" ? name + evil : name] = value;
  }
  json = out;
}

// Two joints of a hand, which one sensor sees, in two pairs of recordings.
class HandReport : public ReportTest {
 protected:
  HandReport() {
    const io::TemporaryFolder simulated;
    const fs::path& logs = simulated.path();
    EXPECT_EQ(std::system(("'" FLEXOR_SIMULATE "' '" + logs.string() + "'").c_str()), 0);
    identify::Request r;
    const identify::PairFiles pair{logs / "simulated_glove.csv", logs / "simulated_camera.csv"};
    identify::PairFiles shorter = pair;
    shorter.sensor = logs / "shorter_glove.csv";
    const std::string glove = io::read_file(pair.sensor);
    io::write_file(shorter.sensor, glove.substr(0, glove.rfind('\n', glove.size() - 2) + 1));
    r.pairs = {pair, shorter};
    r.map = identify::parse_map(
        "index=simulated_index_adc:∠simulated_index_deg,thumb=simulated_index_adc:∠simulated_index_deg");
    r.structure = "curve";
    result_ = identify::identify_files(r, {});
  }

  Json results() const { return Json::parse(read("results.json")); }

  identify::Result result_;
};

TEST_F(HandReport, AnotherWithFewerJointsLeavesNoneOfTheOlderOne) {
  identify::save_results(result_, folder_);
  report::render(folder_, true);
  io::write_file(folder_ / "notes-2.csv", "mine");
  report::clear_hand(folder_);
  result_.joints.pop_back();
  identify::save_results(result_, folder_);
  report::render(folder_);
  for (const auto& [name, bytes] : files())
    EXPECT_EQ(name.find("2."), name == "notes-2.csv" ? 6 : std::string::npos) << name;
}

TEST_F(HandReport, HasAPageForEachJointDrawnFromWhatWasSaved) {
  identify::save_results(result_, folder_);
  expect_the_same_once_more();
  const std::string overview = read("report.html");
  for (const char* joint : {"1", "2"}) {
    const std::string number = joint;
    EXPECT_NE(overview.find("href=\"joint-" + number + ".html\""), std::string::npos);
    const std::string page = read("joint-" + number + ".html");
    EXPECT_NE(page.find("href=\"report.html\""), std::string::npos);
    for (const char* figure : {"holdout_", "curve_", "errors_", "error_correlation_"}) {
      EXPECT_NE(read(figure + number + ".svg").find("<svg"), std::string::npos) << figure;
      EXPECT_NE(page.find("id=\"" + (figure + number) + "\""), std::string::npos)
          << figure << " is not in the page";
    }
    EXPECT_NE(page.find("class=\"marked\""), std::string::npos) << "the structure that was chosen";
  }
  EXPECT_FALSE(fs::exists(folder_ / "joint-3.html"));
}

TEST_F(HandReport, ShowsEveryFigureOfTheJointsBesideTheirPeersAndOfTheClocks) {
  identify::save_results(result_, folder_);
  report::render(folder_);
  const std::string overview = read("report.html");
  const auto json = results();
  ASSERT_EQ(json.at("joints").size(), 2U);
  ASSERT_EQ(json.at("pairs").size(), 2U);
  std::size_t number = 0;
  for (const auto& [name, joint] : json.at("joints").items()) {
    const std::string page = read(fmt::format("joint-{}.html", ++number));
    std::vector<double> rmse_deg = {joint.at("holdout").at("rmse_deg").get<double>()};
    for (const char* peer : {"line", "line_lead", "published_form"})
      rmse_deg.push_back(joint.at("baselines").at(peer).at("rmse_deg").get<double>());
    for (const double value : rmse_deg) {
      EXPECT_NE(overview.find(fmt::format("<td>{:.2f}°</td>", value)), std::string::npos) << name << value;
      EXPECT_NE(page.find(fmt::format("<td>{:.3f}°</td>", value)), std::string::npos) << name << value;
    }
    EXPECT_NE(overview.find(name + ": " + joint.at("verdict").at("words").get<std::string>()),
              std::string::npos);
    for (const auto& row : joint.at("structures"))
      EXPECT_NE(page.find(row.at("structure").get<std::string>()), std::string::npos);
  }
  for (const auto& pair : json.at("pairs")) {
    for (const std::string& cell : {fmt::format("{:+.3f} s", pair.at("clock_offset_s").get<double>()),
                                    fmt::format("{:.3f} s", pair.at("clock_offset_se_s").get<double>()),
                                    fmt::format("{:.2f}", pair.at("confidence").get<double>())})
      EXPECT_NE(overview.find("<td>" + cell + "</td>"), std::string::npos) << cell;
  }
}

// 1/4 behind a lag of 10 rad/s, 3/4 behind that and one of 2: partial fractions by hand.
TEST_F(HandReport, AChainHasItsTransferFunction) {
  identify::save_results(result_, folder_);
  auto json = results();
  json.at("joints").front()["iterations"] = 4;
  json.at("joints").front()["start"] = 3;
  auto& parameters = json.at("joints").front().at("parameters") = Json::array();
  for (const auto& [name, value] :
       {std::pair("pole 1 (rad/s)", -10.0), {"pole 2 (rad/s)", -2.0}, {"tap 1", 0.25}})
    parameters.push_back({{"name", name}, {"value", value}, {"standard_error", nullptr}});
  io::write_file(folder_ / "results.json", json.dump());
  report::render(folder_);
  for (const char* cell : {"<td>0.0625</td>", "<td>0.9375</td>", "<td>-10 (not known)</td>", "<td>0.5 s</td>",
                           "start 3, the best"})
    EXPECT_NE(read("joint-1.html").find(cell), std::string::npos) << cell;
}

TEST_F(HandReport, PeersThatCouldNotBeFittedAndPausesAllOverAreReported) {
  for (identify::JointResult& joint : result_.joints) {
    joint.baselines.erase("line");
    joint.baseline_refusals = {"line: its angle hardly changes"};
    for (identify::JointSamples& s : joint.samples) {
      s.estimated_deg.erase("line");
      std::ranges::fill(s.sensors.front().gap, 1);
    }
  }
  identify::save_results(result_, folder_);
  report::render(folder_);
  const std::string page = this->page("joint-1.html");
  EXPECT_NE(page.find("Could not be fitted: line: its angle hardly changes."), std::string::npos);
  EXPECT_EQ(page.find("nan"), std::string::npos);
  EXPECT_EQ(page.find("Residual check"), std::string::npos);
}

class ExperimentReport : public ReportTest {};

study::Statistic statistic(std::initializer_list<double> values) {
  study::Statistic s;
  for (const double value : values) s.add(value);
  return s;
}

TEST_F(ExperimentReport, IsDrawnFromWhatWasSaved) {
  const study::Plan p = study::plan("2,4", 2);
  const study::Result r = study::run(p, {});
  study::save_results(p, r, {{{"as calibrated", {}}, r}}, folder_);
  expect_the_same_once_more();
  const std::string html = read("report.html");
  for (const char* part :
       {"number two", "published-hw, article", "Final posture", "as calibrated", "×1.00"}) {
    EXPECT_NE(html.find(part), std::string::npos) << part;
  }
  EXPECT_TRUE(read("posture_2.svg").starts_with("<svg"));
  for (const char* name : {"errors", "response_1", "error_2"}) {
    EXPECT_NE(read(std::string(name) + ".svg").find("<svg"), std::string::npos) << name;
    EXPECT_TRUE(read(std::string(name) + ".pdf").starts_with("%PDF")) << name;
  }
  const auto json = nlohmann::json::parse(read("results.json"));
  EXPECT_EQ(json.at("cells").size(), 4U);
  EXPECT_TRUE(json.at("twin").contains("parameters"));
  const auto trace = recording::read_csv(folder_ / "traces" / "motion2_compensator1.csv", {});
  EXPECT_EQ(trace.columns.size(), 10U);
  EXPECT_NEAR(trace.t_s.back(), p.motions[1].duration_s(), 0.05);
}

TEST_F(ExperimentReport, NoTextOfASentFolderIsACommand) {
  const study::Plan p = study::plan("4", 2);
  study::save_results(p, study::run(p, {}), {}, folder_);
  const fs::path proof = folder_ / "proof";
  const std::string evil = "'; system(\"touch '" + proof.string() + "'\"); set ylabel 'x";
  auto json = Json::parse(read("results.json"));
  spoil(json, evil);
  io::write_file(folder_ / "results.json", json.dump());
  for (const auto& entry : fs::directory_iterator(folder_ / "traces")) {
    std::string trace = io::read_file(entry.path());
    for (const char* name : {"index_finger_deg", "index_hand_deg"}) trace.insert(trace.find(name) + 5, evil);
    io::write_file(entry.path(), trace);
  }
  EXPECT_NO_THROW(report::render(folder_, true));
  EXPECT_FALSE(fs::exists(proof));
  EXPECT_NE(read("response_1.svg").find("touch"), std::string::npos) << "it is shown";
}

TEST_F(ExperimentReport, ATraceThatWasCutOffIsRefusedInOneLine) {
  const study::Plan p = study::plan("4", 2);
  study::save_results(p, study::run(p, {}), {}, folder_);
  const std::string trace = read("traces/motion1_compensator2.csv");
  for (const std::size_t bytes : {trace.find('\n') + 1, trace.find('\n', trace.size() / 2) + 1}) {
    io::write_file(folder_ / "traces/motion1_compensator2.csv", trace.substr(0, bytes));
    EXPECT_NE(io::refusal_of([&] { report::render(folder_); }).find("it was cut off"), std::string::npos);
  }
}

// The article's 39.0 and 860 of gesture 4; what it has not is beside its Hammerstein-Wiener compensator.
TEST_F(ExperimentReport, BeginsWithTheArticlesTableAndOursBesideIt) {
  study::Plan p = study::plan("4", 2);
  p.compensators.push_back(p.compensators[1]);
  p.compensators[2].name = "mine";
  study::Result r = study::run(p, {});
  r.cells[0].total_deg_s = statistic({430});
  r.cells[1].total_deg_s = statistic({78});
  r.cells[2].total_deg_s = statistic({19.5});
  study::save_results(p, r, {}, folder_);
  report::render(folder_);
  const std::string html = page("report.html");
  std::size_t at = html.find("The article&apos;s table");
  for (const char* part : {"raw, article", "<td>860</td>", "<td>430</td>", "<td>×0.50</td>", "<td>39.0</td>",
                           "<td>78.0</td>", "<td>×2.00</td>", "mine, here", "<td>19.5</td>",
                           "ratio to the article&apos;s HW", "<td>×0.50</td>"}) {
    at = html.find(part, at);
    ASSERT_NE(at, std::string::npos) << part;
  }
}

// A compensator has its colour whoever stands beside it, and no two of a run have the same.
TEST_F(ExperimentReport, AColourBelongsToItsCompensatorNotToItsPlace) {
  using report::colours_of;
  EXPECT_EQ(colours_of({"raw", "published-w", "published-hw"}),
            (std::vector<std::string>{"#E69F00", "#56B4E9", "#D55E00"}));
  EXPECT_EQ(colours_of({"published-hw"}).front(), "#D55E00");
  EXPECT_EQ(colours_of({"mine", "raw"}).front(), colours_of({"published-hw", "mine"}).back());
  const std::vector<std::string> many =
      colours_of({"raw", "a", "b", "c", "published-w", "d", "e", "f", "published-hw"});
  EXPECT_EQ(std::set<std::string>(many.begin(), many.end()).size(), many.size());
  study::Plan p = study::plan("4", 2);
  p.compensators = {study::compensator("published-hw", 10)};
  study::save_results(p, study::run(p, {}), {}, folder_);
  report::render(folder_);
  EXPECT_NE(read("report.html").find("\"colour\":\"#D55E00\""), std::string::npos);
}

TEST_F(ReportTest, OfLatencyIsDrawnFromWhatWasSaved) {
  const std::vector<study::Latency> edges = {{10, 1, 20, 30, 1, 5}, {20, 1, 40, 30, 1, 9}};
  study::save_results(study::budget_of(edges, 3), "10 samples a second", folder_);
  expect_the_same_once_more();
  EXPECT_NE(read("report.html").find("1 more were lost"), std::string::npos);
  EXPECT_NE(read("latency.csv").find("total,84.0000,67.0000,101.0000"), std::string::npos);
}

TEST_F(ReportTest, OfADeploymentIsDrawnFromWhatWasSaved) {
  deploy::Deployment d;
  d.glove.model = study::compensator("published-hw", 10).model;
  d.glove.model.name = "</title>it's 5 % <i>";
  deploy::save_results(d, folder_);
  expect_the_same_once_more();
  EXPECT_NE(read("report.html").find("Cycles and stack were not measured"), std::string::npos);
  EXPECT_EQ(read("results.json").find("cycles\": 0"), std::string::npos);
  d.glove_figures.samples = 1;
  d.glove_figures.step.add(600);
  d.recording = "the six gestures";
  deploy::save_results(d, folder_);
  expect_the_same_once_more();
  const std::string html = read("report.html");
  EXPECT_EQ(html.find("<i>"), std::string::npos);
  EXPECT_NE(html.find("&lt;/title&gt;it&apos;s 5 % &lt;i&gt;"), std::string::npos) << html.substr(0, 400);
}

}  // namespace report_test
}  // namespace flexor
