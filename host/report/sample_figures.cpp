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

struct Samples {
  std::vector<double> t_s;
  std::vector<double> reading;
  std::vector<double> measured_deg;
  std::vector<double> estimated_deg;
  std::vector<double> line_deg;
  std::vector<double> gap;
  std::vector<double> held_out;
  std::vector<double> pair;  // of recordings that a sample is from; in each t_s starts anew
  std::size_t size() const { return t_s.size(); }
};

// Every so many rows, so that an hour is drawn as quickly as a minute.
std::size_t every(std::size_t rows) { return 1 + rows / kMostPoints; }

// A pair's held-out part, and how much later than its own clock says it is drawn: they follow one another.
struct HeldStretch {
  std::size_t begin;
  std::size_t end;
  double shift_s;
};

std::vector<HeldStretch> held_out_stretches(const Samples& s) {
  std::vector<HeldStretch> out;
  double length_s = 0;
  for (std::size_t k = 0; k < s.size(); ++k) {
    if (s.held_out[k] == 0) continue;
    const bool begins = k == 0 || s.held_out[k - 1] == 0 || s.pair[k] != s.pair[k - 1];
    if (begins) out.push_back({k, k, 0});
    if (!begins) length_s += s.t_s[k] - s.t_s[k - 1];
    out.back().end = k + 1;
  }
  if (out.size() < 2) return out;
  double at_s = 0;
  for (HeldStretch& part : out) {
    part.shift_s = at_s - s.t_s[part.begin];
    at_s += s.t_s[part.end - 1] - s.t_s[part.begin] + kBetween * length_s;
  }
  return out;
}

// Where a log paused.
void add_pauses(Chart& chart, const Samples& s, const HeldStretch& part) {
  for (std::size_t k = part.begin; k < part.end; ++k) {
    if (s.gap[k] == 0) continue;
    const double from_s = s.t_s[k];
    while (k + 1 < part.end && s.gap[k] != 0) ++k;
    chart.shaded.emplace_back(from_s + part.shift_s, s.t_s[k] + part.shift_s);
  }
}

// What is drawn of all parts; NaN between two.
struct Drawn {
  std::vector<double> t_s, measured_deg, estimated_deg, line_deg, error_deg, line_error_deg;
  void add(double t, double measured, double estimated, double line) {
    t_s.push_back(t);
    measured_deg.push_back(measured);
    estimated_deg.push_back(estimated);
    line_deg.push_back(line);
    error_deg.push_back(estimated - measured);
    line_error_deg.push_back(line - measured);
  }
};

Drawn drawn_of(const Samples& s, const std::vector<HeldStretch>& parts) {
  std::size_t samples = 0;
  for (const HeldStretch& part : parts) samples += part.end - part.begin;
  const std::size_t step = every(samples);
  Drawn out;
  for (const HeldStretch& part : parts) {
    if (!out.t_s.empty()) out.add(out.t_s.back(), NAN, NAN, NAN);
    for (std::size_t k = part.begin; k < part.end; k += step)
      out.add(s.t_s[k] + part.shift_s, s.measured_deg[k], s.estimated_deg[k], s.line_deg[k]);
  }
  return out;
}

Samples read_samples(const Saved& saved, const std::string& file) {
  Columns c = saved.columns(file);
  Samples s{c.at("t_s"),
            c.at("reading"),
            c.at("measured_deg"),
            c.at("estimated_deg"),
            c.at("straight_line_deg"),
            c.at("gap"),
            c.at("held_out"),
            c["pair"]};
  s.pair.resize(s.size(), 1);
  if (s.size() < 3 || std::ranges::find(s.held_out, 1.0) == s.held_out.end())
    throw io::InputError("{}: {} holds no held-out part", saved.folder().string(), file);
  return s;
}

// What is held out, or what was fitted, outside pauses.
struct Part {
  std::vector<double> error_deg;  // estimated minus measured
  std::vector<double> reading;
};
Part part_of(const Samples& s, bool held_out) {
  Part out;
  for (std::size_t k = 0; k < s.size(); ++k) {
    if (s.gap[k] != 0 || (s.held_out[k] != 0) != held_out) continue;
    out.error_deg.push_back(s.estimated_deg[k] - s.measured_deg[k]);
    out.reading.push_back(s.reading[k]);
  }
  return out;
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
  std::vector<double> reading, measured_deg, estimated_deg;
  for (std::size_t k = 0; k < s.size(); k += every(s.size())) {
    if (s.gap[k] != 0) continue;
    reading.push_back(s.reading[k]);
    measured_deg.push_back(s.measured_deg[k]);
    estimated_deg.push_back(s.estimated_deg[k]);
  }
  const auto of = [&](const char* key) { return static_map.at(key).get<std::vector<double>>(); };
  const Panel panel{"angle (deg)",
                    {{"camera", kFaint, reading, measured_deg, Style::points, 2},
                     {"compensator", kEstimated, reading, estimated_deg, Style::points, 2},
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
  const std::vector<HeldStretch> parts = held_out_stretches(s);
  const Drawn d = drawn_of(s, parts);
  Chart chart{
      {name, "Held-out response and error",
       "Data that the fit never saw. Top: the camera's angle, the compensator's, and a straight line through "
       "the fitted part. Bottom: what is left of the error. Grey: a log paused there, and the last reading "
       "is held.",
       true},
      parts.size() > 1 ? "time, one recording after another (s)" : "time (s)",
      {{"angle (deg)",
        {{"camera", kInk, d.t_s, d.measured_deg, Style::line, 2.2},
         {"straight line", kBaseline, d.t_s, d.line_deg},
         {"compensator", kEstimated, d.t_s, d.estimated_deg, Style::line, 1.8}}},
       {"error (deg)",
        {{"", kBaseline, d.t_s, d.line_error_deg}, {"", kEstimated, d.t_s, d.error_deg, Style::line, 1.8}}}}};
  for (const HeldStretch& part : parts) add_pauses(chart, s, part);
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

Chart error_correlation(const std::string& name, const Part& held, double period_s) {
  const auto n = static_cast<double>(held.error_deg.size());
  const auto lags = static_cast<std::size_t>(std::clamp(5 / period_s, 0.0, n / 4));
  const std::vector<double> own = correlation(held.error_deg, held.error_deg, lags);
  const std::vector<double> reading = correlation(held.reading, held.reading, lags);
  const std::vector<double> cross = correlation(held.error_deg, held.reading, lags);
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
  const Part held = part_of(s, true);
  if (held.error_deg.empty()) return;  // none of it lies outside pauses
  page.chart(error_histogram(name("errors"), part_of(s, false).error_deg, held.error_deg));
  page.chart(
      error_correlation(name("error_correlation"), held, 1 / saved.results().at("rate_hz").get<double>()));
}

}  // namespace flexor::report
