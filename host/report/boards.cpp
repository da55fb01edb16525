#include <algorithm>
#include <array>
#include <cmath>

#include "host/io/io.hpp"
#include "host/report/kinds.hpp"
#include "host/report/wiring.hpp"

namespace flexor::report {
namespace {

constexpr std::array<const char*, 6> kColours = {"#999999", "#56B4E9", "#F0E442",
                                                 "#0072B2", "#D55E00", "#009E73"};

// A bar for each row of parts, to scale, over an axis in milliseconds.
struct Stretch {
  double from_ms;
  double to_ms;
  std::string colour;
};

std::string bars_svg(const Figure& figure,
                     const std::vector<std::pair<std::string, std::vector<Stretch>>>& rows) {
  constexpr double kLeft = 160, kWidth = 340, kRow = 48;
  double end_ms = 0;
  for (const auto& row : rows)
    for (const Stretch& part : row.second) end_ms = std::max(end_ms, part.to_ms);
  double step_ms = std::pow(10, std::floor(std::log10(end_ms)));
  if (!(step_ms > 0) || !std::isfinite(step_ms)) throw std::domain_error("no time has passed");
  if (end_ms / step_ms <= 4) step_ms /= 2;
  Drawing d;
  const auto x = [&](double ms) { return kLeft + kWidth * ms / end_ms; };
  const double foot = 10 + kRow * static_cast<double>(rows.size());
  for (int i = 0; i * step_ms <= end_ms * 1.001; ++i) {
    d.line({{x(i * step_ms), 6}, {x(i * step_ms), foot}}, "#cccccc", 1);
    d.text(x(i * step_ms), foot + 18, fmt::format("{:g}", i * step_ms));
  }
  d.text(kLeft + kWidth / 2, foot + 38, "time (ms)");
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const double top = 12 + kRow * static_cast<double>(r);
    d.text(kLeft - 10, top + 20, rows[r].first, "end");
    for (const auto& [from_ms, to_ms, colour] : rows[r].second)
      d.area({{x(from_ms), top}, {x(to_ms), top}, {x(to_ms), top + 30}, {x(from_ms), top + 30}}, colour);
  }
  return d.svg(figure, 520, static_cast<int>(foot) + 50);
}

std::string budget_svg(const Figure& figure, const Json& t) {
  const auto ms = [&](const char* part) { return t.at(part).get<double>(); };
  return bars_svg(figure,
                  {{"sample",
                    {{0, ms("sample_period"), kShade},
                     {0, ms("adc"), kColours[1]},
                     {ms("adc"), ms("adc") + ms("compute_worst"), kColours[4]}}},
                   {"frame", {{0, ms("frame_period"), kShade}, {0, ms("frame_on_wire"), kColours[3]}}}});
}

std::string latency_svg(const Figure& figure, const Json& stages) {
  std::vector<std::pair<std::string, std::vector<Stretch>>> rows;
  double from_ms = 0;
  for (const Json& stage : stages) {
    const double mean_ms = stage.at("mean_ms").get<double>();
    rows.push_back(
        {stage.at("name").get<std::string>(), {{from_ms, from_ms + mean_ms, kColours.at(rows.size())}}});
    from_ms += mean_ms;
  }
  return bars_svg(figure, rows);
}

// Words, no figures.
TableBlock words_of(const std::string& caption, const Json& rows) {
  TableBlock out = table_of(caption, rows, {{"", "/name"}, {"", "/value"}});
  out.columns.clear();
  out.is_text = true;
  return out;
}

// What the user does with it.
void add_lead(Page& page, const Json& r) {
  page.table(words_of("What it does", r.at("lead")));
  page.heading("What to do next");
  page.steps(r.at("next").get<std::vector<std::string>>());
}

void add_wiring(Page& page, const Json& wiring) {
  page.paragraph("Or copy what is in arduino/ to the Arduino IDE's libraries and open the example.");
  page.heading("Wiring");
  for (const Json& board : wiring.at("boards")) {
    const auto name = board.at("name").get<std::string>();
    const Figure figure{"wiring_" + name, "Wiring of the " + name,
                        "Blue wires carry what the board reads or sends.", true};
    page.drawing(figure, wiring_svg(board, wiring.at("divider_kohm").get<double>()));
  }
  page.table(table_of("Parts", wiring.at("parts"), {{"what", "/what"}, {"count", "/count"}}));
}

// What it costs.
void add_costs(Page& page, const Json& r) {
  page.heading("What it costs");
  page.paragraph(r.at("budget_sentence").get<std::string>());
  const Json& target = r.at("targets").at(0);
  if (r.at("bit_exact").is_null()) return page.table(words_of("What is known", r.at("table")));
  constexpr double kCyclesPerMs = 16000;
  const double cycles = target.at("step_cycles").at("mean").get<double>();
  page.cards(
      {{fmt::format("{:.0f}", cycles),
        fmt::format("cycles for five channels, {:.2f} % of a sample period",
                    cycles / kCyclesPerMs / r.at("time_budget_ms").at("sample_period").get<double>() * 100)},
       {fmt::format("{:.3f}°", target.at("worst_error_deg").get<double>()),
        "worst error of the integers against double"},
       {fmt::format("{}", r.at("bit_exact").at("mismatches").get<std::size_t>()),
        fmt::format("differences from the host in {} angles",
                    r.at("bit_exact").at("angles").get<std::size_t>())}});
  page.table(words_of("What was measured", r.at("table")));
}

}  // namespace

