#include "host/report/jobs.hpp"

#include <algorithm>
#include <cmath>

#include "host/io/io.hpp"
#include "host/report/page.hpp"

namespace flexor::report {
namespace {

// Colours that stay apart for colour-blind readers (Okabe, Ito 2008).
constexpr const char* kMeasured = "#222222";
constexpr const char* kEstimated = "#0072B2";
constexpr const char* kBaseline = "#E69F00";
constexpr const char* kHeldOut = "#D55E00";
constexpr std::size_t kMostPoints = 4000;

struct Samples {
  std::vector<double> t_s;
  std::vector<double> reading;
  std::vector<double> measured_deg;
  std::vector<double> estimated_deg;
  std::vector<double> line_deg;
  std::vector<double> gap;
  std::vector<double> held_out;
  std::size_t size() const { return t_s.size(); }
  std::size_t first_held_out() const {
    return static_cast<std::size_t>(std::ranges::find(held_out, 1.0) - held_out.begin());
  }
  std::size_t first_shared() const {
    return static_cast<std::size_t>(std::ranges::find_if(t_s, [](double t) { return t >= 0; }) - t_s.begin());
  }
};

Samples samples_of(const Saved& saved) {
  Columns c = saved.columns("samples.csv");
  Samples s{c.at("t_s"),           c.at("reading"),           c.at("measured_deg"),
            c.at("estimated_deg"), c.at("straight_line_deg"), c.at("gap"),
            c.at("held_out")};
  if (s.size() < 3 || s.first_held_out() == s.size())
    throw io::InputError(fmt::format("{}: samples.csv holds no held-out part", saved.folder().string()));
  return s;
}

// Every so many rows, so that an hour is drawn as quickly as a minute.
std::size_t every(std::size_t rows) { return 1 + rows / kMostPoints; }

struct Span {
  double low;
  double high;
};

Span span_of(const std::vector<double>& v) {
  const auto [low, high] = std::ranges::minmax(v);
  return {low, high};
}

void both_clocks(Gnuplot& g, const Samples& s) {
  g.begin("alignment", 330);
  const Span u = span_of(s.reading);
  const Span y = span_of(s.measured_deg);
  double covariance = 0;
  for (std::size_t k = s.first_shared(); k < s.size(); ++k)
    covariance += (s.reading[k] - (u.low + u.high) / 2) * (s.measured_deg[k] - (y.low + y.high) / 2);
  // The sensor is stretched onto the angle's range, turned over if it falls where the angle rises.
  const double sign = covariance < 0 ? -1 : 1;
  const double from = sign > 0 ? y.low : y.high;
  const double scale = sign * (y.high - y.low) / (u.high - u.low);
  const std::size_t step = every(s.size() - s.first_shared());
  g.data("both", (s.size() - s.first_shared()) / step, [&](std::size_t i) {
    const std::size_t k = s.first_shared() + i * step;
    return fmt::format("{:.3f} {:.2f} {:.2f}", s.t_s[k], s.measured_deg[k],
                       from + scale * (s.reading[k] - u.low));
  });
  g.add("set xlabel 'time (s)'; set ylabel 'angle (deg)'");
  g.add(
      "plot $both using 1:2 with lines lw 1.6 lc rgb '{}' title 'camera', "
      "$both using 1:3 with lines lw 1.2 lc rgb '{}' title 'sensor, stretched'",
      kMeasured, kEstimated);
}

void offset_scan(Gnuplot& g, const Saved& saved) {
  const Columns scan = saved.columns("alignment_scan.csv");
  const auto& offset_s = scan.at("clock_offset_s");
  const auto& percent = scan.at("explained_percent");
  g.begin("clock_offset", 330);
  g.data("scan", offset_s.size(),
         [&](std::size_t i) { return fmt::format("{:.2f} {:.2f}", offset_s[i], percent[i]); });
  g.add("set xlabel 'clock offset tried (s)'; set ylabel 'angle explained (%)'; set yrange [0:105]");
  const double used_s = saved.results().at("clock_offset_s").get<double>();
  g.add("set arrow from {0},0 to {0},105 nohead lc rgb '{1}' lw 2", used_s, kHeldOut);
  if (offset_s.empty()) g.add("set xrange [{}:{}]", used_s - 1, used_s + 1);
  g.add(
      "plot {}NaN with lines lw 2 lc rgb '{}' title 'offset used'",
      offset_s.empty()
          ? ""
          : fmt::format("$scan using 1:2 with lines lw 1.2 lc rgb '{}' title 'by the sensor', ", kEstimated),
      kHeldOut);
}

// The readings against the angles, measured and estimated, and the static map that a finger held still approaches.
void curve(Gnuplot& g, const Saved& saved, const Samples& s) {
  const Json& r = saved.results();
  g.begin("curve", 400);
  const std::size_t step = every(s.size());
  g.data("points", s.size() / step, [&](std::size_t i) {
    const std::size_t k = i * step;
    return s.gap[k] != 0
               ? std::string("nan nan nan")
               : fmt::format("{:.1f} {:.2f} {:.2f}", s.reading[k], s.measured_deg[k], s.estimated_deg[k]);
  });
  const auto pairs = [&](const char* name, const Json& xy) {
    const auto x = xy.at("reading").get<std::vector<double>>();
    const auto y = xy.at("angle_deg").get<std::vector<double>>();
    g.data(name, x.size(), [&](std::size_t i) { return fmt::format("{:.3f} {:.3f}", x[i], y[i]); });
  };
  pairs("map", r.at("static_map"));
  const auto unit = r.at("sensor").at("unit").get<std::string>();
  g.add("set xlabel {} noenhanced; set ylabel 'angle (deg)'; set key maxrows 2",
        gnuplot_text(unit.empty() ? "sensor reading" : fmt::format("sensor reading ({})", unit)));
  const bool has_knots = !r.at("knots").is_null();
  if (has_knots) pairs("knots", r.at("knots"));
  g.add(
      "plot $points using 1:2 with points pt 7 ps 0.2 lc rgb '#999999' title 'camera', "
      "$points using 1:3 with points pt 7 ps 0.2 lc rgb '{}' title 'compensator', "
      "$map using 1:2 with lines lw 2.5 lc rgb '{}' title 'finger held still'{}",
      kEstimated, kHeldOut,
      has_knots ? ", $knots using 1:2 with points pt 6 ps 0.9 lw 2 lc rgb '#D55E00' title 'knots'" : "");
}

void dynamics(Gnuplot& g, const Saved& saved) {
  const Json& step = saved.results().at("step_response");
  const auto t_s = step.at("t_s").get<std::vector<double>>();
  const auto share = step.at("share").get<std::vector<double>>();
  g.begin("dynamics", 330);
  g.data("step", t_s.size(),
         [&](std::size_t k) { return fmt::format("{:.3f} {:.3f}", t_s[k], 100 * share[k]); });
  g.add("set xlabel 'time after a step of the straightened sensor (s)'");
  g.add("set ylabel 'angle reached (%)'; set yrange [0:*]; set xrange [{}:{}]", -0.02 * t_s.back(),
        t_s.back());
  g.add(
      "plot 100 with lines lc rgb '#999999' dt 2 notitle, "
      "$step using 1:2 with steps lw 2.5 lc rgb '{}' title 'output of the linear part'",
      kEstimated);
}

// Grey bands where a log paused.
void shade_pauses(Gnuplot& g, const Samples& s, std::size_t first) {
  for (std::size_t k = first; k < s.size();) {
    if (s.gap[k] == 0) {
      ++k;
      continue;
    }
    std::size_t end = k;
    while (end < s.size() && s.gap[end] != 0) ++end;
    g.add(
        "set object rectangle from first {:.2f}, graph 0 to first {:.2f}, graph 1 fc rgb '#e8e8e8' fs solid "
        "noborder behind",
        s.t_s[k], s.t_s[std::min(end, s.size() - 1)]);
    k = end;
  }
}

void holdout(Gnuplot& g, const Samples& s) {
  const std::size_t first = s.first_held_out();
  const std::size_t step = every(s.size() - first);
  g.begin("holdout", 520);
  shade_pauses(g, s, first);
  g.data("run", (s.size() - first) / step, [&](std::size_t i) {
    const std::size_t k = first + i * step;
    return fmt::format("{:.3f} {:.2f} {:.2f} {:.2f}", s.t_s[k], s.measured_deg[k], s.estimated_deg[k],
                       s.line_deg[k]);
  });
  g.add("set multiplot layout 2,1; set xlabel 'time (s)'; set ylabel 'angle (deg)'");
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

std::vector<double> errors(const Samples& s, bool held_out) {
  std::vector<double> out;
  for (std::size_t k = 0; k < s.size(); ++k) {
    if (s.gap[k] == 0 && (s.held_out[k] != 0) == held_out)
      out.push_back(s.estimated_deg[k] - s.measured_deg[k]);
  }
  return out;
}

void error_histogram(Gnuplot& g, const std::vector<double>& fitted, const std::vector<double>& held) {
  g.begin("errors", 330);
  double reach = 1;
  for (const double e : held) reach = std::max(reach, std::abs(e));
  const double width = reach / 20;
  const auto histogram = [&](const char* name, const std::vector<double>& of) {
    g.data(name, 41, [&](std::size_t i) {
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

void error_correlation(Gnuplot& g, const std::vector<double>& held, double period_s) {
  g.begin("error_correlation", 330);
  double mean = 0;
  for (const double e : held) mean += e / static_cast<double>(held.size());
  const auto lags = std::min<std::size_t>(static_cast<std::size_t>(5 / period_s), held.size() / 4);
  double variance = 1e-300;
  for (const double e : held) variance += (e - mean) * (e - mean);
  g.data("acf", lags + 1, [&](std::size_t lag) {
    double sum = 0;
    for (std::size_t k = lag; k < held.size(); ++k) sum += (held[k] - mean) * (held[k - lag] - mean);
    return fmt::format("{:.3f} {:.4f}", static_cast<double>(lag) * period_s, sum / variance);
  });
  const double band = 2 / std::sqrt(static_cast<double>(held.size()));
  g.add("set xlabel 'distance in time (s)'; set ylabel 'correlation of errors'; set yrange [-1:1]");
  g.add(
      "plot {} with lines lc rgb '#999999' dt 2 title 'white noise stays inside', "
      "{} with lines lc rgb '#999999' dt 2 notitle, "
      "$acf using 1:2 with lines lw 2 lc rgb '{}' title 'held out'",
      band, -band, kHeldOut);
}

std::vector<Figure> figures() {
  return {{"holdout", "Held-out response and error",
           "Data that the fit never saw. Top: the camera's angle, the compensator's, and a straight line "
           "through the "
           "fitted part. Bottom: what is left of the error. Grey: a log paused there, and the last reading "
           "is held."},
          {"curve", "From sensor reading to angle",
           "Samples outside pauses. Where the compensator's cloud lies on the camera's, it follows the "
           "finger, loops and "
           "all. The line is where its angle would settle if the finger stopped."},
          {"alignment", "Both recordings on one clock",
           "The sensor's readings, stretched onto the angle's range, over the camera's angle."},
          {"clock_offset", "Clock offsets tried",
           "How much of the angle's variation any curve of the sensor explains, for every clock offset; the "
           "highest peak "
           "is the offset, other peaks are other repetitions."},
          {"dynamics", "Dynamics",
           "How the compensator's output follows a sudden change of the sensor. A quick rise means little "
           "delay; what "
           "comes later undoes the sensor's creep."},
          {"errors", "Residual check: size", "How the errors are distributed. Both parts should look alike."},
          {"error_correlation", "Residual check: runs",
           "Whether errors come in runs. Outside the dashed lines something repeatable is left that the "
           "structure cannot "
           "express."}};
}

std::string verdict(const Json& r) {
  const double rmse = r.at("holdout").at("rmse_deg").get<double>();
  const double line = r.at("baseline_linear").at("rmse_deg").get<double>();
  if (line / rmse < 1.05) {
    return "On data it never saw, the compensator is no better than a straight line through the sensor's "
           "readings. "
           "Look at the warnings before using it.";
  }
  return fmt::format(
      "On data it never saw, the compensator is typically {:.1f}° from the camera. A straight line through "
      "the "
      "sensor's readings is {:.1f}° off: {:.1f} times as much.",
      rmse, line, line / rmse);
}

void summary(Page& page, const Json& r) {
  page.paragraph(verdict(r));
  const Json& held = r.at("holdout");
  page.cards({{fmt::format("{:.2f}°", held.at("rmse_deg").get<double>()),
               "typical error of the compensator (RMSE, unseen data)"},
              {fmt::format("{:.2f}°", r.at("baseline_linear").at("rmse_deg").get<double>()),
               "the same with a straight line", true},
              {fmt::format("{:.0f} %", held.at("fit_percent").get<double>()),
               "fit (100 % is perfect, 0 % is guessing the mean)"},
              {fmt::format("{:.1f}°", held.at("p95_abs_deg").get<double>()),
               fmt::format("95 % of the errors are smaller; the largest is {:.1f}°",
                           held.at("max_abs_deg").get<double>())}});
  page.paragraph(fmt::format(
      "The two logs share {:.0f} s of motion. The first {:.0f} % of it taught the compensator; every figure "
      "above is from the rest. One recording of one hand: another motion or another wearer may give "
      "another figure.",
      r.at("shared_s").get<double>(), 100 * r.at("split").get<double>()));
  const auto warnings = r.at("warnings").get<std::vector<std::string>>();
  if (warnings.empty()) {
    page.good("No warnings.");
  } else {
    page.warnings(warnings);
  }
}

std::string alignment_facts(const Json& r) {
  const double offset_s = r.at("clock_offset_s").get<double>();
  const Json& a = r.at("alignment");
  if (a.is_null()) {
    return fmt::format(
        "Camera clock minus sensor clock: {:+.2f} s, given by the user; the signals alone do not tell.",
        offset_s);
  }
  std::string out = fmt::format(
      "Camera clock minus sensor clock: {:+.2f} s{}. Confidence {:.2f} (0: another offset explains the data "
      "as well; "
      "1: none comes near). By quarters of the recording:",
      offset_s, a.at("offset_given").get<bool>() ? " (given by the user)" : "",
      a.at("confidence").get<double>());
  for (const Json& quarter : a.at("quarter_offset_s"))
    out += quarter.is_null() ? " -" : fmt::format(" {:+.2f} s", quarter.get<double>());
  if (!a.at("drift_ppm").is_null())
    out += fmt::format("; drift {:+.0f} ppm", a.at("drift_ppm").get<double>());
  return out + ".";
}

void structures(Page& page, const Json& r) {
  TableBlock t{"All structures side by side",
               {"structure", "parameters", "error, fitted part", "cross-validated", "error, held out",
                "fit, held out"},
               {},
               {}};
  for (const Json& row : r.at("structures")) {
    const auto name = row.at("structure").get<std::string>();
    if (row.at("chosen").get<bool>()) t.marked.push_back(t.rows.size());
    if (row.contains("refusal")) {
      t.rows.push_back(
          {name + ", refused: " + row.at("refusal").get<std::string>(), "-", "-", "-", "-", "-"});
      continue;
    }
    const double cross = number_or_nan(row.value("cross_validated_rmse_deg", Json(nullptr)));
    t.rows.push_back({name, fmt::format("{}", row.at("parameters").get<int>()),
                      fmt::format("{:.2f}°", row.at("fitted_rmse_deg").get<double>()),
                      std::isnan(cross) ? "-" : fmt::format("{:.2f}°", cross),
                      fmt::format("{:.2f}°", row.at("holdout_rmse_deg").get<double>()),
                      fmt::format("{:.1f} %", row.at("holdout_fit_percent").get<double>())});
  }
  page.heading("All structures side by side");
  page.table(t);
  page.paragraph(
      r.at("structure_asked_for") == "auto"
          ? "The marked structure was chosen by cross-validation inside the fitted part. The held-out column "
            "played no part in the choice; the others are for comparison."
          : "The marked structure was asked for. The others are fitted at their usual size, for comparison.");
}

void parameters(Page& page, const Json& fit) {
  page.begin_details("Parameters with standard errors");
  TableBlock t{"Parameters", {"parameter", "value", "standard error"}, {}, {}};
  for (const Json& p : fit.at("parameters")) {
    const double error = number_or_nan(p.at("standard_error"));
    t.rows.push_back({p.at("name").get<std::string>(), fmt::format("{:.5g}", p.at("value").get<double>()),
                      std::isnan(error) ? "not identified" : fmt::format("{:.2g}", error)});
  }
  page.table(t);
  page.paragraph(
      fmt::format("Standard errors allow for correlated and outlying residuals. Condition number: {:.3g}; {} "
                  "samples.",
                  number_or_nan(fit.at("condition")), fit.at("samples").get<std::size_t>()));
  page.end_details();
}

void scores(Page& page, const Json& r) {
  struct Row {
    const char* name;
    const char* key;
    const char* unit;
  };
  constexpr Row kRows[] = {{"RMSE", "rmse_deg", "°"},
                           {"95th percentile of the error", "p95_abs_deg", "°"},
                           {"largest error", "max_abs_deg", "°"},
                           {"fit (NRMSE)", "fit_percent", " %"},
                           {"R²", "r2", ""},
                           {"integral of absolute error", "iae_deg_s", "°s"},
                           {"best constant lag (positive: late)", "best_lag_s", " s"},
                           {"RMSE with that lag removed", "lag_removed_rmse_deg", "°"},
                           {"integral with that lag removed", "lag_removed_iae_deg_s", "°s"}};
  page.begin_details("All scores on the held-out part");
  TableBlock t{
      "Scores on the held-out part", {"score", "compensator", "without pauses", "straight line"}, {}, {}};
  for (const Row& row : kRows) {
    const auto cell = [&](const char* part) {
      const Json& scores = r.at(part);
      const double value = scores.is_object() ? number_or_nan(scores.value(row.key, Json(nullptr))) : NAN;
      return std::isnan(value) ? std::string("-") : fmt::format("{:.3f}{}", value, row.unit);
    };
    t.rows.push_back({row.name, cell("holdout"), cell("holdout_without_gaps"), cell("baseline_linear")});
  }
  page.table(t);
  page.end_details();
}

}  // namespace

void render_identification(const Saved& saved) {
  const Json& r = saved.results();
  const Samples s = samples_of(saved);
  Gnuplot g;
  holdout(g, s);
  curve(g, saved, s);
  both_clocks(g, s);
  offset_scan(g, saved);
  const bool has_step = !r.at("step_response").is_null();
  if (has_step) dynamics(g, saved);
  const std::vector<double> held = errors(s, true);
  error_histogram(g, errors(s, false), held);
  error_correlation(g, held, s.t_s[1] - s.t_s[0]);
  g.run();
  Page page(fmt::format("{} finger: from {} to an angle", saved.text("channel"),
                        r.at("sensor").at("column").get<std::string>()));
  summary(page, r);
  for (const Figure& f : figures()) {
    if (has_step || f.name != std::string("dynamics")) page.figure(f, g, saved.folder());
  }
  page.paragraph(alignment_facts(r));
  structures(page, r);
  parameters(page, r.at("fit"));
  scores(page, r);
  const auto origin = [&](const char* which) {
    const Json& log = r.at(which);
    return fmt::format("{} column {} ({})", log.at("file").get<std::string>(),
                       log.at("column").get<std::string>(), log.at("digest").get<std::string>());
  };
  page.paragraph(fmt::format("Sensor {}, reference {}; {:g} Hz; structure {}; flexor {}.", origin("sensor"),
                             origin("reference"), r.at("rate_hz").get<double>(),
                             saved.text("structure_detail"), saved.text("version")));
  io::write_file(saved.folder() / "report.html", page.html());
}

}  // namespace flexor::report
