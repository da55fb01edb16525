#include <algorithm>
#include <array>
#include <cmath>

#include "host/io/io.hpp"
#include "host/report/colours.hpp"
#include "host/report/jobs.hpp"
#include "host/report/page.hpp"

namespace flexor::report {
namespace {

// "0.64 (0.42 to 0.94)"; median, 5 and 95 % quantile.
std::string with_quantiles(const Json& interval, int decimals) {
  if (interval.is_null()) return "-";
  return fmt::format("{:.{}f} ({:.{}f} to {:.{}f})", interval.at("median").get<double>(), decimals,
                     interval.at("low").get<double>(), decimals, interval.at("high").get<double>(), decimals);
}

std::vector<std::string> compensators_of(const Json& r) {
  std::vector<std::string> out;
  for (const Json& h : r.at("headlines")) out.push_back(h.at("compensator").get<std::string>());
  return out;
}

const Json* ratio_to_hw(const Json& headline) {
  const Json& ratios = headline.at("mean_ratio_to");
  return ratios.contains("published-hw") ? &ratios.at("published-hw") : nullptr;
}

bool has_ratios(const Json& r) {
  return std::ranges::any_of(r.at("headlines"), [](const Json& h) { return ratio_to_hw(h) != nullptr; });
}

Chart ratio_chart(const Json& r) {
  Chart chart{
      {"ratios", "Compensators in all laboratories",
       "Dots: the median. Lines: from 5 to 95 % of the laboratories. Below the dashed line is better than "
       "the published Hammerstein-Wiener compensator."},
      "",
      {{"error relative to published HW", {}}}};
  chart.panels[0].is_logarithmic = true;
  chart.panel_px = 300;
  const std::vector<std::string> names = compensators_of(r);
  const std::vector<std::string> colour = colours_of(names);
  for (std::size_t c = 0; c < names.size(); ++c) {
    const Json* ratio = ratio_to_hw(r.at("headlines")[c]);
    if (ratio == nullptr) continue;
    const std::vector<double> at = {static_cast<double>(chart.x_names.size())};
    const auto of = [&](const char* key) { return std::vector<double>{ratio->at(key).get<double>()}; };
    chart.x_names.push_back(names[c]);
    chart.panels[0].series.push_back(intervals(colour[c], at, of("low"), of("high")));
    chart.panels[0].series.push_back({"", colour[c], at, of("median"), Style::points, 6});
  }
  const auto last = static_cast<double>(chart.x_names.size()) - 0.5;
  chart.panels[0].series.push_back({"", "#999999", {-0.5, last}, {1, 1}, Style::line, 1.5, true});
  return chart;
}

// What every compensator is compared with, where the run has it.
constexpr std::array kBaselines = {"published-hw", "line", "line-lead", "published-hw-refitted"};

std::string ratio_and_share(const Json& headline, const char* baseline) {
  if (!headline.at("mean_ratio_to").contains(baseline)) return "-";
  return fmt::format("{}; better in {:.0f} %", with_quantiles(headline.at("mean_ratio_to").at(baseline), 2),
                     100 * headline.at("share_of_laboratories_below").at(baseline).get<double>());
}

void ratio_table(Page& page, const Json& r) {
  TableBlock t{"Ratio of errors, geometric mean over the gestures: median (5 to 95 % of laboratories)",
               {"compensator"},
               {},
               {}};
  for (const char* baseline : kBaselines) t.columns.push_back(fmt::format("to {}", baseline));
  for (const Json& h : r.at("headlines")) {
    std::vector<std::string> row = {h.at("compensator").get<std::string>()};
    for (const char* baseline : kBaselines) row.push_back(ratio_and_share(h, baseline));
    t.rows.push_back(std::move(row));
  }
  page.table(t);
}

void changed_laboratories(Page& page, const Json& r) {
  if (r.at("scenarios").empty()) return;
  TableBlock t{
      "The same laboratories, changed after calibration: ratio of errors, median (5 to 95 %)",
      {"what changed", "identified to published-hw", "line-lead to published-hw", "identified to line-lead"},
      {},
      {}};
  const auto ratio = [](const Json& scenario, const char* compensator, const char* to) {
    for (const Json& h : scenario.at("headlines")) {
      const Json& ratios = h.at("mean_ratio_to");
      if (h.at("compensator") == compensator && ratios.contains(to)) return with_quantiles(ratios.at(to), 2);
    }
    return std::string("-");
  };
  for (const Json& s : r.at("scenarios")) {
    t.rows.push_back({s.at("name").get<std::string>(), ratio(s, "identified", "published-hw"),
                      ratio(s, "line-lead", "published-hw"), ratio(s, "identified", "line-lead")});
  }
  page.table(t);
}

// The distance from the published table beside that of the null model.
void distances_of_laboratories(Page& page, const Json& r) {
  const auto say = [&](const char* part, const char* constants, const char* what) {
    page.paragraph(fmt::format(
        "Distance from the published table on gestures {}: {} (root mean square of ln(ours/published); one "
        "constant for each compensator: {:.2f}).",
        what, with_quantiles(r.at("log_rms").at(part), 2), r.at("null_model").at(constants).get<double>()));
  };
  say("gestures_1_to_4", "log_rms_gestures_1_to_4", "1 to 4");
  say("gestures_5_and_6", "log_rms_gestures_5_and_6", "5 and 6, which the draw did not use");
}

void cell_table(Page& page, const Json& r) {
  TableBlock t{"Total error in degree-seconds, median (5 to 95 % of laboratories)",
               {"gesture, compensator", "error", "published", "relative to published HW"},
               {},
               {}};
  for (const Json& cell : r.at("cells")) {
    const Json& gesture = cell.at("gesture");
    const double published = number_or_nan(cell.at("published_deg_s"));
    t.rows.push_back({fmt::format("{}, {}", gesture.is_string() ? gesture.get<std::string>() : gesture.dump(),
                                  cell.at("compensator").get<std::string>()),
                      with_quantiles(cell.at("total_error_deg_s"), 0),
                      std::isnan(published) ? "-" : fmt::format("{:.0f}", published),
                      with_quantiles(cell.value("ratio_to_published_hw", Json(nullptr)), 2)});
  }
  page.heading("Gesture by gesture");
  page.table(t);
}

void laboratory_shapes(Page& page, const Json& shapes) {
  TableBlock t{
      "What the article says of the curves", {"gesture, what", "here", "laboratories that agree"}, {}, {}};
  for (const Json& s : shapes) {
    t.rows.push_back({fmt::format("{}, {}", s.at("gesture").get<int>(), s.at("what").get<std::string>()),
                      with_quantiles(s.at("value_deg"), 1) + "°",
                      fmt::format("{:.0f} %", 100 * s.at("share_of_laboratories_that_agree").get<double>())});
  }
  if (!t.rows.empty()) page.table(t);
}

}  // namespace

void render_ensemble(const Saved& saved) {
  const Json& r = saved.results();
  Page page("Glove to bionic hand, in the laboratories that the article leaves plausible");
  page.paragraph(fmt::format(
      "{} laboratories, drawn by how well they agree with the published averages of gestures 1 to 4. In "
      "each, the glove is worn and recorded once, compensators are fitted to that recording, and the "
      "gestures are played.",
      r.at("laboratories").get<std::size_t>()));
  if (const auto doubt = r.at("ensemble").at("doubt").get<std::string>(); !doubt.empty())
    page.warnings({doubt});
  ratio_table(page, r);
  if (has_ratios(r)) page.chart(ratio_chart(r));  // the published compensator took part
  changed_laboratories(page, r);
  cell_table(page, r);
  page.heading("Shapes");
  laboratory_shapes(page, r.at("shapes"));
  distances_of_laboratories(page, r);
  const Json& chains = r.at("ensemble");
  page.paragraph(
      fmt::format("{} Markov chains, largest R-hat {:.3f}, smallest effective sample {:.0f}, seed {}.",
                  chains.at("chains").get<int>(), chains.at("worst_r_hat").get<double>(),
                  chains.at("least_effective").get<double>(), chains.at("seed").get<std::uint64_t>()));
  page.write(saved);
}

}  // namespace flexor::report