void summarize_deployment(Page& page, const Json& r) {
  add_lead(page, r);
  add_costs(page, r);
}

void render_deployment(const Saved& saved) {
  const Json& r = saved.results();
  save_wiring(r.at("wiring"), saved.folder());
  Page page("Firmware of " + saved.text("model_name"));
  const bool is_measured = !r.at("bit_exact").is_null();
  page.paragraph(fmt::format(
      "For {} at 16 MHz.{}", r.at("chips").get<std::string>(),
      is_measured ? fmt::format(" Every figure was measured on the very {} in this folder, run instruction "
                                "by instruction.",
                                r.at("boards").get<int>() == 2 ? "images" : "image")
                  : ""));
  add_lead(page, r);
  add_wiring(page, r.at("wiring"));
  add_costs(page, r);
  const Figure figure{"time_budget", "Time budget",
                      "Light blue: the ADC reads the sensors; orange: the board computes and seals a frame; "
                      "blue: the frame is on the wire; grey: it sleeps."};
  if (is_measured) page.drawing(figure, budget_svg(figure, r.at("time_budget_ms")));
  page.write(saved);
}

void summarize_latency(Page& page, const Json& r) {
  const int lost = r.at("lost").get<int>();
  page.paragraph(fmt::format("{}; mean of {} edges{}.", r.at("title").get<std::string>(),
                             r.at("edges").get<int>(),
                             lost > 0 ? fmt::format(", {} more were lost on the way", lost) : ""));
  Json rows = r.at("stages");
  rows.push_back(r.at("total"));
  rows.back()["name"] = "total";
  page.table(table_of("Latency in milliseconds", rows,
                      {{"stage", "/name"},
                       {"mean", "/mean_ms", "{:.2f}"},
                       {"least", "/min_ms", "{:.2f}"},
                       {"most", "/max_ms", "{:.2f}"}}));
}

void render_latency(const Saved& saved) {
  const Json& r = saved.results();
  Page page("From a sensor's edge to the motor");
  summarize_latency(page, r);
  const Figure figure{"latency", "Stage by stage",
                      "How long each stage takes on average, one after the other."};
  page.drawing(figure, latency_svg(figure, r.at("stages")));
  page.write(saved);
}

}  // namespace flexor::report
