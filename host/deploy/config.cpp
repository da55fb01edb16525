#include "host/deploy/config.hpp"

#include <algorithm>
#include <cmath>

#include "host/deploy/model_block.hpp"
#include "host/io/io.hpp"
#include "host/model/fixed_error.hpp"
#include "host/model/kind.hpp"
#include "host/model/tracking.hpp"
#include "runtime/glove/plain_text.hpp"
#include "runtime/glove/signal_chain.hpp"
#include "runtime/link/glove_sender.hpp"
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
constexpr double kTick_s = 0.001;

int frame_bytes(const Key& key) { return link::frame_bytes(key.has_value()); }

std::int16_t int16(double v) { return static_cast<std::int16_t>(std::lround(std::clamp(v, 0.0, 32767.0))); }

std::int16_t q4(double deg) { return static_cast<std::int16_t>(std::lround(deg * 16)); }

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

// Without `track`, and for sensors without poses, none is tracked.
std::array<glove::TrackedSensor, kFingers> tracked_sensors(const Glove& glove) {
  std::array<glove::TrackedSensor, kFingers> out{};
  if (!glove.track) return out;
  const model::Wiring wiring = model::wiring_of(glove.model);
  const std::vector<std::optional<model::TrackedRange>> ranges = model::tracked_ranges(glove.model);
  for (std::size_t i = 0; i < kFingers; ++i) {
    if (wiring.input[i]) out[i] = model::tracked_from<glove::Tracking>(ranges[*wiring.input[i]], {});
  }
  return out;
}

hand::MotorSettings motor_settings(const HandMotor& motor) {
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

void set_timing(const Glove& glove, glove::SettingsHead& c) {
  const int rate_hz = sample_rate_hz(glove.model);
  const bool radio = glove.output == Output::radio;
  c.rate_hz = static_cast<std::uint8_t>(rate_hz);
  c.period_ms = static_cast<std::uint16_t>(1000 / rate_hz);
  c.timer_top = static_cast<std::uint16_t>(kClock_hz / 64 / rate_hz - 1);
  const int divisor = uart_divisor(radio ? glove.baud : kUsbBaud);
  c.uart_divisor = static_cast<std::uint16_t>(divisor);
  c.samples_per_frame = static_cast<std::uint8_t>(samples_per_frame(glove));
  const link::Turns turns = radio ? turns_of(glove) : link::Turns{1, 1, 0};
  c.listen_every = turns.every;
  c.seek_every = turns.seek_every;
  c.listen_slots = turns.slots;
  const auto baud = static_cast<std::uint32_t>(kClock_hz / 8 / (divisor + 1));
  c.has_room = link::has_room(baud, static_cast<std::uint8_t>(rate_hz / c.samples_per_frame)) ? 1 : 0;
  c.samples_per_tick = static_cast<std::uint8_t>(model::samples_per_tick(glove.model.sample_period_s));
}

void set_pins(const Pins& pins, glove::SettingsHead& c) {
  const std::vector<int> scan = model::scan_of(pins);
  c.scan_count = static_cast<std::uint8_t>(scan.size());
  for (std::size_t i = 0; i < scan.size(); ++i) {
    c.scan[i] = static_cast<std::uint8_t>(scan[i]);
    if (scan[i] < 6) c.analog_pins = static_cast<std::uint8_t>(c.analog_pins | 1U << scan[i]);
  }
  for (std::size_t i = 0; i < model::kButtons; ++i) {
    c.button[i] = static_cast<std::uint8_t>(pins.button[i].value_or(glove::kNoPin));
    c.button_bit[i] = model::buttons()[i].bit;
  }
}

}  // namespace

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
      "a sample rate of {:g} Hz: a glove samples at 10, 20, 50 or 100 Hz: --rate takes one of them", rate);
}

std::vector<BoardOutput> outputs_of(const Glove& glove) {
  const model::Model& m = glove.model;
  const model::Wiring wiring = model::wiring_of(m);
  std::vector<BoardOutput> out;
  const auto add = [&](std::size_t joint, std::size_t number, std::size_t finger, std::uint8_t place) {
    const model::Ends ends = model::ends(m, m.joints[joint]);
    out.push_back({joint,
                   {static_cast<std::uint8_t>(number), place, static_cast<std::uint8_t>(finger),
                    model::sensors_of(m, wiring, joint), model::guard_of(m, m.joints[joint]).rest,
                    q4(ends.open_deg), q4(ends.fist_deg)}});
  };
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (wiring.joint[f]) add(*wiring.joint[f], f, f, 0);
  }
  if (glove.output != Output::opengloves || glove.encoding == Encoding::alpha) return out;
  std::size_t number = kFingers;
  for (std::size_t f = 0; f < kFingers; ++f) {
    for (std::size_t j = 0; j < m.joints.size(); ++j) {
      const auto place = place_of(model::finger_names()[f], m.joints[j].name);
      if (place && wiring.joint[f] != j) add(j, number++, f, *place);
    }
  }
  return out;
}

