#include "host/report/sample_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/io/io.hpp"

namespace flexor::report {
namespace {

constexpr std::size_t kMostPoints = 4000;
constexpr double kBetween = 0.02;  // of the held-out parts' length, between two of them

// A pair's held-out part, and how much later than its own clock says it is drawn: they follow one another.
struct Part {
  std::size_t begin;
  std::size_t end;
  double shift_s;
};

std::vector<Part> held_out_parts(const Samples& s) {
  std::vector<Part> out;
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
  for (Part& part : out) {
    part.shift_s = at_s - s.t_s[part.begin];
    at_s += s.t_s[part.end - 1] - s.t_s[part.begin] + kBetween * length_s;
  }
  return out;
}

// Grey bands where a log paused.
void shade_pauses(Gnuplot& g, const Samples& s, const Part& part) {
  for (std::size_t k = part.begin; k < part.end;) {
    if (s.gap[k] == 0) {
      ++k;
      continue;
    }
    std::size_t end = k;
    while (end < part.end && s.gap[end] != 0) ++end;
    g.add(
        "set object rectangle from first {:.2f}, graph 0 to first {:.2f}, graph 1 fc rgb '#e8e8e8' fs solid "
        "noborder behind",
        s.t_s[k] + part.shift_s, s.t_s[std::min(end, part.end - 1)] + part.shift_s);
    k = end;
  }
}

std::vector<std::string> held_out_rows(const Samples& s, const std::vector<Part>& parts) {
  std::size_t samples = 0;
  for (const Part& part : parts) samples += part.end - part.begin;
  const std::size_t step = every(samples);
  std::vector<std::string> out;
  for (const Part& part : parts) {
    if (!out.empty()) out.emplace_back();  // breaks the line
    for (std::size_t i = 0; i < (part.end - part.begin) / step; ++i) {
      const std::size_t k = part.begin + i * step;
      out.push_back(fmt::format("{:.3f} {:.2f} {:.2f} {:.2f}", s.t_s[k] + part.shift_s, s.measured_deg[k],
                                s.estimated_deg[k], s.line_deg[k]));
    }
  }
  return out;
}

}  // namespace

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
    throw io::InputError(fmt::format("{}: {} holds no held-out part", saved.folder().string(), file));
  return s;
}

std::size_t every(std::size_t rows) { return 1 + rows / kMostPoints; }

Held held_of(const Samples& s) {
  Held out{errors(s, true), {}};
  for (std::size_t k = 0; k < s.size(); ++k) {
    if (s.held_out[k] != 0 && s.gap[k] == 0) out.reading.push_back(s.reading[k]);
  }
  return out;
}

std::vector<double> errors(const Samples& s, bool held_out) {
  std::vector<double> out;
  for (std::size_t k = 0; k < s.size(); ++k) {
    if (s.gap[k] == 0 && (s.held_out[k] != 0) == held_out)
      out.push_back(s.estimated_deg[k] - s.measured_deg[k]);
  }
  return out;
}

// The readings against the angles, measured and estimated, and the static map that a finger held still approaches.
void draw_curve(Gnuplot& g, const std::string& name, const Samples& s, const Curve& curve) {
  g.begin(name, 400);
  const std::size_t step = every(s.size());
  g.data("points", s.size() / step, [&](std::size_t i) {
    const std::size_t k = i * step;
    return s.gap[k] != 0
               ? std::string("nan nan nan")
               : fmt::format("{:.1f} {:.2f} {:.2f}", s.reading[k], s.measured_deg[k], s.estimated_deg[k]);
  });
  const auto line = [&](const char* block, const Json& xy) {
    const auto x = xy.at("reading").get<std::vector<double>>();
    const auto y = xy.at("angle_deg").get<std::vector<double>>();
    g.data(block, x.size(), [&](std::size_t i) { return fmt::format("{:.3f} {:.3f}", x[i], y.at(i)); });
  };
  line("map", curve.static_map);
  g.add("set xlabel {} noenhanced; set ylabel 'angle (deg)'; set key maxrows 2",
        gnuplot_text(curve.unit.empty() ? "sensor reading" : fmt::format("sensor reading ({})", curve.unit)));
  const bool has_knots = !curve.knots.is_null();
  if (has_knots) line("knots", curve.knots);
  g.add(
      "plot $points using 1:2 with points pt 7 ps 0.2 lc rgb '#999999' title 'camera', "
      "$points using 1:3 with points pt 7 ps 0.2 lc rgb '{}' title 'compensator', "
      "$map using 1:2 with lines lw 2.5 lc rgb '{}' title 'finger held still'{}",
      kEstimated, kHeldOut,
      has_knots ? ", $knots using 1:2 with points pt 6 ps 0.9 lw 2 lc rgb '#D55E00' title 'knots'" : "");
}

