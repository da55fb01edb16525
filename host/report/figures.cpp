#include "host/report/figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/model/simulation.hpp"
#include "host/report/gnuplot.hpp"

namespace flexor::report {
namespace {

// Colours that stay apart for colour-blind readers (Okabe, Ito 2008).
constexpr const char* kMeasured = "#222222";
constexpr const char* kEstimated = "#0072B2";
constexpr const char* kBaseline = "#E69F00";
constexpr const char* kHeldOut = "#D55E00";

// Since both logs run.
double seconds(const recording::Aligned& a, std::size_t k) { return a.t_s[k] - a.t_s[a.overlap_begin]; }

struct Span {
  double low;
  double high;
};

Span span_of(const std::vector<double>& v) {
  const auto [low, high] = std::ranges::minmax(v);
  return {low, high};
}

void alignment(Gnuplot& g, const Identification& r) {
  const recording::Aligned& a = r.aligned;
  g.begin("alignment", 560);
  const Span u = span_of(a.input);
  const Span y = span_of(a.angle_deg);
  double covariance = 0;
  for (std::size_t k = a.overlap_begin; k < a.size(); ++k) {
    covariance += (a.input[k] - (u.low + u.high) / 2) * (a.angle_deg[k] - (y.low + y.high) / 2);
  }
  // The sensor is stretched onto the angle's range, turned over if it falls where the angle rises.
  const double sign = covariance < 0 ? -1 : 1;
  const double from = sign > 0 ? y.low : y.high;
  const double scale = sign * (y.high - y.low) / (u.high - u.low);
  g.data("both", a.size() - a.overlap_begin, [&](std::size_t i) {
    const std::size_t k = a.overlap_begin + i;
    return fmt::format("{:.3f} {:.2f} {:.2f}", seconds(a, k), a.angle_deg[k],
                       from + scale * (a.input[k] - u.low));
  });
  const recording::Alignment al = a.alignment.value_or(recording::Alignment());
  g.data("scan", al.scan_offset_s.size(), [&](std::size_t i) {
    return fmt::format("{:.2f} {:.4f}", al.scan_offset_s[i], al.scan_eta_squared[i]);
  });
  g.add("set multiplot layout 2,1");
  g.add("set xlabel 'time (s)'; set ylabel 'angle (deg)'");
  g.add(
      "plot $both using 1:2 with lines lw 1.6 lc rgb '{}' title 'camera', "
      "$both using 1:3 with lines lw 1.2 lc rgb '{}' title 'sensor, stretched'",
      kMeasured, kEstimated);
  g.add("set xlabel 'clock offset tried (s)'; set ylabel 'angle explained (%)'; set yrange [0:105]");
  g.add("set arrow from {0},0 to {0},105 nohead lc rgb '{1}' lw 2", a.clock_offset_s, kHeldOut);
  g.add(
      "plot $scan using 1:(100*$2) with lines lw 1.2 lc rgb '{}' title 'by the sensor at this offset', "
      "NaN with lines lw 2 lc rgb '{}' title 'offset used'",
      kEstimated, kHeldOut);
  g.add("unset multiplot");
}

// The readings against the angles, measured and estimated, and the static map that a finger held still
// approaches.
void curve(Gnuplot& g, const Identification& r) {
  const recording::Aligned& a = r.aligned;
  g.begin("curve", 480);
  g.data("points", a.input.size(), [&](std::size_t k) {
    return a.gap[k] ? std::string("nan nan nan")
                    : fmt::format("{:.1f} {:.2f} {:.2f}", a.input[k], a.angle_deg[k], r.estimated_deg[k]);
  });
  model::Model still = r.model;
  model::Channel& channel = still.channels.front();
  channel.hysteresis.reset();
  channel.lti.poles_rad_s.clear();
  channel.lti.taps.clear();
  model::Simulation<model::DoubleArithmetic> map(still);
  const Span u = span_of(a.input);
  constexpr std::size_t kPoints = 300;
  g.data("map", kPoints + 1, [&](std::size_t i) {
    const double at = u.low + (u.high - u.low) * static_cast<double>(i) / kPoints;
    return fmt::format("{:.2f} {:.3f}", at, map.step(0, at).angle_deg);
  });
  g.add("set xlabel {} noenhanced; set ylabel 'angle (deg)'",
        gnuplot_text(channel.input_unit.empty() ? "sensor reading"
                                                : fmt::format("sensor reading ({})", channel.input_unit)));
  const auto knots = [&](const model::Curve& c) {
    g.data("knots", c.x.size(), [&](std::size_t i) { return fmt::format("{:.3f} {:.3f}", c.x[i], c.y[i]); });
    return ", $knots using 1:2 with points pt 6 ps 0.9 lw 2 lc rgb '#D55E00' title 'its knots'";
  };
  g.add(
      "plot $points using 1:2 with points pt 7 ps 0.2 lc rgb '#999999' title 'camera', "
      "$points using 1:3 with points pt 7 ps 0.2 lc rgb '{}' title 'compensator', "
      "$map using 1:2 with lines lw 2.5 lc rgb '{}' title 'a finger held still for long'{}",
      kEstimated, kHeldOut, channel.input_curve ? knots(*channel.input_curve) : "");
}

void dynamics(Gnuplot& g, const Identification& r) {
  g.begin("dynamics", 360);
  model::Channel channel;
  channel.name = r.model.channels.front().name;
  channel.lti = r.model.channels.front().lti;
  channel.lti.gain = 1;
  channel.lti.offset = 0;
  channel.valid_min = -10;
  channel.valid_max = 10;
  channel.saturation = {-100, 100};
  model::Model m;
  m.channels = {channel};
  m.sample_period_s = r.model.sample_period_s;
  model::Simulation<model::DoubleArithmetic> step(m);
  double slowest = 5;
  for (const double pole : channel.lti.poles_rad_s) slowest = std::min(slowest, -pole);
  const double duration = std::clamp(4 / slowest, 0.5, 10.0);
  const auto rows = static_cast<std::size_t>(duration / m.sample_period_s) + 1;
  (void)step.step(0, 0);
  g.data("step", rows + 1, [&](std::size_t k) {
    const double y = k == 0 ? 0 : step.step(0, 1).angle_deg;
    return fmt::format("{:.3f} {:.5f}", static_cast<double>(k) * m.sample_period_s - m.sample_period_s,
                       100 * y);
  });
  g.add("set xlabel 'time after a step of the straightened sensor (s)'");
  g.add("set ylabel 'angle reached (%)'; set yrange [0:*]; set xrange [{}:{}]", -0.02 * duration, duration);
  g.add(
      "plot 100 with lines lc rgb '#999999' dt 2 notitle, "
      "$step using 1:2 with steps lw 2.5 lc rgb '{}' title 'output of the linear part'",
      kEstimated);
}

// Grey bands where a log paused.
void shade_pauses(Gnuplot& g, const recording::Aligned& a, std::size_t first) {
  for (std::size_t k = first; k < a.gap.size();) {
    if (!a.gap[k]) {
      ++k;
      continue;
    }
    std::size_t end = k;
    while (end < a.gap.size() && a.gap[end]) ++end;
    g.add(
        "set object rectangle from first {:.2f}, graph 0 to first {:.2f}, graph 1 fc rgb '#e8e8e8' fs solid "
        "noborder "
        "behind",
        seconds(a, k), seconds(a, std::min(end, a.size() - 1)));
    k = end;
  }
}

void holdout(Gnuplot& g, const Identification& r) {
  const recording::Aligned& a = r.aligned;
  g.begin("holdout", 620);
  shade_pauses(g, a, r.holdout_begin);
  g.data("run", a.size() - r.holdout_begin, [&](std::size_t i) {
    const std::size_t k = r.holdout_begin + i;
    return fmt::format("{:.3f} {:.2f} {:.2f} {:.2f}", seconds(a, k), a.angle_deg[k], r.estimated_deg[k],
                       r.baseline_deg[k]);
  });
  g.add("set multiplot layout 2,1; set xlabel 'time (s)'; set ylabel 'angle (deg)'");
  g.add(
      "plot $run using 1:2 with lines lw 2.2 lc rgb '{}' title 'camera', "
      "$run using 1:4 with lines lw 1.1 lc rgb '{}' title 'straight line', "
      "$run using 1:3 with lines lw 1.4 lc rgb '{}' title 'compensator'",
      kMeasured, kBaseline, kEstimated);
  g.add("set ylabel 'error (deg)'");
  g.add(
      "plot 0 with lines lc rgb '#666666' notitle, "
      "$run using 1:($4-$2) with lines lw 1.1 lc rgb '{}' title 'straight line', "
      "$run using 1:($3-$2) with lines lw 1.4 lc rgb '{}' title 'compensator'",
      kBaseline, kEstimated);
  g.add("unset multiplot");
}

void residuals(Gnuplot& g, const Identification& r) {
  const recording::Aligned& a = r.aligned;
  g.begin("residuals", 360);
  std::vector<double> fitted;
  std::vector<double> held;
  for (std::size_t k = 0; k < a.size(); ++k) {
    if (a.gap[k]) continue;
    (k < r.holdout_begin ? fitted : held).push_back(r.estimated_deg[k] - a.angle_deg[k]);
  }
  double reach = 1;
  for (const double e : held) reach = std::max(reach, std::abs(e));
  const double width = reach / 20;
  const auto histogram = [&](const char* name, const std::vector<double>& errors) {
    g.data(name, 41, [&](std::size_t i) {
      const double centre = (static_cast<double>(i) - 20) * width;
      const auto count =
          std::ranges::count_if(errors, [&](double e) { return std::abs(e - centre) <= width / 2; });
      return fmt::format("{:.3f} {:.3f}", centre,
                         100.0 * static_cast<double>(count) / static_cast<double>(errors.size()));
    });
  };
  histogram("fitted", fitted);
  histogram("held", held);
  double mean = 0;
  for (const double e : held) mean += e / static_cast<double>(held.size());
  const auto lags = std::min<std::size_t>(static_cast<std::size_t>(5 / a.period_s), held.size() / 4);
  double variance = 1e-300;
  for (const double e : held) variance += (e - mean) * (e - mean);
  g.data("acf", lags + 1, [&](std::size_t lag) {
    double sum = 0;
    for (std::size_t k = lag; k < held.size(); ++k) sum += (held[k] - mean) * (held[k - lag] - mean);
    return fmt::format("{:.3f} {:.4f}", static_cast<double>(lag) * a.period_s, sum / variance);
  });
  g.add("set multiplot layout 1,2; set xlabel 'error (deg)'; set ylabel 'share of samples (%)'");
  g.add("set style fill transparent solid 0.35 noborder");
  g.add(
      "plot $fitted using 1:2 with boxes lc rgb '#999999' title 'fitted part', "
      "$held using 1:2 with steps lw 2 lc rgb '{}' title 'held out'",
      kHeldOut);
  const double band = 2 / std::sqrt(static_cast<double>(held.size()));
  g.add("set xlabel 'distance in time (s)'; set ylabel 'correlation of errors'; set yrange [-1:1]");
  g.add(
      "plot {} with lines lc rgb '#999999' dt 2 title 'white noise stays inside', "
      "{} with lines lc rgb '#999999' dt 2 notitle, "
      "$acf using 1:2 with lines lw 2 lc rgb '{}' title 'held out'",
      band, -band, kHeldOut);
  g.add("unset multiplot");
}

}  // namespace

std::vector<Figure> draw(const Identification& r) {
  Gnuplot g;
  alignment(g, r);
  curve(g, r);
  dynamics(g, r);
  holdout(g, r);
  residuals(g, r);
  g.run();
  std::vector<Figure> figures = {
      {"holdout",
       "Held-out response and error",
       "Data that the fit never saw. Top: the camera's angle, the compensator's, and a straight line through "
       "the fitted part. Bottom: what is left of the error. Grey: a log paused there, and the last reading "
       "is "
       "held.",
       {}},
      {"alignment",
       "Clock alignment",
       "Top: both recordings on one clock. Bottom: how much of the angle's variation any curve of the sensor "
       "explains, for every clock offset; the highest peak is the offset, other peaks are other repetitions.",
       {}},
      {"curve",
       "From sensor reading to angle",
       "Every sample outside pauses. Where the compensator's cloud lies on the camera's, it follows the "
       "finger, "
       "loops and all. The line is where its angle would settle if the finger stopped.",
       {}},
      {"dynamics",
       "Dynamics",
       "How the compensator's output follows a sudden change of the sensor. A quick rise means little delay; "
       "what comes "
       "later undoes the sensor's creep.",
       {}},
      {"residuals",
       "Residual checks",
       "Left: the errors' distribution; both parts should look alike. Right: whether errors come in runs. "
       "Outside "
       "the dashed lines something repeatable is left that the structure cannot express.",
       {}}};
  for (Figure& figure : figures) figure.svg = g.svg(figure.name);
  return figures;
}

}  // namespace flexor::report
