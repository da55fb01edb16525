#include "host/study/deployment.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/model/wiring.hpp"

namespace flexor::study {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kCyclesPerMs = deploy::kClock_hz / 1000;

bool has_hand(const Deployment& d) { return d.glove.output == deploy::Output::radio; }

std::string cycles(const CycleStatistic& c) {
  return fmt::format("{:.0f} mean, {} worst", c.mean(), c.worst);
}

std::string of_budget(int bytes, int budget, int chip) {
  return fmt::format("{} of {}{}", bytes, chip,
                     bytes > budget ? fmt::format(", over the budget of {}", budget) : "");
}

std::string moved_by(const model::Model& model) {
  const model::Wiring wiring = model::wiring_of(model);
  std::vector<std::string> out;
  for (std::size_t f = 0; f < model::kFingers; ++f) {
    const std::string& finger = model::finger_names()[f];
    if (!wiring.joint[f]) {
      out.push_back(finger + " rests");
      continue;
    }
    const std::string& joint = model.joints[*wiring.joint[f]].name;
    out.push_back(joint == finger ? finger : fmt::format("{} by {}", finger, joint));
  }
  return fmt::format("{}", fmt::join(out, ", "));
}

std::string strips_of(const model::Model& model) {
  const model::Wiring wiring = model::wiring_of(model);
  std::vector<std::string> out;
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    out.push_back(
        fmt::format("{} on the {}'s", model.inputs[i].name, model::finger_names()[wiring.strip[i]]));
  }
  return fmt::format("{}", fmt::join(out, ", "));
}

// Name and value of each line of the table.
std::vector<std::pair<std::string, std::string>> lines(const Deployment& d) {
  const TimeBudget t = time_budget(d);
  std::vector<std::pair<std::string, std::string>> out;
  const auto add = [&](const std::string& name, const std::string& value) { out.emplace_back(name, value); };
  add("fingers", moved_by(d.glove.model));
  if (const auto left = model::left_out(d.glove.model); !left.empty())
    add("joints without a motor, left out", fmt::format("{}", fmt::join(left, ", ")));
  add("strips", strips_of(d.glove.model));
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

void save_results(const LatencyBudget& b, const std::string& title, const std::filesystem::path& folder) {
  io::make_folder(folder);
  std::string csv = "stage,mean_ms,min_ms,max_ms\n";
  const auto line = [&](const char* name, const LatencyBudget::Stage& s) {
    csv += fmt::format("{},{:.4f},{:.4f},{:.4f}\n", name, s.mean_ms, s.min_ms, s.max_ms);
  };
  for (std::size_t i = 0; i < b.stage.size(); ++i) line(kLatencyStages[i], b.stage[i]);
  line("total", b.total);
  io::write_file(folder / "latency.csv", csv);
  Json json = {{"kind", "latency"}, {"title", title}, {"version", FLEXOR_VERSION}};
  json.update(to_json(b));
  io::write_file(folder / "results.json", io::dump(json));
}

TimeBudget time_budget(const Deployment& d) {
  constexpr double kConversion_ms = 13 * 128 / kCyclesPerMs;  // of the ADC at 125 kHz
  const int bytes =
      d.glove.output == deploy::Output::opengloves ? 34 : link::frame_bytes(d.glove.key.has_value());
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
  json["joints_left_out"] = model::left_out(d.glove.model);
  json["hand"] = nullptr;
  if (has_hand(d)) {
    json["hand"] = {{"flash_bytes", d.hand_image.flash_bytes},
                    {"ram_bytes", d.hand_image.ram_bytes},
                    {"stack_bytes", d.hand_figures.stack_bytes},
                    {"tick_cycles", statistic(d.hand_figures.tick)}};
  }
  return json;
}

void save_results(const Deployment& d, const std::filesystem::path& folder) {
  Json table = Json::array();
  for (const auto& [name, value] : lines(d)) table.push_back({{"name", name}, {"value", value}});
  Json json = {{"kind", "deployment"},
               {"model_name", d.glove.model.name},
               {"boards", has_hand(d) ? 2 : 1},
               {"table", std::move(table)},
               {"version", FLEXOR_VERSION}};
  json.update(to_json(d));
  io::write_file(folder / "results.json", io::dump(json));
}

}  // namespace flexor::study
