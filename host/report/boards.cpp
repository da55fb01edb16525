#include <algorithm>
#include <array>

#include "host/io/io.hpp"
#include "host/report/jobs.hpp"
#include "host/report/page.hpp"
#include "host/report/wiring.hpp"

namespace flexor::report {
namespace {

constexpr std::array<const char*, 6> kColours = {"#999999", "#56B4E9", "#F0E442",
                                                 "#0072B2", "#D55E00", "#009E73"};

// The parts of a sample period and of a frame period, to scale.
void time_budget(Gnuplot& g, const Json& t) {
  const auto ms = [&](const char* part) { return t.at(part).get<double>(); };
  g.begin("time_budget", 200);
  g.add(
      "unset key; set yrange [-0.6:1.6]; set ytics ('frame' 0, 'sample' 1); set xrange [0:{}]; set xlabel "
      "'time (ms)'",
      std::max(ms("sample_period"), ms("frame_period")) * 1.02);
  g.add("set style fill solid noborder; unset grid; set grid x lc rgb '#dddddd'");
  int objects = 0;
  const auto bar = [&](double from, double to, int row, const char* colour) {
    g.add("set object {} rectangle from {:.4f},{} to {:.4f},{} fc rgb '{}'", ++objects, from, row - 0.3, to,
          row + 0.3, colour);
  };
  bar(0, ms("sample_period"), 1, "#eeeeee");
  bar(0, ms("adc"), 1, kColours[1]);
  bar(ms("adc"), ms("adc") + ms("compute_worst"), 1, kColours[4]);
  bar(0, ms("frame_period"), 0, "#eeeeee");
  bar(0, ms("frame_on_wire"), 0, kColours[3]);
  g.add("plot NaN notitle");
}

void latency_bar(Gnuplot& g, const Json& r) {
  g.begin("latency", 300);
  g.add("unset ytics; set yrange [-0.7:0.7]; set xrange [0:{}]; set xlabel 'time since the edge (ms)'",
        r.at("total").at("mean_ms").get<double>() * 1.05);
  g.add(
      "set style fill solid noborder; unset grid; set grid x lc rgb '#dddddd'; set key above maxrows 3; set "
      "border 1");
  double from = 0;
  std::string plot;
  for (std::size_t i = 0; i < r.at("stages").size(); ++i) {
    const Json& s = r.at("stages")[i];
    const double mean = s.at("mean_ms").get<double>();
    g.add("set object {} rectangle from {:.4f},-0.4 to {:.4f},0.4 fc rgb '{}'", i + 1, from, from + mean,
          kColours.at(i));
    plot += fmt::format("{}NaN with boxes fc rgb '{}' title {} noenhanced", i > 0 ? ", " : "plot ",
                        kColours.at(i),
                        gnuplot_text(fmt::format("{}: {:.1f} ms", s.at("name").get<std::string>(), mean)));
    from += mean;
  }
  g.add("{}", plot);
}

}  // namespace

namespace {

TableBlock table_of(const std::string& caption, const Json& rows) {
  TableBlock table{caption, {"", ""}, {}, {}};
  for (const Json& row : rows)
    table.rows.push_back({row.at("name").get<std::string>(), row.at("value").get<std::string>()});
  return table;
}

// What the user does with it.
void add_lead(Page& page, const Json& r) {
  page.table(table_of("What it does", r.at("lead")));
  page.heading("What to do next");
  std::string steps;
  for (const Json& step : r.at("next")) steps += (steps.empty() ? "" : "\n") + step.get<std::string>();
  page.code(steps);
  page.paragraph("Or copy what is in arduino/ to the Arduino IDE's libraries and open the example.");
  page.heading("Wiring");
  const Json& wiring = r.at("wiring");
  for (const Json& board : wiring.at("boards")) {
    const auto name = board.at("name").get<std::string>();
    const Figure figure{"wiring_" + name, "Wiring of the " + name,
                        "Blue wires carry what the board reads or sends.", true};
    page.figure(figure, wiring_svg(board, wiring.at("divider_kohm").get<double>()));
  }
  TableBlock parts{"Parts", {"what", "count"}, {}, {}};
  for (const Json& part : wiring.at("parts"))
    parts.rows.push_back({part.at("what").get<std::string>(), std::to_string(part.at("count").get<int>())});
  page.table(parts);
}

// What it costs.
void add_costs(Page& page, const Json& r) {
  page.heading("What it costs");
  page.paragraph(r.at("budget_sentence").get<std::string>());
  const Json& target = r.at("targets").at(0);
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
  page.table(table_of("What was measured", r.at("table")));
}

}  // namespace

void render_deployment(const Saved& saved) {
  const Json& r = saved.results();
  Gnuplot g;
  time_budget(g, r.at("time_budget_ms"));
  g.run();
  save_wiring(r.at("wiring"), saved.folder());
  Page page("Firmware of " + saved.text("model_name"));
  page.paragraph(
      fmt::format("For {} at 16 MHz. Every figure was measured on the very {} in this folder, run "
                  "instruction by instruction.",
                  r.at("chips").get<std::string>(), r.at("boards").get<int>() == 2 ? "images" : "image"));
  add_lead(page, r);
  add_costs(page, r);
  const Figure figure{
      "time_budget", "Time budget",
      "Light blue: the ADC reads five strips; orange: the board computes and seals a frame; blue: the "
      "frame is on the wire; grey: it sleeps."};
  page.figure(figure, g, saved.folder());
  page.paragraph(fmt::format("flexor {}.", saved.text("version")));
  io::write_file(saved.folder() / "report.html", page.html());
}

void render_latency(const Saved& saved) {
  const Json& r = saved.results();
  Gnuplot g;
  latency_bar(g, r);
  g.run();
  Page page("From a sensor's edge to the motor");
  page.paragraph(fmt::format("{}; mean of {} edges{}.", saved.text("title"), r.at("edges").get<int>(),
                             r.at("lost").get<int>() > 0
                                 ? fmt::format(", {} more were lost on the way", r.at("lost").get<int>())
                                 : ""));
  const Figure figure{"latency", "Stage by stage",
                      "How long each stage takes on average, one after the other."};
  page.figure(figure, g, saved.folder());
  TableBlock table{"Latency in milliseconds", {"stage", "mean", "least", "most"}, {}, {}};
  const auto row = [&](const std::string& name, const Json& s) {
    table.rows.push_back({name, fmt::format("{:.2f}", s.at("mean_ms").get<double>()),
                          fmt::format("{:.2f}", s.at("min_ms").get<double>()),
                          fmt::format("{:.2f}", s.at("max_ms").get<double>())});
  };
  for (const Json& s : r.at("stages")) row(s.at("name").get<std::string>(), s);
  row("total", r.at("total"));
  page.table(table);
  page.paragraph(fmt::format("flexor {}.", saved.text("version")));
  io::write_file(saved.folder() / "report.html", page.html());
}

}  // namespace flexor::report
