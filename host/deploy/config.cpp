#include "host/deploy/config.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "host/deploy/compensator_text.hpp"
#include "host/deploy/key_patch.hpp"
#include "host/deploy/model_block.hpp"
#include "host/io/io.hpp"
#include "host/model/kind.hpp"
#include "host/model/tracking.hpp"
#include "runtime/glove/flash_model.hpp"
#include "runtime/link/opengloves.hpp"

namespace flexor::deploy {
namespace {

using io::InputError;

constexpr std::size_t kCalibrate = 4;    // of buttons()
constexpr int kPotentiometerMargin = 5;  // counts from either rail
constexpr double kGap_deg = 1.25;        // between what the motor must have done and the reading
constexpr double kForget_deg_s = 4;      // of it: what noise leaves behind
constexpr double kKick = 3.2;            // times the duty that may move a finger: it must
constexpr double kPwmStep = 1.0 / 256;
constexpr double kSafeIntegralLimit = 0.25;  // of full duty: four times the friction
constexpr double kSafeSpeed_deg_s = 400;
constexpr double kTopSpeed_deg_s = 440;  // of a motor that the greatest load helps
constexpr double kSoftStop_deg = 2;      // before the joint's own
constexpr double kReach_deg = 15;        // past which a reading is none

int frame_bytes(const Key& key) { return link::frame_bytes(key.has_value()); }

std::int16_t q4(double deg) { return static_cast<std::int16_t>(std::lround(deg * 16)); }

constexpr const char* kHead = "// Written by flexor deploy {}; not to be edited.\n#pragma once\n\n";

}  // namespace

std::string key_text(const Key& key) {
  const link::KeyRecord record = key_record(key);
  return fmt::format(
      "const link::KeyRecord kKeyRecord PROGMEM __attribute__((used)) = {{{}, {}, {}, {{}}}};\n",
      model::braces(record.magic, sizeof(record.magic)), model::braces(record.key, sizeof(record.key)),
      model::braces(record.crc, sizeof(record.crc)));
}

double Sensor::operator()(double n) const {
  std::size_t i = 1;
  while (i + 1 < counts.size() && n > counts[i]) ++i;
  return value[i - 1] + (value[i] - value[i - 1]) * (n - counts[i - 1]) / (counts[i] - counts[i - 1]);
}

Sensor at_knots(const std::function<double(double)>& reads) {
  Sensor out;
  for (int n = 0; n <= 16 * (sensor::kKnots - 1); n += 16) {
    out.counts.push_back(n);
    out.value.push_back(std::clamp(reads(n), -model::kMaxSignal, model::kMaxSignal));
  }
  return out;
}

Sensor divider(double fixed_kohm, double flat_kohm, double kohm_per_deg) {
  return at_knots([&](double n) {
    constexpr double kTop = sensor::kAdcTop;
    return n >= kTop ? model::kMaxSignal : (fixed_kohm * n / (kTop - n) - flat_kohm) / kohm_per_deg;
  });
}

bool reads_alpha(const model::Input& input) {
  const std::string& column = input.column.empty() ? input.name : input.column;
  return input.unit == "deg" && (column.ends_with("_alpha") || column.ends_with("_alpha_deg"));
}

Sensor counts_as_they_are() {
  return at_knots([](double n) { return n; });
}

int sample_rate_hz(const model::Model& model) {
  const double rate = 1 / model.sample_period_s;
  for (const int known : {10, 20, 50, 100}) {
    if (std::abs(rate - known) < 1e-6 * known) return known;
  }
  throw InputError(
      fmt::format("a sample rate of {:g} Hz: the firmware has builds for 10, 20, 50 and 100 Hz", rate));
}

namespace {

// The longest line goes out within a sample period.
void require_room_for_lines(const Glove& glove) {
  const double line_s = line_bytes(glove) * 10 / kUsbBaud;
  if (line_s <= glove.model.sample_period_s) return;
  throw InputError(fmt::format(
      "a line of up to {} bytes takes {:.1f} ms at {:g} baud, which VR drivers fix, and the glove samples "
      "every {:g} ms: lower --rate, or --encoding alpha sends the fingers alone",
      line_bytes(glove), 1000 * line_s, kUsbBaud, 1000 * glove.model.sample_period_s));
}

// Bones of the driver's hand, from the wrist; a joint turns the one behind it.
std::optional<std::uint8_t> place_of(const std::string& finger, const std::string& joint) {
  const std::array<const char*, 3> thumb = {"_cmc", "_mcp", "_ip"};
  const std::array<const char*, 3> other = {"_mcp", "_pip", "_dip"};
  const bool is_thumb = finger == "thumb";
  for (std::uint8_t k = 0; k < 3; ++k) {
    if (joint == finger + (is_thumb ? thumb : other)[k]) return is_thumb ? k : k + 1;
  }
  return std::nullopt;
}

}  // namespace

std::uint8_t fingers_there(const model::Model& model) {
  const model::Wiring wiring = model::wiring_of(model);
  unsigned out = 0;
  for (std::size_t f = 0; f < kFingers; ++f) out |= (wiring.joint[f] ? 1U : 0U) << f;
  return static_cast<std::uint8_t>(out);
}

std::vector<std::string> missing_fingers(const model::Model& model) {
  const unsigned there = fingers_there(model);
  std::vector<std::string> out;
  for (std::size_t f = 0; f < kFingers; ++f) {
    if ((there >> f & 1U) == 0) out.push_back(model::finger_names()[f]);
  }
  return out;
}

std::vector<VrJoint> vr_joints(const Glove& glove) {
  std::vector<VrJoint> out;
  if (glove.output != Output::opengloves || glove.encoding == Encoding::alpha) return out;
  const model::Wiring wiring = model::wiring_of(glove.model);
  for (std::size_t f = 0; f < kFingers; ++f) {
    for (std::size_t j = 0; j < glove.model.joints.size(); ++j) {
      const model::Joint& joint = glove.model.joints[j];
      const auto place = place_of(model::finger_names()[f], joint.name);
      if (!place || wiring.joint[f] == j) continue;
      out.push_back(
          {j,
           {static_cast<std::uint8_t>(f), *place, model::strips_of(glove.model, wiring, j),
            model::flexion_of(model::ends(glove.model, joint)), model::guard_of(glove.model, joint)}});
    }
  }
  return out;
}

int line_bytes(const Glove& glove) {
  return link::kMaxGloveText + static_cast<int>(vr_joints(glove).size()) * link::kMaxJointText;
}

int samples_per_frame(const Glove& glove) {
  const int rate = sample_rate_hz(glove.model);
  if (glove.output == Output::opengloves) {
    require_room_for_lines(glove);
    return 1;
  }
  if (glove.key && glove.baud < kLeastBaudWithKey) {
    throw InputError(
        fmt::format("a radio of {:g} baud is too slow for a key, which wants {:g}: raise --baud, or "
                    "radio.baud of the twin",
                    glove.baud, kLeastBaudWithKey));
  }
  const int bytes = frame_bytes(glove.key);
  const double carried_hz = glove.baud / 10 / bytes;
  if (glove.frame_rate_hz == 0) {
    for (int n = 1; n <= rate; ++n) {
      if (rate % n == 0 && rate <= n * carried_hz) return n;
    }
    throw InputError(
        fmt::format("a radio of {:g} baud carries {:.2f} frames of {} bytes a second, the glove sends at "
                    "least one: raise --baud",
                    glove.baud, carried_hz, bytes));
  }
  if (glove.frame_rate_hz > carried_hz) {
    throw InputError(
        fmt::format("{:g} frames of {} bytes a second do not fit a radio of {:g} baud, which carries {:.1f}: "
                    "lower --frame-rate or raise --baud",
                    glove.frame_rate_hz, bytes, glove.baud, carried_hz));
  }
  const double every = rate / glove.frame_rate_hz;
  if (every < 1 || std::abs(every - std::round(every)) > 1e-9 || every > 255) {
    throw InputError(
        fmt::format("{:g} frames a second from {} samples: --frame-rate must divide the sample rate",
                    glove.frame_rate_hz, rate));
  }
  return static_cast<int>(std::lround(every));
}

bool can_zero(const Glove& glove) {
  return glove.pins.button[kCalibrate].has_value() &&
         std::ranges::any_of(glove.model.inputs, [](const auto& input) { return input.poses.has_value(); });
}

std::array<glove::TrackedStrip, kFingers> tracked_strips(const Glove& glove) {
  std::array<glove::TrackedStrip, kFingers> out{};
  if (!glove.track) return out;
  const model::Wiring wiring = model::wiring_of(glove.model);
  const std::vector<std::optional<model::TrackedRange>> ranges = model::tracked_ranges(glove.model);
  for (std::size_t i = 0; i < kFingers; ++i) {
    if (wiring.input[i]) out[i] = model::tracked_strip<glove::Tracking>(ranges[*wiring.input[i]], {});
  }
  return out;
}

void check_tracking(const Glove& glove) {
  if (!glove.track) return;
  if (glove.model_as == ModelAs::data)
    throw InputError(
        "--track with --model-as data: what a strip is tracked against is compiled into the image; use "
        "--model-as "
        "code, or leave out --track");
  const auto tracked = tracked_strips(glove);
  if (std::ranges::any_of(tracked, [](const glove::TrackedStrip& strip) { return strip.half != 0; })) return;
  throw InputError(
      "--track: the model does not say what a strip reads at the open hand and at the fist: identify it anew "
      "from a "
      "recording with both, or leave out --track");
}

Turns turns_of(const Glove& glove) {
  constexpr double kApart_s = 0.5;      // of two turns, at most
  constexpr double kSeekApart_s = 0.2;  // while the hand is not heard
  constexpr double kWay_s = 0.012;      // of the hand's answer through the modules and to its begin
  const double baud_s = 10 / glove.baud;
  const double period_s = glove.model.sample_period_s * samples_per_frame(glove);
  const double answer_s = link::wire_bytes(link::telemetry_bytes(kFingers), false) * baud_s + kWay_s;
  static_assert(link::wire_bytes(link::telemetry_bytes(kFingers), false) >=
                link::wire_bytes(link::kNonceBytes, true));
  const double silent_s = period_s - frame_bytes(glove.key) * baud_s;
  if (silent_s >= answer_s) return {1, 1, 0};
  const double slots = std::ceil((answer_s - silent_s) / period_s);
  const auto every = [&](double apart_s) {
    return static_cast<int>(std::max(1.0, std::floor(apart_s / period_s) - slots));
  };
  return {every(kApart_s), every(kSeekApart_s), static_cast<int>(std::min(slots, 255.0))};
}

int uart_divisor(double baud) {
  constexpr double kWorst = 0.025;
  const double exact = kClock_hz / (8 * baud) - 1;
  const double divisor = std::clamp(std::round(exact), 0.0, 4095.0);
  const double error = std::abs(kClock_hz / (8 * (divisor + 1)) / baud - 1);
  if (!(baud > 0) || !(error <= kWorst)) {
    throw InputError(
        fmt::format("{:g} baud cannot be made from a clock of 16 MHz (nearest is {:.1f} % off); usual rates "
                    "from 1200 to 115200 can",
                    baud, 100 * error));
  }
  return static_cast<int>(divisor);
}

GloveTables glove_tables(const Glove& glove) {
  (void)sample_rate_hz(glove.model);
  model::Sensors sensors;
  std::ranges::copy(glove.sensor, sensors.begin());
  return model::glove_tables(glove.model, sensors);
}

namespace {

std::vector<std::size_t> joints_of_text(const Glove& glove) {
  std::vector<std::size_t> out;
  for (const VrJoint& joint : vr_joints(glove)) out.push_back(joint.joint);
  return out;
}

}  // namespace

model::ChainParts chain_parts(const Glove& glove) {
  return {glove_tables(glove), model::HostCompensator(glove.model, joints_of_text(glove)),
          tracked_strips(glove), model::samples_per_tick(glove.model.sample_period_s)};
}

namespace {

hand::MotorSettings motor_settings(const HandMotor& motor) {
  constexpr double kTick_s = 0.001;
  const auto int16 = [](double v) {
    return static_cast<std::int16_t>(std::lround(std::clamp(v, 0.0, 32767.0)));
  };
  constexpr double kTurn_s = kTick_s * hand::kTurn_ticks;
  const auto speed = [&](double deg_s) { return int16(deg_s * kTurn_s * (1 << hand::kSumFraction)); };
  const double rate = -std::expm1(-kTurn_s / motor.time_s);
  const double may_move = motor.friction + motor.load;
  hand::MotorSettings c{};
  c.rate = std::max<std::int16_t>(int16(rate * 65536), 1);
  c.gain = int16(rate * motor.full_speed_deg_s * kTurn_s * (1 << (hand::kSpeedFraction + 1)));
  c.friction = speed(motor.friction * motor.full_speed_deg_s);
  c.load = speed((motor.load + kMotorFrictionShare * motor.friction + kPwmStep) * motor.full_speed_deg_s);
  c.forget = speed(kForget_deg_s);
  c.gap = int16(kGap_deg * (1 << hand::kSumFraction));
  c.breakaway = int16(may_move * hand::kFullDuty);
  c.kick = int16(kKick * may_move * hand::kFullDuty);
  return c;
}

}  // namespace

Hand within_safe_limits(Hand hand) {
  for (std::size_t i = 0; i < kFingers; ++i) {
    const double soft_deg = std::min(kSoftStop_deg, (hand.upper_deg[i] - hand.lower_deg[i]) / 4);
    hand.lower_deg[i] += soft_deg;
    hand.upper_deg[i] -= soft_deg;
  }
  hand.reach_deg = kReach_deg;
  // The fastest motor of this kind, and the one with the least friction.
  const double fastest_deg_s = (1 + kMotorSpeedShare) * hand.motor.full_speed_deg_s;
  const double least_friction = (1 - kMotorFrictionShare) * hand.motor.friction;
  hand.duty = std::min(hand.duty, kTopSpeed_deg_s / fastest_deg_s + least_friction - hand.motor.load);
  hand.integral_limit = std::min(hand.integral_limit, kSafeIntegralLimit);
  hand.speed_deg_s = std::min(hand.speed_deg_s, kSafeSpeed_deg_s);
  return hand;
}

hand::FingerSettings finger_settings(const Hand& hand, int finger) {
  const auto i = static_cast<std::size_t>(finger);
  constexpr double kTick_s = 0.001;
  const auto int16 = [](double v) {
    return static_cast<std::int16_t>(std::lround(std::clamp(v, 0.0, 32767.0)));
  };
  const auto step = [](double deg_s) {
    return static_cast<std::int32_t>(std::lround(std::min(deg_s * kTick_s, 1000.0) * (1 << 20)));
  };
  hand::FingerSettings c{};
  c.loop.lower = q4(hand.lower_deg[i]);
  c.loop.upper = q4(hand.upper_deg[i]);
  c.loop.max_step = step(hand.speed_deg_s);
  c.loop.proportional = int16(hand.proportional_per_deg * hand::kFullDuty);
  c.loop.integral = int16(hand.integral_per_deg_s * kTick_s * hand::kFullDuty * 256);
  c.loop.integral_limit = static_cast<std::int32_t>(std::lround(hand.integral_limit * hand::kFullDuty * 256));
  c.loop.duty_limit = int16(hand.duty * hand::kFullDuty);
  c.loop.feed_forward = int16(hand.feed_forward_s_per_deg / kTick_s * hand::kFullDuty);
  c.potentiometer.scale =
      static_cast<std::uint32_t>(std::lround(16 * hand.potentiometer_range_deg / 1023 * 65536));
  const double counts_per_deg = sensor::kAdcTop / hand.potentiometer_range_deg;
  const auto counts = [&](double deg) {
    return static_cast<std::uint16_t>(std::lround(std::clamp<double>(
        deg * counts_per_deg, kPotentiometerMargin, sensor::kAdcTop - kPotentiometerMargin)));
  };
  c.potentiometer.low = counts(hand.lower_deg[i] - hand.reach_deg);
  c.potentiometer.high = counts(hand.upper_deg[i] + hand.reach_deg);
  c.careful_step = step(hand.careful_deg_s);
  if (hand.motor.full_speed_deg_s > 0) c.motor = motor_settings(hand.motor);
  return c;
}

namespace {

// Pull-ups and which buttons are closed.
std::string button_text(const Pins& pins) {
  std::string start;
  std::string pressed;
  for (std::size_t i = 0; i < kButtons; ++i) {
    if (!pins.button[i]) continue;
    const PortBit pin = port_bit(*pins.button[i]);
    start += fmt::format("  PORT{} |= {};\n", pin.port, 1 << pin.bit);
    pressed += fmt::format("  if ((PIN{} & {}) == 0) out |= {};\n", pin.port, 1 << pin.bit, buttons()[i].bit);
  }
  return "inline void start_buttons() {\n" + start + "}\ninline uint8_t pressed() {\n  uint8_t out = 0;\n" +
         pressed + "  return out;\n}\n";
}

std::string vr_tables(const Glove& glove, const GloveTables& tables) {
  std::string out = "constexpr glove::FlexionSettings kFlexion[] = {";
  for (const glove::FlexionSettings& f : tables.flexion)
    out += fmt::format("{{{}, {}}}, ", f.straight, f.scale);
  const std::vector<VrJoint> joints = vr_joints(glove);
  out += fmt::format("}};\nconstexpr uint8_t kJoints = {};\nconstexpr glove::JointSettings kJoint[] = {{",
                     joints.size());
  for (const VrJoint& j : joints) {
    const glove::JointSettings& s = j.settings;
    out += fmt::format("{{{}, {}, {}, {{{}, {}}}, {{{}, {}, {}}}}}, ", s.finger, s.place, s.strips,
                       s.flexion.straight, s.flexion.scale, s.guard.rest, s.guard.max_step,
                       s.guard.hold_samples);
  }
  if (joints.empty()) out += "{}";
  out += fmt::format(
      "}};\nconstexpr uint8_t kThere = {};\nconstexpr bool kRightHand = {};\nconstexpr bool kJoystick = "
      "{};\n",
      fingers_there(glove.model), glove.right_hand, glove.pins.joystick.has_value());
  return out + button_text(glove.pins);
}

// The rings' sizes are powers of two, and one place stays empty.
int ring_bytes(const Glove& glove) {
  int size = 64;
  while (glove.output == Output::opengloves && size <= line_bytes(glove)) size *= 2;
  return size;
}

std::string scan_text(const Pins& pins) {
  const std::vector<int> scan = scan_of(pins);
  unsigned analog = 0;
  for (const int channel : scan) analog |= channel < 6 ? 1U << channel : 0U;
  return fmt::format("constexpr uint8_t kScan[] PROGMEM = {};\nconstexpr uint8_t kAnalogPins = {};\n",
                     model::braces(scan.data(), scan.size()), analog);
}

std::string zero_text(const Glove& glove) {
  const PortBit pin = port_bit(*glove.pins.button[kCalibrate]);
  return fmt::format(
      "struct ZeroConfig {{\n  static constexpr uint8_t kRate_hz = config::kRate_hz;\n"
      "  static void start_zero_button() {{ PORT{0} |= {1}; }}\n"
      "  static bool zero_button() {{ return (PIN{0} & {1}) == 0; }}\n}};\n",
      pin.port, 1 << pin.bit);
}

std::string track_text(const Glove& glove) {
  const glove::TrackerSettings c = model::tracker_settings<glove::Tracking>({});
  std::string strips;
  for (const glove::TrackedStrip& s : tracked_strips(glove))
    strips += fmt::format("{{{}, {}, {}, {}, {}}}, ", s.middle, s.half, s.noise, s.max_step, s.per_half);
  return fmt::format(
      "constexpr glove::TrackerSettings kTracker = {{{}, {}, {}}};\n"
      "constexpr glove::TrackedStrip kTracked[] PROGMEM = {{{}}};\nconstexpr uint8_t kSamplesPerTick = "
      "{};\n",
      c.shift, c.stretch, c.growth, strips, model::samples_per_tick(glove.model.sample_period_s));
}

std::string glove_head(const Glove& glove, const GloveTables& tables) {
  const bool radio = glove.output == Output::radio;
  std::string out = fmt::format(kHead, FLEXOR_VERSION);
  // No text of the model's: what ends a comment, or goes on after it, would be compiled.
  out += fmt::format("// model {}\n", io::digest(model::to_json(glove.model)));
  if (glove.assembly) out += "#define FLEXOR_AVR_ASSEMBLY\n";
  const bool is_data = glove.model_as == ModelAs::data;
  const bool in_flash = is_data && data_block(glove).in_flash;
  if (is_data) out += "#define FLEXOR_MODEL_AS_DATA\n";
  if (is_data) out += in_flash ? "#define FLEXOR_MODEL_IN_FLASH\n" : "#define FLEXOR_MODEL_IN_EEPROM\n";
  if (!radio) out += "#define FLEXOR_OUTPUT_OPENGLOVES\n";
  if (can_zero(glove)) out += "#define FLEXOR_ZERO\n";
  if (glove.track) out += "#define FLEXOR_TRACK\n";
  out +=
      "#include <avr/pgmspace.h>\n\n#include \"firmware/board.hpp\"\n#include "
      "\"runtime/glove/glove_text.hpp\"\n#include \"runtime/glove/signal_chain.hpp\"\n"
      "#include \"runtime/link/key_record.hpp\"\n"
      "#include \"runtime/compensator/blocks.hpp\"\n";
  if (in_flash) out += "#include \"runtime/glove/flash_model.hpp\"\n";
  if (is_data && !in_flash)
    out += "#include \"runtime/glove/data_model.hpp\"\n#include \"runtime/glove/model_receiver.hpp\"\n";
  if (can_zero(glove)) out += "#include \"firmware/glove/zeroing.hpp\"\n";
  out += "\nnamespace flexor {\nnamespace config {\n\n";
  out += fmt::format(
      "constexpr uint16_t kRate_hz = {};\nconstexpr uint8_t kSamplesPerFrame = {};\nconstexpr uint16_t "
      "kUartDivisor = {};\n",
      sample_rate_hz(glove.model), samples_per_frame(glove), uart_divisor(radio ? glove.baud : kUsbBaud));
  if (glove.track) out += track_text(glove);
  out += fmt::format("constexpr uint16_t kRingBytes = {};\n", ring_bytes(glove)) + scan_text(glove.pins);
  if (can_zero(glove)) out += zero_text(glove);
  if (!radio) return out + vr_tables(glove, tables) + "\n";
  const Turns turns = turns_of(glove);
  out += fmt::format(
      "constexpr uint8_t kListenEvery = {};\nconstexpr uint8_t kSeekEvery = {};\nconstexpr uint8_t "
      "kListenSlots = {};\n",
      turns.every, turns.seek_every, turns.slots);
  return out + key_text(glove.key) + "\n";
}

std::string sensor_tables(const Glove& glove, const GloveTables& tables) {
  std::string out;
  // Fingers with the same divider share a table.
  std::array<std::size_t, kFingers> table{};
  for (std::size_t i = 0; i < kFingers; ++i) {
    const auto same = [&](std::size_t j) {
      return std::ranges::equal(tables.calibration[i].alpha, tables.calibration[j].alpha);
    };
    while (!same(table[i])) ++table[i];
    if (table[i] == i) {
      out += fmt::format("constexpr sensor::Calibration kCalibration{} PROGMEM = {{{}}};\n", i,
                         model::braces(tables.calibration[i].alpha, sensor::kKnots));
    }
  }
  // A model that is data brings its own.
  out += fmt::format("\n{} glove::ChannelSettings kChannels[] = {{\n",
                     glove.model_as == ModelAs::data ? "static" : "constexpr");
  for (std::size_t i = 0; i < kFingers; ++i) {
    const sensor::MonitorSettings& m = tables.monitor[i];
    const sensor::GuardSettings& g = tables.guard[i];
    out += fmt::format("    {{&kCalibration{}, {{{}, {}, {}, {}}}, {{{}, {}, {}}}, {}, {{{}, {}}}}},\n",
                       table[i], m.low, m.high, m.rail_samples, m.stuck_samples, g.rest, g.max_step,
                       g.hold_samples, tables.strips[i], tables.poses[i].open, tables.poses[i].fist);
  }
  return out + "};\n\n";
}

std::uint16_t image_of(const ModelBlock& block) {
  std::uint16_t image = 0;
  for (const Bytes& part : block.parts) {
    for (const std::uint8_t byte : part) image = core::crc16_add(image, byte);
  }
  return image;
}

std::string made_for(const GloveTables& tables, std::uint16_t image) {
  const std::array<std::uint16_t, kFingers> ids = calibration_ids(tables);
  return fmt::format(
      "constexpr uint16_t kImage = {};\nconstexpr uint16_t kCalibrationId[] = {};\n"
      "constexpr compensator::MadeFor kMadeFor = {{kCalibrationId, kRate_hz}};\n",
      image, model::braces(ids.data(), ids.size()));
}

// What the interpreter starts from: the parts in flash, and what the chain gets of whichever model is loaded.
std::string eeprom_text(const ModelBlock& block, const GloveTables& tables) {
  std::string out;
  std::string built_in;
  for (std::size_t i = 0; i < block.parts.size(); ++i) {
    const Bytes& part = block.parts[i];
    out += fmt::format("constexpr uint8_t kPart{}[] PROGMEM = {};\n", i,
                       model::braces(part.data(), part.size()));
    built_in += fmt::format("{}{{kPart{}, {}}}", i > 0 ? ", " : "", i, part.size());
  }
  return out +
         fmt::format("constexpr glove::BuiltIn kBuiltIn[] = {{{}}};\nconstexpr uint8_t kParts = {};\n",
                     built_in, block.parts.size()) +
         made_for(tables, image_of(block));
}

// Two copies, of which the second is none yet.
std::string flash_text(const Glove& glove, const ModelBlock& block, const GloveTables& tables) {
  const std::uint16_t image = image_of(block);
  const glove::ModelRecord r = model_record(glove, image);
  const Bytes copy = model_copy(block, image, 0);
  return fmt::format(
             "const glove::ModelPages<{}> kModelPages PROGMEM __attribute__((used)) = {{{{{}, {}, {}, {}, "
             "{}, "
             "{}, "
             "{}, {{}}}}, {{{}}}}};\n",
             kCopyBytes, model::braces(r.magic, sizeof(r.magic)), r.image, r.rate_hz, r.version,
             model::braces(r.calibration, compensator::kStrips), r.copy_bytes, r.crc,
             model::braces(copy.data(), copy.size())) +
         made_for(tables, image);
}

std::string data_compensator(bool in_flash) {
  const std::string base =
      in_flash ? fmt::format("glove::FlashModel<{}>", kFlashArenaBytes)
               : fmt::format("glove::DataModel<firmware::Eeprom, config::kParts, {}>", kArenaBytes);
  return fmt::format(
      "class GloveCompensator : public {} {{\n public:\n"
      "  uint8_t step() {{\n    firmware::mark(firmware::Marker::step_begin);\n"
      "    const uint8_t good = Graph::step();\n    firmware::mark(firmware::Marker::step_end);\n"
      "    return good;\n  }}\n}};\n",
      base);
}

std::string data_config(const Glove& glove) {
  if (glove.output == Output::opengloves)
    throw InputError(
        "--output opengloves: a model that is data is replaced over the radio's link, which a glove for VR "
        "drivers "
        "does not speak: use --model-as code");
  const GloveTables tables = glove_tables(glove);
  const DataBlock data = data_block(glove);
  return glove_head(glove, tables) + sensor_tables(glove, tables) +
         (data.in_flash ? flash_text(glove, data.block, tables) : eeprom_text(data.block, tables)) +
         "\n}  // namespace config\n\n" + data_compensator(data.in_flash) + "\n}  // namespace flexor\n";
}

}  // namespace

std::string glove_config(const Glove& glove) {
  check_tracking(glove);
  if (glove.model_as == ModelAs::data) return data_config(glove);
  const CompensatorText text = compensator_text(glove.model, joints_of_text(glove));
  const GloveTables tables = glove_tables(glove);
  return glove_head(glove, tables) + sensor_tables(glove, tables) + text.coefficients +
         "\n}  // namespace config\n\n" + text.compensator + "\n}  // namespace flexor\n";
}

namespace {

// What is the same for all fingers: constants of their instructions.
std::string common_settings(const hand::FingerSettings& c) {
  return fmt::format(
      R"(
FLEXOR_INLINE int16_t rest(uint8_t finger) {{ return core::table(kRest[finger]); }}
FLEXOR_INLINE hand::FingerSettings settings(uint8_t finger) {{
  const Reach& r = kReach[pgm_read_byte(&kReachOf[finger])];
  return {{{{core::table(r.lower), core::table(r.upper), {}L, {}, {}, {}L, {}, {}}},
          {{{}, {}, core::table(r.low), core::table(r.high)}},
          {}L,
          {{{}, {}, {}, {}, {}, {}, {}, {}}}}};
}}
)",
      c.loop.max_step, c.loop.proportional, c.loop.integral, c.loop.integral_limit, c.loop.duty_limit,
      c.loop.feed_forward, c.potentiometer.scale, c.potentiometer.offset, c.careful_step, c.motor.rate,
      c.motor.gain, c.motor.friction, c.motor.load, c.motor.forget, c.motor.gap, c.motor.breakaway,
      c.motor.kick);
}

}  // namespace

