#include "host/report/jobs.hpp"

#include <algorithm>
#include <cmath>

#include "host/io/io.hpp"
#include "host/report/page.hpp"
#include "host/report/sample_figures.hpp"
#include "host/report/scores_table.hpp"

namespace flexor::report {
namespace {

struct Span {
  double low;
  double high;
};

Span span_of(const std::vector<double>& v) {
  const auto [low, high] = std::ranges::minmax(v);
  return {low, high};
}

void both_clocks(Gnuplot& g, const Samples& s) {
  const auto first_shared =
      static_cast<std::size_t>(std::ranges::find_if(s.t_s, [](double t) { return t >= 0; }) - s.t_s.begin());
  g.begin("alignment", 330);
  const Span u = span_of(s.reading);
  const Span y = span_of(s.measured_deg);
  double covariance = 0;
  for (std::size_t k = first_shared; k < s.size(); ++k)
    covariance += (s.reading[k] - (u.low + u.high) / 2) * (s.measured_deg[k] - (y.low + y.high) / 2);
  // The sensor is stretched onto the angle's range, turned over if it falls where the angle rises.
  const double sign = covariance < 0 ? -1 : 1;
  const double from = sign > 0 ? y.low : y.high;
  const double scale = sign * (y.high - y.low) / (u.high - u.low);
  const std::size_t step = every(s.size() - first_shared);
  g.data("both", (s.size() - first_shared) / step, [&](std::size_t i) {
    const std::size_t k = first_shared + i * step;
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

std::vector<Figure> figures(bool residuals) {
  std::vector<Figure> out = {
      holdout_figure("holdout"),
      curve_figure("curve"),
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
  };
  if (residuals) {
    out.push_back(error_histogram_figure("errors"));
    out.push_back(error_correlation_figure("error_correlation"));
  }
  return out;
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

}  // namespace

void render_identification(const Saved& saved) {
  const Json& r = saved.results();
  const Samples s = read_samples(saved, "samples.csv");
  Gnuplot g;
  draw_holdout(g, "holdout", s);
  draw_curve(g, "curve", s,
             {r.at("static_map"), r.at("knots"), r.at("sensor").at("unit").get<std::string>()});
  both_clocks(g, s);
  offset_scan(g, saved);
  const bool has_step = !r.at("step_response").is_null();
  if (has_step) dynamics(g, saved);
  const std::vector<double> held = errors(s, true);
  if (!held.empty()) {  // some of it lies outside pauses
    draw_error_histogram(g, "errors", errors(s, false), held);
    draw_error_correlation(g, "error_correlation", held, s.t_s[1] - s.t_s[0]);
  }
  g.run();
  Page page(fmt::format("{} finger: from {} to an angle", saved.text("channel"),
                        r.at("sensor").at("column").get<std::string>()));
  summary(page, r);
  for (const Figure& f : figures(!held.empty())) {
    if (has_step || f.name != std::string("dynamics")) page.figure(f, g, saved.folder());
  }
  page.paragraph(alignment_facts(r));
  structures(page, r);
  parameters(page, r.at("fit"));
  page.begin_details("All scores on the held-out part");
  page.table(scores_table({{"compensator", r.at("holdout")},
                           {"without pauses", r.at("holdout_without_gaps")},
                           {"straight line", r.at("baseline_linear")}}));
  page.end_details();
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
