#include "host/report/trial_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/report/html.hpp"

namespace flexor::report {
namespace {

using Json = nlohmann::ordered_json;

std::string motion_title(const Cell& cell) {
  return cell.gesture > 0 ? fmt::format("{} {}", cell.gesture, cell.motion) : cell.motion;
}

std::string figure_of(double value) {
  return value < 99.95 ? fmt::format("{:.1f}", value) : fmt::format("{:.0f}", value);
}

std::string with_interval(const Statistic& s) {
  return s.count() > 1 ? fmt::format("{}&nbsp;&plusmn;&nbsp;{}", figure_of(s.mean()), figure_of(*s.ci95()))
                       : figure_of(s.mean());
}

std::optional<std::size_t> index_of(const Result& r, const char* name) {
  const auto it = std::ranges::find(r.compensators, name);
  if (it == r.compensators.end()) return std::nullopt;
  return static_cast<std::size_t>(it - r.compensators.begin());
}

void verdict(Page& page, const Result& r) {
  const auto raw = index_of(r, "raw");
  const std::size_t last = r.compensators.size() - 1;
  if (raw && last != *raw) {
    double sum = 0;
    for (std::size_t m = 0; m < r.motions.size(); ++m) {
      sum += std::log(r.cell(m, *raw).total_deg_s.mean() / r.cell(m, last).total_deg_s.mean());
    }
    page.add(
        "<p>With <b>{}</b> the hand is {:.1f} times closer to the finger than with the raw sensor (geometric "
        "mean over "
        "{} motion(s); the error of every lag counts).</p>",
        escape(r.compensators[last]), std::exp(sum / static_cast<double>(r.motions.size())),
        r.motions.size());
  }
  if (r.distance.all) page.add("<div class=cards>");
  if (r.distance.fitted) {
    page.add(
        "<div class=card><b>{:.2f}</b>distance from the published table on {}, whose averages are among "
        "those "
        "that the twin is fitted to (root mean square of ln(ours/published); 0.35 is a factor of 1.4)</div>",
        r.distance.fitted->log_rms, escape(describe(*r.distance.fitted)));
  }
  if (r.distance.predicted) {
    page.add(
        "<div class='card plain'><b>{:.2f}</b>distance from the published table on {}, which the fit never "
        "saw</div>",
        r.distance.predicted->log_rms, escape(describe(*r.distance.predicted)));
  }
  if (r.distance.all) page.add("</div>");
}

void error_table(Page& page, const Result& r) {
  const auto raw = index_of(r, "raw");
  const auto wiener = index_of(r, "published-w");
  page.add(
      "<h2>Total error E<sub>T</sub>, degree-seconds</h2><div "
      "class=scroll><table><tr><th>motion<th>compensator"
      "<th>causal<th>published<th>ratio to published<th>ratio to raw<th>ratio to W<th>lag "
      "removed<th>lag</tr>");
  for (std::size_t m = 0; m < r.motions.size(); ++m) {
    for (std::size_t c = 0; c < r.compensators.size(); ++c) {
      const Cell& cell = r.cell(m, c);
      const auto ratio = [&](const std::optional<std::size_t>& to) {
        return to ? fmt::format("{:.3f}", cell.total_deg_s.mean() / r.cell(m, *to).total_deg_s.mean())
                  : std::string("-");
      };
      page.add(
          "<tr><td>{}<td style='text-align:left'>{}<td><b>{}</b><td>{}<td>{}<td>{}<td>{}<td>{}<td>{:.0f} "
          "ms</tr>",
          c == 0 ? escape(motion_title(cell)) : "", escape(cell.compensator), with_interval(cell.total_deg_s),
          cell.published_deg_s ? figure_of(*cell.published_deg_s) : "-",
          cell.published_deg_s ? fmt::format("{:.2f}", cell.total_deg_s.mean() / *cell.published_deg_s) : "-",
          ratio(raw), ratio(wiener), with_interval(cell.lag_removed_deg_s), 1000 * cell.lag_s.mean());
    }
  }
  page.add(
      "</table></div><p>Mean and 95 % interval over {} trial(s). Causal: every lag counts, the hand's and "
      "the radio's too. "
      "Lag removed: after the one lag of each trial that makes it smallest; never to be compared with a "
      "causal figure.</p>",
      r.cells.front().total_deg_s.count());
}

constexpr const char* kStops =
    "Fastest hit: the greatest speed with which any joint arrived at one of its end stops in any trial. "
    "Pressed: how long motors then pressed against a stop with a tenth of their supply or more, mean of a "
    "trial, "
    "five fingers together.";

void finger_table(Page& page, const Result& r) {
  page.add(
      "<details><summary>Error of each finger, E<sub>i</sub>, degree-seconds</summary><div "
      "class=scroll><table><tr><th>motion"
      "<th>compensator");
  for (const std::string& finger : model::finger_names()) page.add("<th>{}", finger);
  page.add("<th>fastest hit<th>pressed<th>frames lost</tr>");
  for (const Cell& cell : r.cells) {
    page.add("<tr><td>{}<td style='text-align:left'>{}", escape(motion_title(cell)),
             escape(cell.compensator));
    for (const Statistic& finger : cell.finger_deg_s) page.add("<td>{}", with_interval(finger));
    page.add("<td>{:.0f}&deg;/s<td>{:.2f} s<td>{:.1f} %</tr>", cell.fastest_impact_deg_s(),
             cell.total_pressed_s(),
             100.0 * static_cast<double>(cell.frames_lost) /
                 static_cast<double>(std::max<std::int64_t>(cell.frames_sent, 1)));
  }
  page.add("</table></div><p>{}</p></details>", kStops);
}

// Mean over motions of the total error.
double overall(const Result& r, std::size_t compensator) {
  double sum = 0;
  for (std::size_t m = 0; m < r.motions.size(); ++m) sum += r.cell(m, compensator).total_deg_s.mean();
  return sum / static_cast<double>(r.motions.size());
}

void scenario_table(Page& page, const std::vector<ScenarioResult>& scenarios) {
  if (scenarios.empty()) return;
  const Result& base = scenarios.front().result;
  page.add("<h2>When things go wrong</h2><div class=scroll><table><tr><th>scenario");
  for (const std::string& c : base.compensators) page.add("<th>{}", escape(c));
  page.add("<th>fastest hit of a stop<th>pressed</tr>");
  for (const ScenarioResult& s : scenarios) {
    page.add("<tr><td>{}", escape(s.scenario.name));
    for (std::size_t c = 0; c < base.compensators.size(); ++c) {
      page.add("<td>{} <small>(&times;{:.2f})</small>", figure_of(overall(s.result, c)),
               overall(s.result, c) / overall(base, c));
    }
    const Stops stops = stops_of(s.result);
    page.add("<td>{:.0f}&deg;/s<td>{:.2f} s</tr>", stops.impact_deg_s, stops.pressed_s);
  }
  page.add(
      "</table></div><p>Causal error in degree-seconds, mean over the motions, and its ratio to the same "
      "compensator's as "
      "calibrated. {} The worst compensator's.</p>",
      kStops);
}

void figures_of(Page& page, const std::vector<TrialFigure>& figures) {
  for (const TrialFigure& f : figures) {
    const bool pair = f.name.starts_with("response") || f.name.starts_with("error_");
    if (f.name.starts_with("response")) page.add("<div class=pair>");
    page.add("<figure{}><h2>{}</h2>{}<figcaption>{}</figcaption></figure>", pair ? " class=half" : "",
             escape(f.title), f.svg, f.caption);
    if (f.name.starts_with("error_")) page.add("</div>");
  }
}

constexpr const char* kMoreStyle = R"(
.pair { display: flex; flex-wrap: wrap; gap: 1rem; } .half { flex: 1 1 22rem; min-width: 0; }
figure h2 { font-size: 1.05rem; margin: .5rem 0; }
)";

std::string html(const Plan& plan, const Result& r, const std::vector<ScenarioResult>& scenarios,
                 const std::vector<TrialFigure>& figures) {
  Page page;
  page.add(
      "<!doctype html><html lang=en><head><meta charset=utf-8><meta name=viewport "
      "content='width=device-width, initial-scale=1'><title>Flexor: "
      "experiment</title><style>{}{}</style></head><body>",
      kStyle, kMoreStyle);
  const bool boards = plan.engine != nullptr;
  page.add("<h1>Glove to bionic hand, {}</h1>", boards ? "on simulated boards in the twin" : "in the twin");
  verdict(page, r);
  error_table(page, r);
  scenario_table(page, scenarios);
  finger_table(page, r);
  figures_of(page, figures);
  page.add(
      "<p>A simulation: person, glove, radio, hand and cameras follow the configuration in results.json. "
      "{:g} Hz, seed {}, "
      "flexor {}. Every figure is beside this page as SVG and PDF; every trial is a row of "
      "trials.csv.</p></body></html>",
      1 / plan.compensators.front().model.sample_period_s, plan.seed, FLEXOR_VERSION);
  return page.text();
}

}  // namespace

