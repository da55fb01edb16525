#include "host/report/boards_report.hpp"

#include <algorithm>
#include <cmath>

#include "host/io/io.hpp"
#include "host/report/gnuplot.hpp"
#include "host/report/html.hpp"

namespace flexor::report {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array<const char*, 6> kColours = {"#999999", "#56B4E9", "#F0E442",
                                                 "#0072B2", "#D55E00", "#009E73"};
constexpr double kCyclesPerMs = deploy::kClock_hz / 1000;

bool has_hand(const Deployment& d) { return d.glove.output == deploy::Output::radio; }

std::string cycles(const CycleStatistic& c) {
  return fmt::format("{:.0f} mean, {} worst", c.mean(), c.worst);
}

std::string of_budget(int bytes, int budget, int chip) {
  return fmt::format("{} of {}{}", bytes, chip,
                     bytes > budget ? fmt::format(", over the budget of {}", budget) : "");
}

// Name and value of each line of the table.
std::vector<std::pair<std::string, std::string>> lines(const Deployment& d) {
  const TimeBudget t = time_budget(d);
  std::vector<std::pair<std::string, std::string>> out;
  const auto add = [&](const std::string& name, const std::string& value) { out.emplace_back(name, value); };
  add("compensator, cycles per step of five", cycles(d.glove_figures.step));
  add("all of a sample, frame sealed, cycles", cycles(d.glove_figures.sample));
  add("worst error against double, whole range", fmt::format("{:.4f} deg", d.error.range_deg));
  if (d.error.recording_deg)
    add("the same over " + d.recording, fmt::format("{:.4f} deg", *d.error.recording_deg));
  add("compared with the host to the bit",
      fmt::format("{} angles over {} samples, {} mismatches", d.glove_figures.angles, d.glove_figures.samples,
                  d.glove_figures.mismatches));
  add("glove: flash, bytes", of_budget(d.glove_image.flash_bytes, deploy::kFlashBudget, deploy::kFlash));
  add("glove: static RAM, bytes", of_budget(d.glove_image.ram_bytes, deploy::kRamBudget, deploy::kRam));
  add("glove: stack at most, bytes", fmt::format("{}", d.glove_figures.stack_bytes));
  add("glove: awake", fmt::format("{:.1f} % of the time", 100 * d.glove_figures.awake_share));
  if (has_hand(d)) {
    add("hand: tick of five loops, cycles", cycles(d.hand_figures.tick));
    add("hand: flash, bytes", of_budget(d.hand_image.flash_bytes, deploy::kFlashBudget, deploy::kFlash));
    add("hand: static RAM, bytes", of_budget(d.hand_image.ram_bytes, deploy::kRamBudget, deploy::kRam));
    add("hand: stack at most, bytes", fmt::format("{}", d.hand_figures.stack_bytes));
    add("hand: awake, link at its fullest",
        fmt::format("{:.0f} % of the time", 100 * d.hand_figures.awake_share));
  }
  add("sample period",
      fmt::format("{:.1f} ms: ADC {:.2f}, compute at most {:.2f}", t.period_ms, t.adc_ms, t.compute_ms));
  add("frame period", fmt::format("{:.1f} ms, of which {:.1f} on the wire", t.frame_period_ms, t.uart_ms));
  return out;
}

std::string budget_svg(const Deployment& d) {
  const TimeBudget t = time_budget(d);
  Gnuplot g;
  g.begin("budget", 220);
  g.add(
      "unset key; set yrange [-0.6:1.6]; set ytics ('frame' 0, 'sample' 1); set xrange [0:{}]; set xlabel "
      "'time (ms)'",
      std::max(t.period_ms, t.frame_period_ms) * 1.02);
  g.add("set style fill solid noborder; unset grid; set grid x lc rgb '#dddddd'");
  int objects = 0;
  const auto bar = [&](double from, double to, int row, const char* colour) {
    g.add("set object {} rectangle from {:.4f},{} to {:.4f},{} fc rgb '{}'", ++objects, from, row - 0.3, to,
          row + 0.3, colour);
  };
  bar(0, t.period_ms, 1, "#eeeeee");
  bar(0, t.adc_ms, 1, kColours[1]);
  bar(t.adc_ms, t.adc_ms + t.compute_ms, 1, kColours[4]);
  bar(0, t.frame_period_ms, 0, "#eeeeee");
  bar(0, t.uart_ms, 0, kColours[3]);
  g.add("plot NaN notitle");
  g.run();
  return g.svg("budget");
}

}  // namespace

