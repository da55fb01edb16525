// The report of an experiment: tables, the figure `errors`, the table with its intervals; response_N and error_N, trial 0 of motion N
// with all compensators; posture_N, the hand at its end.
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>

#include "host/io/io.hpp"
#include "host/report/colours.hpp"
#include "host/report/kinds.hpp"

namespace flexor::report {
namespace {

struct Experiment {
  const Json& results;
  std::vector<std::string> compensators;
  std::vector<std::string> colours;  // theirs
  const Json& motions;

  // Throws std::domain_error for cells that do not fill the table.
  explicit Experiment(const Json& saved)
      : results(saved),
        compensators(results.at("compensators").get<std::vector<std::string>>()),
        colours(colours_of(compensators)),
        motions(results.at("motions")) {
    const Json& cells = results.at("cells");
    if (cells.empty() || cells.size() != motions.size() * compensators.size())
      throw std::domain_error("not a cell for each motion and compensator");
    if (!std::ranges::all_of(cells, [](const Json& c) { return !c.at("finger_error_deg_s").empty(); }))
      throw std::domain_error("not an error for each finger");
  }
  const Json& cell(std::size_t motion, std::size_t compensator) const {
    return results.at("cells").at(motion * compensators.size() + compensator);
  }
  std::optional<std::size_t> index_of(const std::string& compensator) const {
    const auto it = std::ranges::find(compensators, compensator);
    if (it == compensators.end()) return std::nullopt;
    return static_cast<std::size_t>(it - compensators.begin());
  }
  std::string title(std::size_t motion) const {  // "4 okay"
    const Json& m = motions.at(motion);
    const auto name = m.at("name").get<std::string>();
    return m.at("gesture").is_null() ? name : fmt::format("{} {}", m.at("gesture").get<int>(), name);
  }
};

double mean_error(const Json& cell) { return cell.at("total_error_deg_s").at("mean").get<double>(); }

constexpr const char* kStops =
    "Fastest hit: the greatest speed with which any joint arrived at one of its end stops in any trial. "
    "Pressed: how long motors then pressed against a stop with a tenth of their supply or more, mean of a "
    "trial, five fingers together.";

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

// What the article says of curves and prints no number for.
void shape_table(Page& page, const Json& shapes) {
  if (shapes.empty()) return;
  const auto threshold = [](const Json& s) {
    const bool least = s.contains("at_least_deg");
    return fmt::format("{} {:g}°", least ? "at least" : "at most",
                       s.at(least ? "at_least_deg" : "at_most_deg").get<double>());
  };
  page.heading("Shapes");
  page.table(table_of("What the article says of the curves", shapes,
                      {{"gesture", "/gesture"},
                       {"what", "/what"},
                       {"threshold", threshold},
                       {"here", "/value_deg", "{:.1f}°"},
                       {"agrees", [](const Json& s) { return s.at("agrees").get<bool>() ? "yes" : "no"; }}}));
}

void finger_table(Page& page, const Experiment& e) {
  std::vector<Column> columns = {{"compensator", "/compensator"}, {"gesture", "/gesture"}};
  for (const auto& finger : e.cell(0, 0).at("finger_error_deg_s").items())
    columns.emplace_back(finger.key(), [name = finger.key()](const Json& cell) {
      return figure_of(cell.at("finger_error_deg_s").at(name).get<double>());
    });
  const auto lag = [](const Json& cell) {
    const double lag_s = cell.at("lag_s").is_null() ? NAN : number_or_nan(cell.at("lag_s").at("mean"));
    return std::isnan(lag_s) ? "-" : fmt::format("{:.0f} ms", 1000 * lag_s);
  };
  const auto lost = [](const Json& cell) {
    return fmt::format("{:.1f} %", 100 * cell.at("frames_lost").get<double>() /
                                       std::max(cell.at("frames_sent").get<double>(), 1.0));
  };
  const auto fastest = [](const Json& cell) {
    double deg_s = 0;
    for (const Json& finger : cell.at("impact_deg_s")) deg_s = std::max(deg_s, finger.get<double>());
    return fmt::format("{:.0f}°/s", deg_s);
  };
  const auto pressed = [](const Json& cell) {
    double five_s = 0;
    for (const Json& finger : cell.at("pressed_s")) five_s += finger.get<double>();
    return fmt::format("{:.2f} s", five_s);
  };
  columns.insert(
      columns.end(),
      {{"lag", lag},
       {"with the lag removed", [](const Json& cell) { return with_interval(cell.at("lag_removed_deg_s")); }},
       {"fastest hit", fastest},
       {"pressed", pressed},
       {"frames lost", lost}});
  page.begin_details("Each finger, the lag, and what the end stops suffer");
  page.table(table_of("Error of each finger in degree-seconds", e.results.at("cells"), columns));
  page.paragraph(std::string(kStops) +
                 " With the lag removed: after the one lag of each trial that makes the error smallest; "
                 "never to be compared with an error in which every lag counts.");
  page.end_details();
}

// Mean over motions of the total error.
double overall(const Json& cells, std::size_t compensator, std::size_t compensators) {
  double total = 0;
  for (std::size_t i = compensator; i < cells.size(); i += compensators) total += mean_error(cells.at(i));
  return total / (static_cast<double>(cells.size()) / static_cast<double>(compensators));
}

void scenario_table(Page& page, const Experiment& e) {
  const Json scenarios = e.results.value("scenarios", Json::array());
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

constexpr std::size_t kFingers = 5;

// Noise of a finger that keeps still shall not look like motion.
void widen(Panel& panel) {
  constexpr double kLeast_deg = 20;
  double least = INFINITY, most = -INFINITY;
  for (const Series& series : panel.series) {
    const auto [low, high] = std::ranges::minmax_element(series.y);
    least = std::min(least, *low);
    most = std::max(most, *high);
  }
  if (most - least >= kLeast_deg) return;
  panel.least = std::floor((least + most - kLeast_deg) / 2);
  panel.most = panel.least + kLeast_deg;
}

// Fingers below one another: angles over the reference, or what is left between them. Throws io::InputError for traces that were cut off.
void add_trial(Page& page, const Saved& saved, const Experiment& e, std::size_t m) {
  std::vector<Columns> runs;
  while (runs.size() < e.compensators.size()) {
    const std::string file = fmt::format("traces/motion{}_compensator{}.csv", m + 1, runs.size() + 1);
    const auto& t_s = runs.emplace_back(saved.columns(file)).at("t_s");
    if (t_s.size() < 2 || t_s.size() != runs.front().at("t_s").size())
      throw io::InputError("{}: ends after {} rows: it was cut off; run the job again",
                           (saved.folder() / file).string(), t_s.size());
  }
  Chart response{{fmt::format("response_{}", m + 1), "Response",
                  "One trial, as the cameras saw it: the finger, and the hand with each compensator."},
                 "time (s)",
                 {}};
  Chart error{
      {fmt::format("error_{}", m + 1), "Error", "Finger minus hand, the same trial."}, "time (s)", {}};
  response.panel_px = error.panel_px = 120;
  for (const auto& finger : e.cell(0, 0).at("finger_error_deg_s").items()) {
    const auto& truth = runs.front().at(finger.key() + "_finger_deg");
    Panel angles{finger.key() + " (deg)", {{"finger", kInk, runs.front().at("t_s"), truth, Style::line, 3}}};
    Panel errors{finger.key() + " (deg)", {}};
    for (std::size_t c = 0; c < runs.size(); ++c) {
      const Columns& run = runs[c];
      const auto& hand = run.at(finger.key() + "_hand_deg");
      angles.series.push_back({e.compensators[c], e.colours[c], run.at("t_s"), hand});
      std::vector<double> left = run.at(finger.key() + "_finger_deg");
      for (std::size_t k = 0; k < left.size(); ++k) left[k] -= hand[k];
      errors.series.push_back({e.compensators[c], e.colours[c], run.at("t_s"), std::move(left)});
    }
    widen(angles);
    widen(errors);
    response.panels.push_back(std::move(angles));
    error.panels.push_back(std::move(errors));
  }
  page.chart(std::move(response));
  page.chart(std::move(error));
}

using Points = std::vector<std::pair<double, double>>;

// A hand seen a little from the side: palm below, a finger is three links in its own plane, bending towards the
// viewer. `at` turns the hand's own units into pixels.
template <class At>
void draw_hand(Drawing& d, const Json& posture_deg, const std::string& colour, const At& at) {
  constexpr double kBase[kFingers][2] = {
      {-1.25, -0.9}, {-0.9, 0.75}, {-0.3, 0.95}, {0.3, 0.85}, {0.85, 0.55}};
  constexpr double kLinks[kFingers][3] = {
      {0.75, 0.6, 0}, {0.95, 0.6, 0.45}, {1.05, 0.7, 0.45}, {0.95, 0.65, 0.45}, {0.7, 0.45, 0.4}};
  constexpr double kAway_deg[kFingers] = {55, 8, 2, -4, -11};  // from straight up, to the left
  d.area({at(-1.1, -2.1), at(-1.25, -0.9), at(-0.9, 0.75), at(-0.3, 0.95), at(0.3, 0.85), at(0.85, 0.55),
          at(0.95, -0.6), at(0.7, -2.1)},
         kShade);
  std::size_t i = 0;
  for (const auto& finger : posture_deg.items()) {
    if (i == kFingers) return;
    const auto joints_deg = finger.value().get<std::array<double, 3>>();
    const double away = kAway_deg[i] * std::numbers::pi / 180;
    double x = kBase[i][0];
    double y = kBase[i][1];
    double flexion = 0;
    Points links = {at(x, y)};
    for (std::size_t link = 0; link < 3; ++link) {
      flexion += joints_deg[link] * std::numbers::pi / 180;
      const double along = kLinks[i][link] * std::cos(flexion);
      const double towards = kLinks[i][link] * std::sin(flexion);
      x += -along * std::sin(away) + 0.45 * towards;
      y += along * std::cos(away) - 0.3 * towards;
      links.push_back(at(x, y));
    }
    d.line(links, colour, 7);
    ++i;
  }
}

void add_posture(Page& page, const Experiment& e, std::size_t m) {
  constexpr int kTile_px = 170;
  constexpr double kUnit_px = 28;
  const Json& motion = e.motions.at(m);
  Drawing d;
  const auto hand = [&](std::size_t tile, const std::string& name, const Json& posture,
                        const std::string& colour) {
    const double left = static_cast<double>(tile % 2) * kTile_px;
    const double top = static_cast<double>(tile >> 1) * (kTile_px + 20);
    d.text(left + kTile_px / 2.0, top + 18, io::start_of(name, 22), "middle", kInk, 13);
    draw_hand(d, posture, colour, [&](double x, double y) {
      return std::pair(left + kTile_px / 2.0 + kUnit_px * x, top + 128 - kUnit_px * y);
    });
  };
  hand(0, "finger (reference)", motion.at("final_posture_deg"), kInk);
  for (std::size_t c = 0; c < e.compensators.size(); ++c)
    hand(c + 1, e.compensators[c], motion.at("traces").at(c).at("final_posture_deg"), e.colours[c]);
  const Figure figure{fmt::format("posture_{}", m + 1), "Final posture",
                      "The joints follow the MCP angle: PIP 3/4, DIP 2/3 of it, the thumb's IP one half."};
  const auto rows = static_cast<int>((e.compensators.size() + 2) / 2);
  page.drawing(figure, d.svg(figure, 2 * kTile_px, rows * (kTile_px + 20)));
}

Chart errors_chart(const Experiment& e) {
  Chart chart{{"errors", "Total error",
               "Mean over all trials, with its 95 % interval as far as that lies above zero; small dots: the "
               "published averages. The scale is logarithmic."},
              "",
              {{"total error E_T (deg s)", {}}}};
  chart.panels[0].is_logarithmic = true;
  chart.panel_px = 320;
  const auto n = static_cast<double>(e.compensators.size());
  for (std::size_t m = 0; m < e.motions.size(); ++m) chart.x_names.push_back(e.title(m));
  Series published{"published", kInk, {}, {}, Style::points, 3.5};
  for (std::size_t c = 0; c < e.compensators.size(); ++c) {
    std::vector<double> at, mean, low, high;
    for (std::size_t m = 0; m < e.motions.size(); ++m) {
      const Json& cell = e.cell(m, c);
      const double half = number_or_nan(cell.at("total_error_deg_s").at("ci95"));
      at.push_back(static_cast<double>(m) + ((static_cast<double>(c) + 0.5) / n - 0.5) * 0.6);
      mean.push_back(mean_error(cell));
      high.push_back(mean.back() + half);
      low.push_back(mean.back() > half ? mean.back() - half : std::min(1.0, mean.back() / 10));
      published.x.push_back(at.back());
      published.y.push_back(number_or_nan(cell.at("published_deg_s")));
    }
    chart.panels[0].series.push_back(intervals(e.colours[c], at, low, high));
    chart.panels[0].series.push_back({e.compensators[c], e.colours[c], at, mean, Style::points, 5});
  }
  chart.panels[0].series.push_back(std::move(published));
  return chart;
}

}  // namespace

void summarize_experiment(Page& page, const Json& results) {
  const Experiment e(results);
  published_table(page, e);
  verdict(page, e);
  page.paragraph(
      fmt::format("End stops are hit at up to {:.0f}°/s, and motors press against one for up to {:.2f} s.",
                  results.at("impact_deg_s").get<double>(), results.at("pressed_s").get<double>()));
  scenario_table(page, e);
  shape_table(page, results.at("shapes"));
  page.paragraph(
      fmt::format("A simulation: person, glove, radio, hand and cameras follow the twin's configuration. "
                  "{:g} Hz, seed {}.",
                  results.at("rate_hz").get<double>(), results.at("seed").get<std::uint64_t>()));
}

void render_experiment(const Saved& saved) {
  const Experiment e(saved.results());
  if (!std::ranges::all_of(e.motions,
                           [&](const Json& m) { return m.at("traces").size() == e.compensators.size(); }))
    throw std::domain_error("not a trace for each compensator");
  Page page(e.results.at("engine") == "twin" ? "Glove to bionic hand, in the twin"
                                             : "Glove to bionic hand, played by " + saved.text("engine"));
  const auto warnings = e.results.value("warnings", std::vector<std::string>());
  if (!warnings.empty()) page.warnings(warnings);
  summarize_experiment(page, e.results);
  page.chart(errors_chart(e));
  finger_table(page, e);
  for (std::size_t m = 0; m < e.motions.size(); ++m) {
    page.heading((e.motions.at(m).at("gesture").is_null() ? "" : "Gesture ") + e.title(m));
    add_trial(page, saved, e, m);
    add_posture(page, e, m);
  }
  page.paragraph("The whole configuration is in results.json; every trial is a row of trials.csv.");
  page.write(saved);
}

}  // namespace flexor::report
