#include "host/report/experiment_figures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "host/io/io.hpp"

namespace flexor::report {
namespace {

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

// Fingers below one another: angles over the reference, or what is left between them.
void add_trial(Page& page, const Saved& saved, const Experiment& e, std::size_t m) {
  std::vector<Columns> runs;
  while (runs.size() < e.compensators.size()) {
    const std::string file = fmt::format("traces/motion{}_compensator{}.csv", m + 1, runs.size() + 1);
    const auto& t_s = runs.emplace_back(saved.columns(file)).at("t_s");
    if (t_s.size() < 2 || t_s.size() != runs.front().at("t_s").size())
      throw io::InputError(fmt::format("{}: ends after {} rows: it was cut off; run the job again",
                                       (saved.folder() / file).string(), t_s.size()));
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
    const double top = static_cast<double>(tile / 2) * (kTile_px + 20);
    d.text(left + kTile_px / 2, top + 18, io::start_of(name, 22), "middle", kInk, 13);
    draw_hand(d, posture, colour, [&](double x, double y) {
      return std::pair(left + kTile_px / 2 + kUnit_px * x, top + 128 - kUnit_px * y);
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

}  // namespace

double mean_error(const Json& cell) { return cell.at("total_error_deg_s").at("mean").get<double>(); }

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

void add_motion(Page& page, const Saved& saved, const Experiment& e, std::size_t m) {
  page.heading((e.motions.at(m).at("gesture").is_null() ? "" : "Gesture ") + e.title(m));
  add_trial(page, saved, e, m);
  add_posture(page, e, m);
}

}  // namespace flexor::report