LatencyBudget budget_of(const std::vector<Latency>& edges, int asked) {
  if (edges.empty()) throw io::JobError("no edge came through to the motor");
  const auto over = [&](const auto& value) {
    LatencyBudget::Stage s{0, 1e9, 0};
    for (const Latency& edge : edges) {
      const double ms = value(edge);
      s.mean_ms += ms / static_cast<double>(edges.size());
      s.min_ms = std::min(s.min_ms, ms);
      s.max_ms = std::max(s.max_ms, ms);
    }
    return s;
  };
  LatencyBudget out;
  out.edges = static_cast<int>(edges.size());
  out.lost = asked - out.edges;
  for (std::size_t i = 0; i < out.stage.size(); ++i)
    out.stage[i] = over([i](const Latency& edge) { return edge[i]; });
  out.total = over([](const Latency& edge) {
    double sum = 0;
    for (const double ms : edge) sum += ms;
    return sum;
  });
  return out;
}

std::string latency_table(const LatencyBudget& b) {
  std::string out = fmt::format("{:<22}{:>9}{:>9}{:>9}\n", "stage", "mean", "least", "most");
  const auto row = [&](const char* name, const LatencyBudget::Stage& s) {
    out += fmt::format("{:<22}{:>9.2f}{:>9.2f}{:>9.2f}\n", name, s.mean_ms, s.min_ms, s.max_ms);
  };
  for (std::size_t i = 0; i < b.stage.size(); ++i) row(kLatencyStages[i], b.stage[i]);
  row("total", b.total);
  return out;
}

Json to_json(const LatencyBudget& b) {
  const auto stage = [](const LatencyBudget::Stage& s) {
    return Json{{"mean_ms", s.mean_ms}, {"min_ms", s.min_ms}, {"max_ms", s.max_ms}};
  };
  Json stages = Json::array();
  for (std::size_t i = 0; i < b.stage.size(); ++i) {
    Json row = stage(b.stage[i]);
    row["name"] = kLatencyStages[i];
    stages.push_back(std::move(row));
  }
  return {{"edges", b.edges}, {"lost", b.lost}, {"stages", std::move(stages)}, {"total", stage(b.total)}};
}

void write_latency_figure(const LatencyBudget& b, const std::string& title,
                          const std::filesystem::path& folder) {
  io::make_folder(folder);
  std::string csv = "stage,mean_ms,min_ms,max_ms\n";
  Gnuplot g;
  g.begin("latency", 260);
  g.add(
      "set title {} noenhanced; set yrange [-0.7:0.7]; unset ytics; set xrange [0:{}]; "
      "set xlabel 'time since the "
      "edge (ms)'",
      gnuplot_text(fmt::format("{}, mean of {} edges", title, b.edges)), b.total.mean_ms * 1.05);
  g.add(
      "set style fill solid noborder; unset grid; set grid x lc rgb '#dddddd'; set key above maxrows 2; set "
      "border 1");
  double from = 0;
  std::string plot;
  for (std::size_t i = 0; i < b.stage.size(); ++i) {
    const LatencyBudget::Stage& s = b.stage[i];
    csv += fmt::format("{},{:.4f},{:.4f},{:.4f}\n", kLatencyStages[i], s.mean_ms, s.min_ms, s.max_ms);
    g.add("set object {} rectangle from {:.4f},-0.4 to {:.4f},0.4 fc rgb '{}'", i + 1, from, from + s.mean_ms,
          kColours[i]);
    plot += fmt::format("{}NaN with boxes fc rgb '{}' title '{}: {:.1f} ms'", i > 0 ? ", " : "plot ",
                        kColours[i], kLatencyStages[i], s.mean_ms);
    from += s.mean_ms;
  }
  csv += fmt::format("total,{:.4f},{:.4f},{:.4f}\n", b.total.mean_ms, b.total.min_ms, b.total.max_ms);
  g.add("{}", plot);
  g.run();
  io::write_file(folder / "latency.svg", g.svg("latency"));
  io::write_file(folder / "latency.csv", csv);
}

TimeBudget time_budget(const Deployment& d) {
  constexpr double kConversion_ms = 13 * 128 / kCyclesPerMs;  // of the ADC at 125 kHz
  const int bytes = d.glove.output == deploy::Output::opengloves ? 34
                    : d.glove.key                                ? link::kWireSealed
                                                                 : link::kWirePlain;
  const double baud = d.glove.output == deploy::Output::opengloves ? deploy::kUsbBaud : d.glove.baud;
  TimeBudget t;
  t.period_ms = 1000 * d.glove.model.sample_period_s;
  t.adc_ms = kFingers * kConversion_ms;
  t.compute_ms = static_cast<double>(d.glove_figures.sample.worst) / kCyclesPerMs;
  t.uart_ms = bytes * 10 / baud * 1000;
  t.frame_period_ms = t.period_ms * deploy::samples_per_frame(d.glove);
  return t;
}

