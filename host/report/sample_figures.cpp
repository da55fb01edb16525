#include "host/report/sample_figures.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "host/io/io.hpp"

namespace flexor::report {
namespace {

// Colours that stay apart for colour-blind readers (Okabe, Ito 2008).
constexpr const char* kEstimated = "#0072B2";
constexpr const char* kBaseline = "#E69F00";
constexpr const char* kHeldOut = "#D55E00";

constexpr std::size_t kMostPoints = 4000;
constexpr double kBetween = 0.02;  // of the held-out parts' length, between two of them

struct Sample {
  double t_s = NAN;
  double reading = NAN;
  double measured_deg = NAN;
  double estimated_deg = NAN;
  double line_deg = NAN;
  bool is_gap = false;
  bool is_held_out = false;
  double pair = 1;  // of recordings that it is from, each with t_s from its start
  double error_deg() const { return estimated_deg - measured_deg; }
  double line_error_deg() const { return line_deg - measured_deg; }
};
using Samples = std::vector<Sample>;

template <class Value>
std::vector<double> column(const Samples& samples, Value value) {
  std::vector<double> out;
  std::ranges::transform(samples, std::back_inserter(out), value);
  return out;
}

// Every so many rows, so that an hour is drawn as quickly as a minute.
std::size_t every(std::size_t rows) { return 1 + rows / kMostPoints; }

// Each pair's held-out part; where there are several, on one clock, one after the other.
std::vector<Samples> held_out_parts(const Samples& s) {
  std::vector<Samples> out;
  double length_s = 0;
  for (std::size_t k = 0; k < s.size(); ++k) {
    if (!s[k].is_held_out) continue;
    const bool begins = k == 0 || !s[k - 1].is_held_out || s[k].pair != s[k - 1].pair;
    if (begins) out.emplace_back();
    if (!begins) length_s += s[k].t_s - s[k - 1].t_s;
    out.back().push_back(s[k]);
  }
  double at_s = 0;
  for (Samples& part : out) {
    const double shift_s = out.size() > 1 ? at_s - part.front().t_s : 0;
    at_s += part.back().t_s - part.front().t_s + kBetween * length_s;
    for (Sample& sample : part) sample.t_s += shift_s;
  }
  return out;
}

// Where a log paused.
void add_pauses(Chart& chart, const Samples& part) {
  for (std::size_t k = 0; k < part.size(); ++k) {
    if (!part[k].is_gap) continue;
    const double from_s = part[k].t_s;
    while (k + 1 < part.size() && part[k].is_gap) ++k;
    chart.shaded.emplace_back(from_s, part[k].t_s);
  }
}

// What is drawn of all parts; nothing between two.
Samples drawn_of(const std::vector<Samples>& parts) {
  std::size_t samples = 0;
  for (const Samples& part : parts) samples += part.size();
  Samples out;
  for (const Samples& part : parts) {
    if (!out.empty()) out.push_back({out.back().t_s});
    for (std::size_t k = 0; k < part.size(); k += every(samples)) out.push_back(part[k]);
  }
  return out;
}

Samples read_samples(const Saved& saved, const std::string& file) {
  const Columns c = saved.columns(file);
  const auto of = [&](const char* name) { return c.at(name).begin(); };
  auto reading = of("reading"), measured = of("measured_deg"), estimated = of("estimated_deg"),
       line = of("straight_line_deg"), gap = of("gap"), held_out = of("held_out");
  Samples out;
  for (const double t_s : c.at("t_s"))
    out.push_back({t_s, *reading++, *measured++, *estimated++, *line++, *gap++ != 0, *held_out++ != 0});
  if (const auto pair = c.find("pair"); pair != c.end())
    for (std::size_t k = 0; k < out.size(); ++k) out[k].pair = pair->second[k];
  if (out.size() < 3 || std::ranges::none_of(out, &Sample::is_held_out))
    throw io::InputError("{}: {} holds no held-out part", saved.folder().string(), file);
  return out;
}

// What is held out, or what was fitted, outside pauses.
Samples part_of(Samples s, bool held_out) {
  std::erase_if(s, [&](const Sample& one) { return one.is_gap || one.is_held_out != held_out; });
  return s;
}

// Correlation of `later` with `before`, from no lag to so many.
std::vector<double> correlation(const std::vector<double>& later, const std::vector<double>& before,
                                std::size_t lags) {
  const auto scaled = [](const std::vector<double>& of) -> Eigen::VectorXd {
    const Eigen::Map<const Eigen::ArrayXd> x(of.data(), std::ssize(of));
    return (x - x.mean()).matrix().normalized();
  };
  const Eigen::VectorXd a = scaled(later), b = scaled(before);
  std::vector<double> out;
  for (Eigen::Index lag = 0; lag <= static_cast<Eigen::Index>(lags); ++lag)
    out.push_back(a.tail(a.size() - lag).dot(b.head(b.size() - lag)));
  return out;
}

// The readings against the angles, measured and estimated, and the static map that a finger held still approaches.
Chart curve_chart(const std::string& name, const Samples& s, const Json& static_map,
                  const std::string& unit) {
  Samples shown;
  for (std::size_t k = 0; k < s.size(); k += every(s.size()))
    if (!s[k].is_gap) shown.push_back(s[k]);
  const std::vector<double> reading = column(shown, &Sample::reading);
  const auto of = [&](const char* key) { return static_map.at(key).get<std::vector<double>>(); };
  const Panel panel{
      "angle (deg)",
      {{"camera", kFaint, reading, column(shown, &Sample::measured_deg), Style::points, 2},
       {"compensator", kEstimated, reading, column(shown, &Sample::estimated_deg), Style::points, 2},
       {"finger held still", kHeldOut, of("reading"), of("angle_deg"), Style::line, 2.5}}};
  return {
      .figure = {name, "From sensor reading to angle",
                 "Samples outside pauses. Where the compensator's cloud lies on the camera's, it follows the "
                 "finger, loops and all. The line is where its angle would settle if the finger stopped."},
      .x_label = unit.empty() ? "sensor reading" : fmt::format("sensor reading ({})", unit),
      .panels = {panel},
      .panel_px = 300};
}

Chart holdout_chart(const std::string& name, const Samples& s) {
  const std::vector<Samples> parts = held_out_parts(s);
  const Samples d = drawn_of(parts);
  const std::vector<double> t_s = column(d, &Sample::t_s);
  Chart chart{
      {name, "Held-out response and error",
       "Data that the fit never saw. Top: the camera's angle, the compensator's, and a straight line through "
       "the fitted part. Bottom: what is left of the error. Grey: a log paused there, and the last reading "
       "is held.",
       true},
      parts.size() > 1 ? "time, one recording after another (s)" : "time (s)",
      {{"angle (deg)",
        {{"camera", kInk, t_s, column(d, &Sample::measured_deg), Style::line, 2.2},
         {"straight line", kBaseline, t_s, column(d, &Sample::line_deg)},
         {"compensator", kEstimated, t_s, column(d, &Sample::estimated_deg), Style::line, 1.8}}},
       {"error (deg)",
        {{"", kBaseline, t_s, column(d, &Sample::line_error_deg)},
         {"", kEstimated, t_s, column(d, &Sample::error_deg), Style::line, 1.8}}}}};
  for (const Samples& part : parts) add_pauses(chart, part);
  return chart;
}

Chart error_histogram(const std::string& name, const std::vector<double>& fitted,
                      const std::vector<double>& held) {
  double reach = 1;
  for (const double e : held) reach = std::max(reach, std::abs(e));
  const double width = reach / 20;
  const auto histogram = [&](const std::string& part, const char* colour, const std::vector<double>& of) {
    Series out{part, colour, {}, {}, Style::steps, 2};
    for (int i = -20; i <= 20; ++i) {
      out.x.push_back(i * width);
      const auto count =
          std::ranges::count_if(of, [&](double e) { return std::abs(e - i * width) <= width / 2; });
      out.y.push_back(100.0 * static_cast<double>(count) /
                      static_cast<double>(std::max<std::size_t>(of.size(), 1)));
    }
    return out;
  };
  return {.figure = {name, "Residual check: size",
                     "How the errors are distributed. Both parts should look alike."},
          .x_label = "error (deg)",
          .panels = {{"share of samples (%)",
                      {histogram("fitted part", kFaint, fitted), histogram("held out", kHeldOut, held)}}},
          .panel_px = 300};
}

Chart error_correlation(const std::string& name, const std::vector<double>& error_deg,
                        const std::vector<double>& readings, double period_s) {
  const auto n = static_cast<double>(error_deg.size());
  const auto lags = static_cast<std::size_t>(std::clamp(5 / period_s, 0.0, n / 4));
  const std::vector<double> own = correlation(error_deg, error_deg, lags);
  const std::vector<double> reading = correlation(readings, readings, lags);
  const std::vector<double> cross = correlation(error_deg, readings, lags);
  double together = 1;
  std::vector<double> distance_s(lags + 1, 0);
  for (std::size_t k = 1; k <= lags; ++k) {
    together += 2 * own[k] * reading[k];
    distance_s[k] = static_cast<double>(k) * period_s;
  }
  const double band = 2 / std::sqrt(n);
  const double cross_band = 2 * std::sqrt(std::max(together, 1.0) / n);
  const auto level = [&](const std::string& text, const char* colour, double y) {
    return Series{text, colour, {0, distance_s.back()}, {y, y}, Style::line, 1.5, true};
  };
  return {
      .figure =
          {name, "Residual check: runs",
           "Whether errors come in runs, and whether earlier readings would foretell them. Outside the lines "
           "(two standard errors; of both, by Bartlett's formula) something repeatable is left that the "
           "structure cannot express."},
      .x_label = "distance in time (s)",
      .panels = {{"correlation",
                  {level("bounds, white noise", kFaint, band),
                   level("", kFaint, -band),
                   level("bounds", kHeldOut, cross_band),
                   level("", kHeldOut, -cross_band),
                   {"errors", kEstimated, distance_s, own, Style::line, 2},
                   {"errors, earlier readings", kHeldOut, distance_s, cross, Style::line, 2}},
                  -1,
                  1}},
      .panel_px = 300};
}

}  // namespace

void joint_figures(Page& page, const Saved& saved, const Json& joint, std::size_t number) {
  const Samples s = read_samples(saved, fmt::format("samples-{}.csv", number));
  const auto name = [&](const char* figure) { return fmt::format("{}_{}", figure, number); };
  const Json& sensors = joint.at("sensors");
  page.chart(holdout_chart(name("holdout"), s));
  Chart curve =
      curve_chart(name("curve"), s, joint.at("static_map"), sensors.at(0).at("unit").get<std::string>());
  if (sensors.size() > 1)
    curve.figure.caption += " The joint's other sensors are held at their medians for that line.";
  page.chart(std::move(curve));
  const Samples held = part_of(s, true);
  if (held.empty()) return;  // none of it lies outside pauses
  const std::vector<double> error_deg = column(held, &Sample::error_deg);
  page.chart(error_histogram(name("errors"), column(part_of(s, false), &Sample::error_deg), error_deg));
  page.chart(error_correlation(name("error_correlation"), error_deg, column(held, &Sample::reading),
                               1 / saved.results().at("rate_hz").get<double>()));
}

}  // namespace flexor::report