Stops stops_of(const Result& r) {
  Stops out;
  for (std::size_t c = 0; c < r.compensators.size(); ++c) {
    double pressed_s = 0;
    for (std::size_t m = 0; m < r.motions.size(); ++m) {
      const Cell& cell = r.cell(m, c);
      out.impact_deg_s = std::max(out.impact_deg_s, cell.fastest_impact_deg_s());
      pressed_s += cell.total_pressed_s() / static_cast<double>(r.motions.size());
    }
    out.pressed_s = std::max(out.pressed_s, pressed_s);
  }
  return out;
}

void write_trial_report(const Plan& plan, const Result& result, const std::vector<ScenarioResult>& scenarios,
                        const std::filesystem::path& folder) {
  Json json = to_json(result, plan);
  Json worse = Json::array();
  for (const ScenarioResult& s : scenarios) {
    worse.push_back(
        {{"name", s.scenario.name}, {"set", s.scenario.set}, {"cells", to_json(s.result, plan).at("cells")}});
  }
  json["scenarios"] = std::move(worse);
  json["twin"] = Json::parse(twin::to_json(plan.parameters));
  io::make_folder(folder);
  io::write_file(folder / "results.json", io::dump(json));
  const std::vector<TrialFigure> figures = draw(plan, result);
  for (const TrialFigure& f : figures) {
    io::write_file(folder / (f.name + ".svg"), f.svg);
    io::write_file(folder / (f.name + ".pdf"), f.pdf);
  }
  io::write_file(folder / "report.html", html(plan, result, scenarios, figures));
}

}  // namespace flexor::report