std::string deployment_table(const Deployment& d) {
  std::string out;
  for (const auto& [name, value] : lines(d)) out += fmt::format("{:<40}  {}\n", name, value);
  return out;
}

Json to_json(const Deployment& d) {
  const auto statistic = [](const CycleStatistic& c) { return Json{{"mean", c.mean()}, {"worst", c.worst}}; };
  const TimeBudget t = time_budget(d);
  Json json = {{"targets", Json::array({{{"name", deploy::kTarget},
                                         {"flash_bytes", d.glove_image.flash_bytes},
                                         {"ram_bytes", d.glove_image.ram_bytes},
                                         {"stack_bytes", d.glove_figures.stack_bytes},
                                         {"step_cycles", statistic(d.glove_figures.step)},
                                         {"worst_error_deg", d.error.worst_deg()}}})},
               {"sample_cycles", statistic(d.glove_figures.sample)},
               {"error_deg",
                {{"range", d.error.range_deg},
                 {"recording", d.error.recording_deg ? Json(*d.error.recording_deg) : Json(nullptr)}}},
               {"bit_exact",
                {{"samples", d.glove_figures.samples},
                 {"angles", d.glove_figures.angles},
                 {"mismatches", d.glove_figures.mismatches}}},
               {"time_budget_ms",
                {{"sample_period", t.period_ms},
                 {"adc", t.adc_ms},
                 {"compute_worst", t.compute_ms},
                 {"frame_period", t.frame_period_ms},
                 {"frame_on_wire", t.uart_ms}}}};
  json["hand"] = nullptr;
  if (has_hand(d)) {
    json["hand"] = {{"flash_bytes", d.hand_image.flash_bytes},
                    {"ram_bytes", d.hand_image.ram_bytes},
                    {"stack_bytes", d.hand_figures.stack_bytes},
                    {"tick_cycles", statistic(d.hand_figures.tick)}};
  }
  return json;
}

void write_deployment_report(const Deployment& d, const std::filesystem::path& folder) {
  Page page;
  page.add(
      "<!doctype html><html lang=en><meta charset=utf-8><meta name=viewport "
      "content='width=device-width'><title>Flexor: firmware of "
      "{}</title><style>{}</style>",
      escape(d.glove.model.name), kStyle);
  page.add(
      "<h1>Firmware of {}</h1><p>For {} with an ATmega328P at 16 MHz. Every figure was measured on "
      "the very images in this "
      "folder, run instruction by instruction.</p>",
      escape(d.glove.model.name), has_hand(d) ? "two boards" : "one board");
  page.add(
      "<div class=cards><div class=card><b>{:.0f}</b>cycles for five channels, {:.2f} % of a sample "
      "period</div>"
      "<div class=card><b>{:.3f}&deg;</b>worst error of the integers against double</div>"
      "<div class=card><b>{}</b>differences from the host in {} angles</div></div>",
      d.glove_figures.step.mean(),
      d.glove_figures.step.mean() / kCyclesPerMs / time_budget(d).period_ms * 100, d.error.worst_deg(),
      d.glove_figures.mismatches, d.glove_figures.angles);
  page.add("<div class=scroll><table>");
  for (const auto& [name, value] : lines(d))
    page.add("<tr><td>{}</td><td>{}</td></tr>", escape(name), escape(value));
  page.add(
      "</table></div><h2>Time budget</h2><figure>{}<figcaption>Light blue: the ADC reads five strips; "
      "orange: the board computes and seals a "
      "frame; blue: the frame is on the wire; grey: it sleeps.</figcaption></figure>",
      budget_svg(d));
  page.add(
      "<h2>Flash {}</h2><p><code>avrdude -p m328p -c arduino -P /dev/ttyUSB0 -b 115200 -U "
      "flash:w:glove.hex</code>{}; or copy what is in <code>arduino/</code> to the Arduino IDE's libraries "
      "and open the example.</p></html>",
      has_hand(d) ? "them" : "it", has_hand(d) ? ", likewise <code>hand.hex</code>" : "");
  io::write_file(folder / "report.html", page.text());
}

}  // namespace flexor::report
