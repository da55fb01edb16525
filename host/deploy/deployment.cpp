#include "host/deploy/deployment.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "host/deploy/images.hpp"
#include "host/deploy/out_folder.hpp"
#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/model/wiring.hpp"
#include "runtime/link/hand_end.hpp"
#include "runtime/link/opengloves.hpp"

namespace flexor::deploy {
namespace {

constexpr double kCyclesPerMs = kClock_hz / 1000;

bool has_hand(const Deployment& d) { return d.glove.output == Output::radio; }

std::string cycles(const CycleStatistic& c) {
  return fmt::format("{:.0f} mean, {} worst", c.mean(), c.worst);
}

std::string of_chip(int bytes, int chip) {
  return fmt::format("{} of the chip's {} ({:.0f} %)", bytes, chip, 100.0 * bytes / chip);
}

std::string moved_by(const model::Model& model, const char* otherwise) {
  const model::Wiring wiring = model::wiring_of(model);
  std::vector<std::string> out;
  for (std::size_t f = 0; f < model::kFingers; ++f) {
    const std::string& finger = model::finger_names()[f];
    if (!wiring.joint[f]) {
      out.push_back(fmt::format("{} {}", finger, otherwise));
      continue;
    }
    const std::string& joint = model.joints[*wiring.joint[f]].name;
    out.push_back(joint == finger ? finger : fmt::format("{} by {}", finger, joint));
  }
  return fmt::format("{}", fmt::join(out, ", "));
}

std::string sensors_of(const model::Model& model) {
  const model::Wiring wiring = model::wiring_of(model);
  std::vector<std::string> out;
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    out.push_back(
        fmt::format("{} on the {}'s", model.inputs[i].name, model::finger_names()[wiring.sensor[i]]));
  }
  return fmt::format("{}", fmt::join(out, ", "));
}

// To a list of names and values, as a report shows them.
void add(Json& lines, const std::string& name, const std::string& value) {
  lines.push_back({{"name", name}, {"value", value}});
}

WiringPlan plan_of(const Deployment& d) {
  if (d.glove.output == Output::log) return wiring_plan(d.hardware, d.glove.output);
  Sensed sensed{};
  for (const std::size_t finger : model::wiring_of(d.glove.model).sensor) sensed.at(finger) = true;
  return wiring_plan(d.hardware, d.glove.output, sensed);
}

std::string pins_of(const Deployment& d) {
  const WiringPlan plan = plan_of(d);
  std::vector<std::string> out;
  for (const Connection& c : plan.boards.front().connections) {
    if (c.kind != "radio" && c.kind != "usb") out.push_back(fmt::format("{} {}", c.name, c.pin));
  }
  return fmt::format("{}", fmt::join(out, ", "));
}

std::vector<std::string> sent_joints(const Glove& glove) {
  std::vector<std::string> out;
  for (const BoardOutput& o : outputs_of(glove)) {
    if (o.output.number >= kFingers) out.push_back(glove.model.joints[o.joint].name);
  }
  return out;
}

std::vector<std::string> joints_left_out(const Glove& glove) {
  std::vector<std::string> out = model::left_out(glove.model);
  const std::vector<std::string> sent = sent_joints(glove);
  std::erase_if(out, [&](const std::string& joint) { return std::ranges::find(sent, joint) != sent.end(); });
  return out;
}

std::string boards_of(const Deployment& d) {
  const auto named = [](const Pins& pins) {
    return fmt::format("{} ({})", boards_with(pins), kAtmega328p.printed);
  };
  std::string glove = named(d.glove.pins);
  if (!has_hand(d)) return glove;
  return fmt::format("glove: {}, hand: {}", glove, named({}));
}

// What a user wants to know first.
Json lead(const Deployment& d) {
  Json out;
  add(out, "fingers",
      moved_by(d.glove.model, has_hand(d)                            ? "rests"
                              : d.glove.output == Output::opengloves ? "is missing, and sent as straight"
                                                                     : "is missing"));
  if (const auto sent = sent_joints(d.glove); !sent.empty())
    add(out, "joints beside them", fmt::format("{}", fmt::join(sent, ", ")));
  if (const auto left = joints_left_out(d.glove); !left.empty())
    add(out, has_hand(d) ? "joints without a motor, left out" : "joints left out",
        fmt::format("{}", fmt::join(left, ", ")));
  add(out, "strips", sensors_of(d.glove.model));
  add(out, "board", boards_of(d));
  add(out, "pins", pins_of(d));
  add(out, "calibration", d.calibration);
  return out;
}

std::string flash_command(const Deployment& d, const char* board) {
  return fmt::format("flexor flash {} --board {} --port auto", io::shell_word(d.folder), board);
}

constexpr const char* kZeroWords =
    "Zero the glove, whenever it is put on: press calibrate, hold the hand open for three seconds while the "
    "LED blinks slowly, then a fist for three while it blinks quickly; steady light: it is kept, trembling: "
    "refused, try again.";

// What a line of text holds, for the eye.
std::string line_words(const Glove& glove) {
  if (glove.output == Output::text)
    return "its time in ms and an angle in degrees of each finger, thumb to pinky, which grows as it bends; "
           "one that is not sensed is empty";
  if (glove.output == Output::log)
    return "its time in ms and the counts of each sensor, thumb to pinky, which change as a finger bends";
  return fmt::format(
      "a number behind each finger's letter, A thumb to E pinky, which goes from 0 to {} as it bends",
      link::kGloveTop);
}

std::vector<std::string> next_for_text(const Deployment& d) {
  std::vector<std::string> out = {
      "Wire the glove: wiring_glove.svg; parts and pins are in wiring.md.",
      "Flash it: " + flash_command(d, "glove"),
      fmt::format("Look: a serial monitor at {:g} baud shows {} lines a second: {}.", kUsbBaud,
                  sample_rate_hz(d.glove.model), line_words(d.glove))};
  if (can_zero(d.glove)) out.emplace_back(kZeroWords);
  if (d.glove.output == Output::opengloves) {
    out.push_back(
        fmt::format("In the driver: USB serial, this port for the {} hand, and {} for max_analog_value.",
                    d.glove.right_hand ? "right" : "left", link::kGloveTop));
  } else {
    out.emplace_back("Record it: flexor record log.csv --port auto.");
  }
  return out;
}

std::vector<std::string> next_for_hand(const Deployment& d) {
  std::vector<std::string> out = {
      "Wire both boards: wiring_glove.svg and wiring_hand.svg; parts and pins are in wiring.md.",
      "Flash the glove, with its radio unplugged from D0: " + flash_command(d, "glove"),
      "Flash the hand, with its radio unplugged and its motors' supply off: " + flash_command(d, "hand"),
      "Look: with both boards on, bend one finger after the other: the hand's follow. If one does not, "
      "flexor monitor on the hand's port shows what is wrong with it: angle, duty and fault of each."};
  if (can_zero(d.glove)) out.emplace_back(kZeroWords);
  out.push_back(fmt::format("Another model later: flexor send MODEL --port auto --rate {} --hardware {}{}",
                            sample_rate_hz(d.glove.model), io::shell_word(d.folder + "/" + kHardwareFile),
                            d.glove.key ? " --key " + io::shell_word(d.folder + "/pair.key") : ""));
  return out;
}

// The sample period's parts, ms.
struct TimeBudget {
  double period_ms = 0;
  double adc_ms = 0;
  double compute_ms = 0;  // worst, frame sealed
  double uart_ms = 0;     // of a frame
  double frame_period_ms = 0;
};
TimeBudget time_budget(const Deployment& d) {
  constexpr double kConversion_ms = 13 * 128 / kCyclesPerMs;  // of the ADC at 125 kHz
  const int bytes = has_hand(d) ? link::frame_bytes(d.glove.key.has_value()) : line_bytes(d.glove);
  const double baud = has_hand(d) ? d.glove.baud : kUsbBaud;
  TimeBudget t;
  t.period_ms = 1000 * d.glove.model.sample_period_s;
  t.adc_ms = static_cast<double>(model::scan_of(d.glove.pins).size()) * kConversion_ms;
  t.compute_ms = static_cast<double>(d.glove_figures.sample.worst) / kCyclesPerMs;
  t.uart_ms = bytes * 10 / baud * 1000;
  t.frame_period_ms = t.period_ms * samples_per_frame(d.glove);
  return t;
}

double time_share(const TimeBudget& t) { return (t.adc_ms + t.compute_ms) / t.period_ms; }

double flash_share(const Deployment& d) {
  const int glove = glove_image().flash_bytes();
  const int fuller = has_hand(d) ? std::max(glove, hand_image().flash_bytes()) : glove;
  return static_cast<double>(fuller) / kAtmega328p.flash_bytes;
}

bool is_measured(const Deployment& d) { return d.glove_figures.samples > 0; }

std::string budget_sentence(const Deployment& d) {
  if (!is_measured(d))
    return fmt::format(
        "The fuller image takes {:.0f} % of a chip's flash. Cycles and stack were not measured: the boards' "
        "simulation, flexor-cosim, is not installed.",
        100 * flash_share(d));
  return fmt::format(
      "A sample is read and computed in {:.1f} % of its time, and the fuller image takes {:.0f} % of a "
      "chip's flash: cycles and bytes below are for those who add to the firmware.",
      100 * time_share(time_budget(d)), 100 * flash_share(d));
}

// What it costs.
Json lines(const Deployment& d) {
  const TimeBudget t = time_budget(d);
  Json out;
  const auto add = [&](const std::string& name, const std::string& value) { deploy::add(out, name, value); };
  const auto measured = [&](const std::string& name, const std::string& value) {
    if (is_measured(d)) add(name, value);
  };
  measured("compensator, cycles per step of five", cycles(d.glove_figures.step));
  measured("all of a sample, frame sealed, cycles", cycles(d.glove_figures.sample));
  add("worst error against double, whole range", fmt::format("{:.4f} deg", d.error.range_deg));
  if (d.error.recording_deg)
    add("the same over " + d.recording, fmt::format("{:.4f} deg", *d.error.recording_deg));
  measured("compared with the host to the bit",
           fmt::format("{} angles over {} samples, {} mismatches", d.glove_figures.angles,
                       d.glove_figures.samples, d.glove_figures.mismatches));
  add("glove: flash, bytes", of_chip(glove_image().flash_bytes(), kAtmega328p.flash_bytes));
  add("glove: static RAM, bytes", of_chip(glove_image().ram_bytes(), kAtmega328p.ram_bytes));
  measured("glove: stack at most, bytes", fmt::format("{}", d.glove_figures.stack_bytes));
  measured("glove: awake", fmt::format("{:.1f} % of the time", 100 * d.glove_figures.awake_share));
  if (has_hand(d)) {
    measured("hand: tick of five loops, cycles", cycles(d.hand_figures.tick));
    add("hand: flash, bytes", of_chip(hand_image().flash_bytes(), kAtmega328p.flash_bytes));
    add("hand: static RAM, bytes", of_chip(hand_image().ram_bytes(), kAtmega328p.ram_bytes));
    measured("hand: stack at most, bytes", fmt::format("{}", d.hand_figures.stack_bytes));
    measured("hand: awake, link at its fullest",
             fmt::format("{:.0f} % of the time", 100 * d.hand_figures.awake_share));
  }
  measured("sample period",
           fmt::format("{:.1f} ms: ADC {:.2f}, compute at most {:.2f}", t.period_ms, t.adc_ms, t.compute_ms));
  add("frame period", fmt::format("{:.1f} ms, of which {:.1f} on the wire", t.frame_period_ms, t.uart_ms));
  if (has_hand(d) && d.glove.key)
    add("radio: greatest delay",
        fmt::format("{} ms one way, jitter included", link::greatest_delay_ms(t.frame_period_ms)));
  return out;
}

}  // namespace