int line_bytes(const Glove& glove) {
  if (glove.output != Output::opengloves) return glove::kMaxPlainText;
  const auto further = std::ranges::count_if(
      outputs_of(glove), [](const BoardOutput& o) { return o.output.number >= kFingers; });
  return link::kMaxGloveText + static_cast<int>(further) * link::kMaxJointText;
}

int samples_per_frame(const Glove& glove) {
  const int rate = sample_rate_hz(glove.model);
  if (glove.output != Output::radio) {
    const double line_s = line_bytes(glove) * 10 / kUsbBaud;
    if (line_s <= glove.model.sample_period_s) return 1;
    throw InputError(
        "a line of up to {} bytes takes {:.1f} ms at {:g} baud, which is fixed, and the glove "
        "samples every {:g} ms: lower --rate, or --encoding alpha sends the fingers alone",
        line_bytes(glove), 1000 * line_s, kUsbBaud, 1000 * glove.model.sample_period_s);
  }
  if (glove.key && glove.baud < kLeastBaudWithKey) {
    throw InputError("a radio of {:g} baud is too slow for a key, which wants {:g}: raise radio.baud",
                     glove.baud, kLeastBaudWithKey);
  }
  const int bytes = frame_bytes(glove.key);
  const double carried_hz = glove.baud / 10 / bytes;
  if (glove.frame_rate_hz == 0) {
    for (int n = 1; n <= rate; ++n) {
      if (rate % n == 0 && rate <= n * carried_hz) return n;
    }
    throw InputError(
        "a radio of {:g} baud carries {:.2f} frames of {} bytes a second, the glove sends at "
        "least one: raise radio.baud",
        glove.baud, carried_hz, bytes);
  }
  if (glove.frame_rate_hz > carried_hz) {
    throw InputError(
        "{:g} frames of {} bytes a second do not fit a radio of {:g} baud, which carries {:.1f}: "
        "lower radio.frame_rate_hz or raise radio.baud",
        glove.frame_rate_hz, bytes, glove.baud, carried_hz);
  }
  const double every = rate / glove.frame_rate_hz;
  if (every < 1 || std::abs(every - std::round(every)) > 1e-9 || every > 255) {
    throw InputError("{:g} frames a second from {} samples: radio.frame_rate_hz must divide the sample rate",
                     glove.frame_rate_hz, rate);
  }
  return static_cast<int>(std::lround(every));
}

bool can_zero(const Glove& glove) {
  return glove.pins.button[kCalibrate].has_value() &&
         std::ranges::any_of(glove.model.inputs, [](const auto& input) { return input.poses.has_value(); });
}

void check_tracking(const Glove& glove) {
  if (!glove.track) return;
  const auto tracked = tracked_sensors(glove);
  if (std::ranges::any_of(tracked, [](const glove::TrackedSensor& one) { return one.half != 0; })) return;
  throw InputError(
      "--track: no joint has one sensor whose readings at the open hand and at the fist are known: identify "
      "it again, each joint with its own sensor, from a recording with both, or leave out --track");
}

link::Turns turns_of(const Glove& glove) {
  constexpr double kApart_s = 0.5;      // of two turns, at most
  constexpr double kSeekApart_s = 0.2;  // while nothing of the hand is received
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
    return static_cast<std::uint8_t>(std::clamp(std::floor(apart_s / period_s) - slots, 1.0, 255.0));
  };
  return {every(kApart_s), every(kSeekApart_s), static_cast<std::uint8_t>(std::min(slots, 255.0))};
}

int uart_divisor(double baud) {
  constexpr double kWorst = 0.025;
  const double exact = kClock_hz / (8 * baud) - 1;
  const double divisor = std::clamp(std::round(exact), 0.0, 4095.0);
  const double error = std::abs(kClock_hz / (8 * (divisor + 1)) / baud - 1);
  if (!(baud > 0) || !(error <= kWorst)) {
    throw InputError(
        "{:g} baud cannot be made from a clock of 16 MHz (nearest is {:.1f} % off); usual rates "
        "from 1200 to 115200 can",
        baud, 100 * error);
  }
  return static_cast<int>(divisor);
}

GloveTables glove_tables(const Glove& glove) {
  (void)sample_rate_hz(glove.model);
  model::Sensors sensors;
  std::ranges::copy(glove.sensor, sensors.begin());
  return model::glove_tables(glove.model, sensors);
}

