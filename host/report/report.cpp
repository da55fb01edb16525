#include "host/report/report.hpp"

#include <fmt/format.h>

#include "host/io/io.hpp"
#include "host/recording/csv.hpp"
#include "host/report/html.hpp"

namespace flexor::report {
namespace {

std::string verdict(const Identification& r) {
  const double ratio = r.baseline.rmse_deg / r.holdout.rmse_deg;
  if (ratio < 1.05) {
    return "On data it never saw, the compensator is no better than a straight line through the sensor's "
           "readings. "
           "Look at the warnings before using it.";
  }
  return fmt::format(
      "On data it never saw, the compensator is typically {:.1f}&deg; from the camera. A straight line "
      "through the sensor's readings is {:.1f}&deg; off: {:.1f} times as much.",
      r.holdout.rmse_deg, r.baseline.rmse_deg, ratio);
}

void summary(Page& page, const Identification& r) {
  page.add("<h1>{} finger: from <code>{}</code> to an angle</h1>", escape(r.model.channels.front().name),
           escape(r.pair.input));
  page.add("<p>{}</p>", verdict(r));
  page.add("<div class=cards>");
  page.add("<div class=card><b>{:.2f}&deg;</b>typical error of the compensator (RMSE, unseen data)</div>",
           r.holdout.rmse_deg);
  page.add("<div class='card plain'><b>{:.2f}&deg;</b>the same with a straight line</div>",
           r.baseline.rmse_deg);
  page.add("<div class=card><b>{:.0f} %</b>fit (100 % is perfect, 0 % is guessing the mean)</div>",
           r.holdout.fit_percent);
  page.add(
      "<div class=card><b>{:.1f}&deg;</b>95 % of the errors are smaller; the largest is {:.1f}&deg;</div>",
      r.holdout.p95_abs_deg, r.holdout.max_abs_deg);
  page.add("</div>");
  const double seconds = r.aligned.t_s.back() - r.aligned.t_s[r.aligned.overlap_begin];
  page.add(
      "<p>The two logs share {:.0f} s of motion. The first {:.0f} % of it taught the compensator; every "
      "figure "
      "above is from the rest. One recording of one hand: another motion or another wearer may give another "
      "figure.</p>",
      seconds, 100 * r.request.split);
}

void warnings(Page& page, const Identification& r) {
  if (r.warnings.empty()) {
    page.add("<p class=good>No warnings.</p>");
    return;
  }
  page.add("<div class=warnings><b>Worth knowing</b><ul>");
  for (const std::string& w : r.warnings) page.add("<li>{}</li>", escape(w));
  page.add("</ul></div>");
}

void figure(Page& page, const Figure& f) {
  page.add("<h2>{}</h2><figure>{}<figcaption>{}</figcaption></figure>", f.title, f.svg, f.caption);
}

void alignment_facts(Page& page, const Identification& r) {
  if (!r.aligned.alignment) {
    page.add(
        "<p>Camera clock minus sensor clock: <b>{:+.2f} s</b>, given by the user; the signals alone do not "
        "tell.</p>",
        r.aligned.clock_offset_s);
    return;
  }
  const recording::Alignment& a = *r.aligned.alignment;
  page.add(
      "<p>Camera clock minus sensor clock: <b>{:+.2f} s</b>{}. Confidence {:.2f} (0: another offset explains "
      "the "
      "data as well; 1: none comes near). ",
      r.aligned.clock_offset_s, r.request.clock_offset_s ? " (given by the user)" : "", a.confidence);
  page.add("By quarters of the recording: ");
  for (const auto& quarter : a.quarter_offset_s)
    page.add("{} ", quarter ? fmt::format("{:+.2f} s", *quarter) : "-");
  if (a.drift_ppm) page.add("(drift {:+.0f} ppm)", *a.drift_ppm);
  page.add("</p>");
}

void structures(Page& page, const Identification& r) {
  page.add(
      "<h2>All structures side by side</h2><div class=scroll><table><tr><th>structure<th>parameters"
      "<th>error, fitted part<th>cross-validated<th>error, held out<th>fit, held out</tr>");
  for (const identify::TableRow& row : r.rows) {
    if (!row.refusal.empty()) {
      page.add("<tr><td>{}<td colspan=5 style='text-align:left'>refused: {}</tr>", row.name,
               escape(row.refusal));
      continue;
    }
    page.add("<tr{}><td>{}<td>{}<td>{:.2f}&deg;<td>{}<td>{:.2f}&deg;<td>{:.1f} %</tr>",
             row.chosen ? " class=chosen" : "", row.name, row.parameters, row.fitted_rmse_deg,
             row.cross_validated_deg ? fmt::format("{:.2f}&deg;", *row.cross_validated_deg) : "-",
             row.holdout.rmse_deg, row.holdout.fit_percent);
  }
  page.add("</table></div>");
  if (r.request.structure == "auto") {
    page.add(
        "<p>The marked structure was chosen by cross-validation inside the fitted part: the fewest "
        "parameters "
        "within 2 % of the best. The held-out column played no part in the choice.</p>");
  } else {
    page.add(
        "<p>The marked structure was asked for. The others are fitted at their usual size, for "
        "comparison.</p>");
  }
}

void parameters(Page& page, const Identification& r) {
  page.add(
      "<details><summary>Parameters with standard errors</summary><div class=scroll><table>"
      "<tr><th>parameter<th>value<th>standard error</tr>");
  for (const identify::Parameter& p : r.fit.parameters) {
    page.add("<tr><td>{}<td>{:.5g}<td>{}</tr>", escape(p.name), p.value,
             p.refused ? std::string("not identified") : fmt::format("{:.2g}", p.standard_error));
  }
  page.add(
      "</table></div><p>Standard errors allow for correlated and outlying residuals. Condition number of the "
      "scaled Jacobian: {:.3g}; {} samples, {} iterations from {} starts.</p></details>",
      r.fit.condition, r.fit.used_samples, r.fit.iterations, r.fit.starts);
}

void metrics(Page& page, const Identification& r) {
  page.add(
      "<details><summary>All scores on the held-out part</summary><div class=scroll><table><tr><th>score"
      "<th>compensator<th>without pauses<th>straight line</tr>");
  const auto row = [&](const char* name, double score::Score::*field, const char* unit) {
    const std::string without =
        r.holdout_without_gaps ? fmt::format("{:.3f}", *r.holdout_without_gaps.*field) : "-";
    page.add("<tr><td>{}<td>{:.3f} {u}<td>{} {u}<td>{:.3f} {u}</tr>", name, r.holdout.*field, without,
             r.baseline.*field, fmt::arg("u", unit));
  };
  row("RMSE", &score::Score::rmse_deg, "&deg;");
  row("95th percentile of the error", &score::Score::p95_abs_deg, "&deg;");
  row("largest error", &score::Score::max_abs_deg, "&deg;");
  row("fit (NRMSE)", &score::Score::fit_percent, "%");
  row("R&sup2;", &score::Score::r2, "");
  row("integral of absolute error", &score::Score::iae_deg_s, "&deg;s");
  row("best constant lag (positive: late)", &score::Score::best_lag_s, "s");
  row("RMSE with that lag removed", &score::Score::lag_removed_rmse_deg, "&deg;");
  row("integral with that lag removed", &score::Score::lag_removed_iae_deg_s, "&deg;s");
  page.add("</table></div></details>");
}

}  // namespace

std::string report_html(const Identification& r, const std::vector<Figure>& figures) {
  Page page;
  page.add(
      "<!doctype html><html lang=en><head><meta charset=utf-8><meta name=viewport "
      "content='width=device-width, initial-scale=1'><title>Flexor: {}</title><style>{}</style></head><body>",
      escape(r.pair.input), kStyle);
  summary(page, r);
  warnings(page, r);
  for (const Figure& f : figures) {
    figure(page, f);
    if (f.name == "alignment") alignment_facts(page, r);
  }
  structures(page, r);
  parameters(page, r);
  metrics(page, r);
  page.add(
      "<p>Sensor <code>{}</code> ({}), reference <code>{}</code> column <code>{}</code> ({}); {:g} Hz; "
      "structure "
      "{}; flexor {}.</p></body></html>",
      escape(std::filesystem::path(r.pair.sensor.source).filename().string()), r.pair.sensor.digest,
      escape(std::filesystem::path(r.pair.reference.source).filename().string()), escape(r.pair.output),
      r.pair.reference.digest, r.request.rate_hz, identify::describe(r.fit.structure), FLEXOR_VERSION);
  return page.text();
}

recording::Recording holdout(const Identification& r) {
  recording::Recording out;
  out.columns = {{"measured_deg", {}}, {"estimated_deg", {}}, {"straight_line_deg", {}}, {"gap", {}}};
  for (std::size_t k = r.holdout_begin; k < r.aligned.size(); ++k) {
    out.t_s.push_back(r.aligned.t_s[k]);
    out.columns[0].value.push_back(r.aligned.angle_deg[k]);
    out.columns[1].value.push_back(r.estimated_deg[k]);
    out.columns[2].value.push_back(r.baseline_deg[k]);
    out.columns[3].value.push_back(r.aligned.gap[k]);
  }
  return out;
}

void write_report(const Identification& r, const std::filesystem::path& folder) {
  const std::vector<Figure> figures = draw(r);
  io::make_folder(folder);
  for (const Figure& f : figures) io::write_file(folder / (f.name + ".svg"), f.svg);
  io::write_file(folder / "holdout.csv", recording::to_csv(holdout(r)));
  io::write_file(folder / "report.html", report_html(r, figures));
}

}  // namespace flexor::report