Json to_json(const Deployment& d) {
  const auto measured = [&](Json figure) { return is_measured(d) ? std::move(figure) : Json(nullptr); };
  const auto statistic = [&](const CycleStatistic& c) {
    return measured({{"mean", c.mean()}, {"worst", c.worst}});
  };
  const TimeBudget t = time_budget(d);
  Json json = {{"targets", Json::array({{{"name", kAtmega328p.name},
                                         {"flash_bytes", glove_image().flash_bytes()},
                                         {"ram_bytes", glove_image().ram_bytes()},
                                         {"stack_bytes", measured(d.glove_figures.stack_bytes)},
                                         {"step_cycles", statistic(d.glove_figures.step)},
                                         {"worst_error_deg", d.error.worst_deg()}}})},
               {"sample_cycles", statistic(d.glove_figures.sample)},
               {"error_deg",
                {{"range", d.error.range_deg},
                 {"recording", d.error.recording_deg ? Json(*d.error.recording_deg) : Json(nullptr)}}},
               {"bit_exact", measured({{"samples", d.glove_figures.samples},
                                       {"angles", d.glove_figures.angles},
                                       {"mismatches", d.glove_figures.mismatches}})},
               {"time_budget_ms",
                {{"sample_period", t.period_ms},
                 {"adc", t.adc_ms},
                 {"compute_worst", measured(t.compute_ms)},
                 {"frame_period", t.frame_period_ms},
                 {"frame_on_wire", t.uart_ms}}}};
  json["greatest_delay_ms"] =
      has_hand(d) && d.glove.key ? Json(link::greatest_delay_ms(t.frame_period_ms)) : Json(nullptr);
  json["joints_left_out"] = joints_left_out(d.glove);
  const std::vector<std::string> missing = model::missing_fingers(d.glove.model);
  std::vector<std::string> covered = model::finger_names();
  for (const std::string& finger : missing) std::erase(covered, finger);
  json["fingers"] = {{"covered", covered}, {"missing", missing}};
  json["wiring"] = plan_of(d);
  json["calibration"] = d.calibration;
  json["next"] = has_hand(d) ? next_for_hand(d) : next_for_text(d);
  json["budget"] = {{"time_share", measured(time_share(t))}, {"flash_share", flash_share(d)}};
  json["hand"] = nullptr;
  if (has_hand(d)) {
    json["hand"] = {{"flash_bytes", hand_image().flash_bytes()},
                    {"ram_bytes", hand_image().ram_bytes()},
                    {"stack_bytes", measured(d.hand_figures.stack_bytes)},
                    {"tick_cycles", statistic(d.hand_figures.tick)}};
  }
  return json;
}

void save_results(const Deployment& d, const std::filesystem::path& folder) {
  Json json = {
      {"kind", "deployment"},
      {"model_name", d.glove.model.name},
      {"boards", has_hand(d) ? 2 : 1},
      {"chips", fmt::format("{} with an {}", has_hand(d) ? "two boards" : "one board", kAtmega328p.printed)},
      {"lead", lead(d)},
      {"budget_sentence", budget_sentence(d)},
      {"table", lines(d)},
      {"version", FLEXOR_VERSION}};
  json.update(to_json(d));
  io::write_file(folder / "results.json", io::dump(json));
}

}  // namespace flexor::deploy