model::ChainParts chain_parts(const Glove& glove) {
  std::vector<std::size_t> further;
  for (const BoardOutput& o : outputs_of(glove)) {
    if (o.output.number >= kFingers) further.push_back(o.joint);
  }
  return {glove_tables(glove), model::HostCompensator(glove.model, further), tracked_sensors(glove),
          model::samples_per_tick(glove.model.sample_period_s)};
}

hand::Settings hand_settings(const Hand& hand) {
  const model::Hardware& h = hand.hardware;
  const auto step = [](double deg_s) {
    return static_cast<std::int32_t>(std::lround(std::min(deg_s * kTick_s, 1000.0) * (1 << 20)));
  };
  hand::Settings c{};
  c.kind = hand::Settings::kKind;
  c.uart_divisor = static_cast<std::uint16_t>(uart_divisor(h.baud));
  c.max_step = step(h.loop_speed_deg_s);
  c.proportional = int16(h.loop_proportional_per_deg * hand::kFullDuty);
  c.integral = int16(h.loop_integral_per_deg_s * kTick_s * hand::kFullDuty * 256);
  c.integral_limit = static_cast<std::int32_t>(std::lround(h.loop_integral_limit * hand::kFullDuty * 256));
  c.duty_limit = int16(h.loop_duty * hand::kFullDuty);
  c.feed_forward = int16(h.loop_feed_forward_s_per_deg / kTick_s * hand::kFullDuty);
  c.scale = static_cast<std::uint32_t>(std::lround(16 * h.potentiometer_range_deg / 1023 * 65536));
  c.careful_step = step(hand.careful_deg_s);
  if (hand.motor.full_speed_deg_s > 0) c.motor = motor_settings(hand.motor);
  const double counts_per_deg = sensor::kAdcTop / h.potentiometer_range_deg;
  const auto counts = [&](double deg) {
    return static_cast<std::uint16_t>(std::lround(std::clamp<double>(
        deg * counts_per_deg, kPotentiometerMargin, sensor::kAdcTop - kPotentiometerMargin)));
  };
  for (std::size_t i = 0; i < kFingers; ++i) {
    const double lower_deg = hand.lower_deg[i];
    const double upper_deg = hand.upper_deg[i];
    c.reach[i] = {q4(lower_deg), q4(upper_deg), q4(std::clamp(hand.rest_deg[i], lower_deg, upper_deg)),
                  counts(lower_deg - hand.reach_deg), counts(upper_deg + hand.reach_deg)};
  }
  return c;
}

glove::Settings glove_settings(const Glove& glove) {
  check_tracking(glove);
  const GloveTables tables = glove_tables(glove);
  glove::Settings out{};
  glove::SettingsHead& c = out.head;
  c.kind = glove::Settings::kKind;
  c.output = glove.output;
  c.vr = static_cast<std::uint8_t>((glove.right_hand ? glove::kRightHand : 0) |
                                   (glove.encoding == Encoding::beta ? glove::kFurtherJoints : 0));
  set_timing(glove, c);
  set_pins(glove.pins, c);
  c.rail_samples = tables.monitor[0].rail_samples;
  c.stuck_samples = tables.monitor[0].stuck_samples;
  c.hold_samples = tables.guard[0].hold_samples;
  c.max_step = tables.guard[0].max_step;
  c.tracker = model::tracker_settings<glove::Tracking>({});
  std::ranges::copy(calibration_ids(tables), c.calibration_id);
  std::array<glove::ChannelSettings, kFingers> channels{};
  for (std::size_t i = 0; i < kFingers; ++i) channels[i].poses = tables.poses[i];
  c.tracked_for = glove::poses_id(channels.data());
  std::ranges::copy(tracked_sensors(glove), out.tracked);
  std::ranges::copy(tables.calibration, out.calibration);
  return out;
}

Error fixed_point_error(const model::Model& model, const std::vector<std::vector<double>>& recording) {
  Error out;
  const std::vector<double> range_deg = model::worst_fixed_error_deg(model);
  const std::vector<double> recording_deg = model::fixed_error_deg(model, recording);
  out.range_deg = std::ranges::max(range_deg);
  if (!recording.empty()) out.recording_deg = std::ranges::max(recording_deg);
  for (std::size_t j = 0; j < range_deg.size(); ++j) {
    const double allowed_deg = model::allowed_fixed_error_deg(model.joints[j]);
    const double worst_deg = std::max(range_deg[j], recording_deg[j]);
    if (worst_deg <= allowed_deg) continue;
    throw InputError(
        "model {:?}: {} is up to {:.4f} degree off in fixed point, more than the {:.4f} allowed: "
        "steep curves and large gains cost precision",
        model.name, model.joints[j].name, worst_deg, allowed_deg);
  }
  return out;
}

}  // namespace flexor::deploy