void draw_holdout(Gnuplot& g, const std::string& name, const Samples& s) {
  const std::vector<Part> parts = held_out_parts(s);
  const std::vector<std::string> rows = held_out_rows(s, parts);
  g.begin(name, 520);
  for (const Part& part : parts) shade_pauses(g, s, part);
  g.data("run", rows.size(), [&](std::size_t i) { return rows[i]; });
  g.add("set multiplot layout 2,1; set xlabel '{}'; set ylabel 'angle (deg)'",
        parts.size() > 1 ? "time, one recording after another (s)" : "time (s)");
  g.add(
      "plot $run using 1:2 with lines lw 2.2 lc rgb '{}' title 'camera', "
      "$run using 1:4 with lines lw 1.1 lc rgb '{}' title 'straight line', "
      "$run using 1:3 with lines lw 1.4 lc rgb '{}' title 'compensator'",
      kMeasured, kBaseline, kEstimated);
  g.add("set ylabel 'error (deg)'; unset key");
  g.add(
      "plot 0 with lines lc rgb '#666666' notitle, "
      "$run using 1:($4-$2) with lines lw 1.1 lc rgb '{}' title 'straight line', "
      "$run using 1:($3-$2) with lines lw 1.4 lc rgb '{}' title 'compensator'",
      kBaseline, kEstimated);
  g.add("unset multiplot");
}

void draw_error_histogram(Gnuplot& g, const std::string& name, const std::vector<double>& fitted,
                          const std::vector<double>& held) {
  g.begin(name, 330);
  double reach = 1;
  for (const double e : held) reach = std::max(reach, std::abs(e));
  const double width = reach / 20;
  const auto histogram = [&](const char* block, const std::vector<double>& of) {
    g.data(block, 41, [&](std::size_t i) {
      const double centre = (static_cast<double>(i) - 20) * width;
      const auto count =
          std::ranges::count_if(of, [&](double e) { return std::abs(e - centre) <= width / 2; });
      return fmt::format(
          "{:.3f} {:.3f}", centre,
          100.0 * static_cast<double>(count) / static_cast<double>(std::max<std::size_t>(of.size(), 1)));
    });
  };
  histogram("fitted", fitted);
  histogram("held", held);
  g.add("set xlabel 'error (deg)'; set ylabel 'share of samples (%)'");
  g.add("set style fill transparent solid 0.35 noborder");
  g.add(
      "plot $fitted using 1:2 with boxes lc rgb '#999999' title 'fitted part', "
      "$held using 1:2 with steps lw 2 lc rgb '{}' title 'held out'",
      kHeldOut);
}

namespace {

// Correlation of `later` with `before`, from no lag to so many.
std::vector<double> correlation(std::vector<double> later, std::vector<double> before, std::size_t lags) {
  for (std::vector<double>* x : {&later, &before}) {
    double mean = 0;
    for (const double v : *x) mean += v / static_cast<double>(x->size());
    double squares = 1e-300;
    for (double& v : *x) {
      v -= mean;
      squares += v * v;
    }
    for (double& v : *x) v /= std::sqrt(squares);
  }
  std::vector<double> out(lags + 1, 0);
  for (std::size_t lag = 0; lag <= lags; ++lag) {
    for (std::size_t k = lag; k < later.size(); ++k) out[lag] += later[k] * before[k - lag];
  }
  return out;
}

}  // namespace

void draw_error_correlation(Gnuplot& g, const std::string& name, const Held& held, double period_s) {
  g.begin(name, 330);
  const auto n = static_cast<double>(held.error_deg.size());
  const auto lags = std::min(static_cast<std::size_t>(5 / period_s), held.error_deg.size() / 4);
  const std::vector<double> own = correlation(held.error_deg, held.error_deg, lags);
  const std::vector<double> reading = correlation(held.reading, held.reading, lags);
  const std::vector<double> cross = correlation(held.error_deg, held.reading, lags);
  double together = 1;
  for (std::size_t k = 1; k <= lags; ++k) together += 2 * own[k] * reading[k];
  g.data("acf", lags + 1, [&](std::size_t lag) {
    return fmt::format("{:.3f} {:.4f} {:.4f}", static_cast<double>(lag) * period_s, own[lag], cross[lag]);
  });
  const double band = 2 / std::sqrt(n);
  const double cross_band = 2 * std::sqrt(std::max(together, 1.0) / n);
  g.add("set xlabel 'distance in time (s)'; set ylabel 'correlation'; set yrange [-1:1]");
  g.add(
      "plot {0} with lines lc rgb '#999999' dt 2 title 'bounds, white noise', "
      "-{0} with lines lc rgb '#999999' dt 2 notitle, "
      "{1} with lines lc rgb '{2}' dt 3 title 'bounds', "
      "-{1} with lines lc rgb '{2}' dt 3 notitle, "
      "$acf using 1:2 with lines lw 2 lc rgb '{3}' title 'errors', "
      "$acf using 1:3 with lines lw 2 lc rgb '{2}' title 'errors, earlier readings'",
      band, cross_band, kEstimated, kHeldOut);
}

Figure holdout_figure(const std::string& name) {
  return {name, "Held-out response and error",
          "Data that the fit never saw. Top: the camera's angle, the compensator's, and a straight line "
          "through the "
          "fitted part. Bottom: what is left of the error. Grey: a log paused there, and the last reading "
          "is held."};
}

Figure curve_figure(const std::string& name) {
  return {name, "From sensor reading to angle",
          "Samples outside pauses. Where the compensator's cloud lies on the camera's, it follows the "
          "finger, loops and "
          "all. The line is where its angle would settle if the finger stopped."};
}

Figure error_histogram_figure(const std::string& name) {
  return {name, "Residual check: size", "How the errors are distributed. Both parts should look alike."};
}

Figure error_correlation_figure(const std::string& name) {
  return {
      name, "Residual check: runs",
      "Whether errors come in runs, and whether earlier readings would foretell them. Outside the lines (two "
      "standard errors; of both, by Bartlett's formula) something repeatable is left that the structure "
      "cannot "
      "express."};
}

}  // namespace flexor::report
