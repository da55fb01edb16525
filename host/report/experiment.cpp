#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "host/io/io.hpp"
#include "host/report/colours.hpp"
#include "host/report/experiment_figures.hpp"
#include "host/report/page.hpp"
#include "host/report/render.hpp"

namespace flexor::report {
namespace {

constexpr const char* kStops =
    "Fastest hit: the greatest speed with which any joint arrived at one of its end stops in any trial. "
    "Pressed: how "
    "long motors then pressed against a stop with a tenth of their supply or more, mean of a trial, five "
    "fingers "
    "together.";

std::string figure_of(double value) {
  return value < 99.95 ? fmt::format("{:.1f}", value) : fmt::format("{:.0f}", value);
}

std::string counted(std::size_t n, const char* what) {
  return fmt::format("{} {}{}", n, what, n == 1 ? "" : "s");
}

std::string with_interval(const Json& statistic) {
  if (statistic.is_null()) return "-";
  const double mean = number_or_nan(statistic.at("mean"));
  const double half = number_or_nan(statistic.at("ci95"));
  if (std::isnan(mean)) return "-";
  return std::isnan(half) ? figure_of(mean) : fmt::format("{} ± {}", figure_of(mean), figure_of(half));
}

// The article's table as it is printed, ours beside it, and one to the other. A compensator that the article has not is beside its
// Hammerstein-Wiener compensator.
void published_table(Page& page, const Experiment& e) {
  TableBlock t{"Total error in degree-seconds", {"compensator"}, {}};
  for (std::size_t m = 0; m < e.motions.size(); ++m) t.columns.push_back(e.title(m));
  const auto hw = e.index_of("published-hw");
  const auto row = [&](const std::string& name, const std::function<std::string(std::size_t)>& cell) {
    t.rows.push_back({name});
    for (std::size_t m = 0; m < e.motions.size(); ++m) t.rows.back().push_back(cell(m));
  };
  bool any_published = false;
  for (std::size_t c = 0; c < e.compensators.size(); ++c) {
    const auto published = [&](std::size_t m) { return number_or_nan(e.cell(m, c).at("published_deg_s")); };
    const auto to = [&](std::size_t m) {
      const double own = published(m);
      return std::isnan(own) && hw ? number_or_nan(e.cell(m, *hw).at("published_deg_s")) : own;
    };
    const bool is_published = !std::isnan(published(0));
    any_published = any_published || is_published;
    const std::string& name = e.compensators[c];
    if (is_published) row(name + ", article", [&](std::size_t m) { return figure_of(published(m)); });
    t.marked.push_back(t.rows.size());
    row(name + ", here", [&](std::size_t m) { return with_interval(e.cell(m, c).at("total_error_deg_s")); });
    if (!std::isnan(to(0)))
      row(is_published ? "ratio to the article" : "ratio to the article's HW", [&](std::size_t m) {
        return std::isnan(to(m)) ? "-" : fmt::format("×{:.2f}", mean_error(e.cell(m, c)) / to(m));
      });
  }
  page.heading(any_published ? "The article's table, and ours" : "Total error");
  page.table(t);
  page.paragraph(fmt::format(
      "Mean and 95 % interval over {} of each motion. Every lag counts, the hand's and the radio's too.",
      counted(e.cell(0, 0).at("trials").get<std::size_t>(), "trial")));
}

void verdict(Page& page, const Experiment& e) {
  const std::size_t last = e.compensators.size() - 1;
  std::vector<std::string> ratios;
  for (const char* baseline : {"line-lead", "line", "published-hw-refitted", "published-hw", "raw"}) {
    const auto other = e.index_of(baseline);
    if (!other || *other == last) continue;
    double sum = 0;
    for (std::size_t m = 0; m < e.motions.size(); ++m)
      sum += std::log(mean_error(e.cell(m, last)) / mean_error(e.cell(m, *other)));
    ratios.push_back(fmt::format("{:.2f} times that of {}",
                                 std::exp(sum / static_cast<double>(e.motions.size())), baseline));
  }
  if (!ratios.empty()) {
    page.paragraph(fmt::format(
        "The error of {} is {} here (geometric mean over {}).{}", e.compensators[last],
        fmt::join(ratios, ", "), counted(e.motions.size(), "motion"),
        e.index_of("raw") ? " Much of raw's is the hand's loop, which winds up against its end stops." : ""));
  }
  for (const auto& [part, what] :
       {std::pair("fitted", "the fit of the twin used"), {"not_fitted", "the fit did not use"}}) {
    const Json& d = e.results.at("log_rms").at(part);
    if (d.is_null()) continue;
    page.paragraph(fmt::format(
        "Over gestures {}, which {}, the errors here are a factor of {:.2f} from the published ones (root "
        "mean square of the logarithm); one constant for each compensator would be {:.2f}.",
        fmt::join(d.at("gestures").get<std::vector<int>>(), ", "), what,
        std::exp(d.at("log_rms").get<double>()), std::exp(d.at("null_model_log_rms").get<double>())));
  }
}

// Five fingers together: the fastest, or the sum.
double fastest(const Json& by_finger) {
  double out = 0;
  for (const auto& finger : by_finger.items()) out = std::max(out, finger.value().get<double>());
  return out;
}

double sum(const Json& by_finger) {
  double out = 0;
  for (const auto& finger : by_finger.items()) out += finger.value().get<double>();
  return out;
}

// What the article says of curves and prints no number for.
void shape_table(Page& page, const Json& shapes) {
  if (shapes.empty()) return;
  TableBlock t{
      "What the article says of the curves", {"gesture, what", "threshold", "here", "agrees"}, {}, {}};
  for (const Json& s : shapes) {
    const bool least = s.contains("at_least_deg");
    t.rows.push_back({fmt::format("{}, {}", s.at("gesture").get<int>(), s.at("what").get<std::string>()),
                      fmt::format("{} {:g}°", least ? "at least" : "at most",
                                  s.at(least ? "at_least_deg" : "at_most_deg").get<double>()),
                      fmt::format("{:.1f}°", s.at("value_deg").get<double>()),
                      s.at("agrees").get<bool>() ? "yes" : "no"});
  }
  page.heading("Shapes");
  page.table(t);
}

void finger_table(Page& page, const Experiment& e) {
  TableBlock t{"Error of each finger in degree-seconds", {"motion, compensator"}, {}, {}};
  for (const auto& finger : e.cell(0, 0).at("finger_error_deg_s").items()) t.columns.push_back(finger.key());
  t.columns.insert(t.columns.end(), {"lag", "with the lag removed", "fastest hit", "pressed", "frames lost"});
  for (std::size_t m = 0; m < e.motions.size(); ++m) {
    for (std::size_t c = 0; c < e.compensators.size(); ++c) {
      const Json& cell = e.cell(m, c);
      std::vector<std::string> row = {e.title(m) + ", " + e.compensators[c]};
      for (const auto& finger : cell.at("finger_error_deg_s").items())
        row.push_back(figure_of(finger.value().get<double>()));
      const double lag_s = cell.at("lag_s").is_null() ? NAN : number_or_nan(cell.at("lag_s").at("mean"));
      row.push_back(std::isnan(lag_s) ? "-" : fmt::format("{:.0f} ms", 1000 * lag_s));
      row.push_back(with_interval(cell.at("lag_removed_deg_s")));
      row.push_back(fmt::format("{:.0f}°/s", fastest(cell.at("impact_deg_s"))));
      row.push_back(fmt::format("{:.2f} s", sum(cell.at("pressed_s"))));
      row.push_back(fmt::format("{:.1f} %", 100 * cell.at("frames_lost").get<double>() /
                                                std::max(cell.at("frames_sent").get<double>(), 1.0)));
      t.rows.push_back(std::move(row));
    }
  }
  page.begin_details("Each finger, the lag, and what the end stops suffer");
  page.table(t);
  page.paragraph(std::string(kStops) +
                 " With the lag removed: after the one lag of each trial that makes the error smallest; "
                 "never to be compared "
                 "with an error in which every lag counts.");
  page.end_details();
}

// Mean over motions of the total error.
double overall(const Json& cells, std::size_t compensator, std::size_t compensators) {
  double total = 0;
  for (std::size_t i = compensator; i < cells.size(); i += compensators) total += mean_error(cells.at(i));
  return total / (static_cast<double>(cells.size()) / static_cast<double>(compensators));
}

void scenario_table(Page& page, const Experiment& e) {
  const Json& scenarios = e.results.at("scenarios");
  if (scenarios.empty()) return;
  TableBlock t{"Causal error in degree-seconds, mean over the motions", {"scenario"}, {}, {}};
  t.columns.insert(t.columns.end(), e.compensators.begin(), e.compensators.end());
  t.columns.insert(t.columns.end(), {"fastest hit of a stop", "pressed"});
  const Json& base = scenarios.front().at("cells");
  for (const Json& s : scenarios) {
    std::vector<std::string> row = {s.at("name").get<std::string>()};
    for (std::size_t c = 0; c < e.compensators.size(); ++c) {
      const double error = overall(s.at("cells"), c, e.compensators.size());
      row.push_back(
          fmt::format("{} (×{:.2f})", figure_of(error), error / overall(base, c, e.compensators.size())));
    }
    row.push_back(fmt::format("{:.0f}°/s", s.at("impact_deg_s").get<double>()));
    row.push_back(fmt::format("{:.2f} s", s.at("pressed_s").get<double>()));
    t.rows.push_back(std::move(row));
  }
  page.heading("When things go wrong");
  page.table(t);
  page.paragraph(fmt::format(
      "In brackets: relative to the same compensator in the first row. {} The worst compensator's.", kStops));
}

}  // namespace

Experiment::Experiment(const Saved& saved)
    : results(saved.results()),
      compensators(results.at("compensators").get<std::vector<std::string>>()),
      colours(colours_of(compensators)),
      motions(results.at("motions")) {
  if (motions.empty() || compensators.empty() ||
      results.at("cells").size() != motions.size() * compensators.size()) {
    throw io::InputError(fmt::format("{}: results.json has not a cell for each motion and compensator",
                                     saved.folder().string()));
  }
  const bool whole =
      std::ranges::all_of(motions,
                          [&](const Json& m) { return m.at("traces").size() == compensators.size(); }) &&
      std::ranges::all_of(results.at("cells"),
                          [](const Json& c) { return !c.at("finger_error_deg_s").empty(); });
  if (!whole) {
    throw io::InputError(
        fmt::format("{}: results.json has not a trace for each compensator and an error for each finger",
                    saved.folder().string()));
  }
}

std::optional<std::size_t> Experiment::index_of(const std::string& compensator) const {
  const auto it = std::ranges::find(compensators, compensator);
  if (it == compensators.end()) return std::nullopt;
  return static_cast<std::size_t>(it - compensators.begin());
}

std::string Experiment::title(std::size_t motion) const {
  const Json& m = motions.at(motion);
  const auto name = m.at("name").get<std::string>();
  return m.at("gesture").is_null() ? name : fmt::format("{} {}", m.at("gesture").get<int>(), name);
}

void render_experiment(const Saved& saved) {
  const Experiment e(saved);
  Page page(e.results.at("engine") == "twin" ? "Glove to bionic hand, in the twin"
                                             : "Glove to bionic hand, played by " + saved.text("engine"));
  const auto warnings = e.results.value("warnings", std::vector<std::string>());
  if (!warnings.empty()) page.warnings(warnings);
  published_table(page, e);
  verdict(page, e);
  page.chart(errors_chart(e));
  scenario_table(page, e);
  shape_table(page, e.results.at("shapes"));
  finger_table(page, e);
  for (std::size_t m = 0; m < e.motions.size(); ++m) {
    saved.go_on();
    add_motion(page, saved, e, m);
  }
  page.paragraph(
      fmt::format("A simulation: person, glove, radio, hand and cameras follow the configuration in "
                  "results.json. {:g} Hz, seed {}. Every "
                  "trial is a row of trials.csv.",
                  e.results.at("rate_hz").get<double>(), e.results.at("seed").get<std::uint64_t>()));
  page.write(saved);
}

}  // namespace flexor::report