std::string hand_config(const Hand& hand) {
  std::string out = fmt::format(kHead, FLEXOR_VERSION);
  out +=
      "#include \"runtime/hand/finger.hpp\"\n#include \"runtime/link/key_record.hpp\"\n\nnamespace flexor "
      "{\nnamespace config {\n\n";
  out += fmt::format("constexpr uint16_t kUartDivisor = {};\n", uart_divisor(hand.baud));
  out += key_text(hand.key);
  // Fingers with the same joint share it.
  std::vector<std::string> reaches;
  std::array<std::ptrdiff_t, kFingers> of{};
  std::array<std::int16_t, kFingers> rest{};
  for (int i = 0; i < kFingers; ++i) {
    const hand::FingerSettings c = finger_settings(hand, i);
    const std::string text = fmt::format("{{{}, {}, {}, {}}}", c.loop.lower, c.loop.upper,
                                         c.potentiometer.low, c.potentiometer.high);
    const auto f = static_cast<std::size_t>(i);
    rest[f] = q4(std::clamp(hand.rest_deg[f], hand.lower_deg[f], hand.upper_deg[f]));
    const auto known = std::ranges::find(reaches, text);
    of[f] = known - reaches.begin();
    if (known == reaches.end()) reaches.push_back(text);
  }
  out += fmt::format(
      R"(
struct Reach {{
  int16_t lower, upper;
  uint16_t low, high;
}};
const Reach kReach[] PROGMEM = {{{}}};
const uint8_t kReachOf[] PROGMEM = {};  // thumb to pinky
const int16_t kRest[] PROGMEM = {};
)",
      fmt::join(reaches, ", "), model::braces(of.data(), kFingers), model::braces(rest.data(), kFingers));
  out += common_settings(finger_settings(hand, 0));
  return out + "\n}  // namespace config\n}  // namespace flexor\n";
}

}  // namespace flexor::deploy
