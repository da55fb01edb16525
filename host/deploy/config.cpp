#include "host/deploy/config.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "host/io/io.hpp"
#include "host/model/coefficients.hpp"
#include "runtime/link/opengloves.hpp"

namespace flexor::deploy {
namespace {

using io::InputError;

constexpr double kRail_s = 0.1;   // on a rail for so long: dead. A scratch is forgiven
constexpr double kStuck_s = 0.5;  // the very same reading for so long: dead
constexpr double kHold_s = 0.25;
constexpr double kGuardSpeed_deg_s = 200;
constexpr int kPotentiometerMargin = 5;  // counts from either rail

int frame_bytes(const Key& key) { return key ? link::kWireSealed : link::kWirePlain; }

std::int16_t q4(double deg) { return static_cast<std::int16_t>(std::lround(deg * 16)); }

std::string numbers(const auto* first, std::size_t count) {
  std::string out;
  for (std::size_t i = 0; i < count; ++i) out += fmt::format("{}{}", i > 0 ? ", " : "", first[i]);
  return "{" + out + "}";
}

template <int kCapacity>
std::string text_of(const compensator::FixedCurve<kCapacity>& c, int count) {
  const auto n = static_cast<std::size_t>(std::max(count, 1));
  return fmt::format("{{{}, {}, {}, {}, {}}}", c.count, c.slope_shift, numbers(c.x, n), numbers(c.y, n),
                     numbers(c.slope, n));
}

std::string weights(const compensator::FixedWeight* first, int count) {
  std::string out;
  for (int i = 0; i < count; ++i)
    out += fmt::format("{}{{{}, {}}}", i > 0 ? ", " : "", first[i].mantissa, first[i].shift);
  return "{" + out + "}";
}

// One finger's shape, as small as the channel allows, and its coefficients.
template <int kOrder>
std::string channel_text(const model::Channel& channel, double period_s, int finger) {
  const bool taps = channel.lti.poles_rad_s.empty() ||
                    std::ranges::any_of(channel.lti.taps, [](double tap) { return tap != 0; });
  const auto c = [&] {
    // Capacities do not touch coefficients; only the taps' block has two kinds.
    using Shape = compensator::Shape<model::kMaxPlays, model::kMaxKnots, kOrder, model::kMaxKnots, true>;
    return model::fixed_coefficients<Shape>(channel, period_s);
  }();
  const int plays = c.hysteresis.plays.count;
  const int knots_in = c.input_curve.count;
  const int knots_out = c.output_curve.count;
  const auto at_least_one = [](int n) { return static_cast<std::size_t>(std::max(n, 1)); };
  std::string out = fmt::format(
      "// {}\nusing Shape{} = compensator::Shape<{}, {}, {}, {}, {}>;\n"
      "using Channel{} = compensator::Channel<compensator::Fixed<Shape{}>, Shape{}>;\n",
      channel.name, finger, plays, knots_in, kOrder, knots_out, taps, finger, finger, finger);
  out += fmt::format("constexpr Channel{}::Coefficients kCoefficients{} PROGMEM = {{\n", finger, finger);
  out += fmt::format("    {}, {},  // valid inputs, Q5\n    {{{}, {}}}, {},  // dead zone, refinement\n",
                     c.valid_min, c.valid_max, c.dead_zone.lower, c.dead_zone.upper, c.refinement);
  out += fmt::format("    {{{{{}, {}}}, {}}},  // hysteresis\n", plays,
                     numbers(c.hysteresis.plays.radius, at_least_one(plays)),
                     numbers(c.hysteresis.weight, at_least_one(plays)));
  out += fmt::format("    {},  // curve\n", text_of(c.input_curve, knots_in));
  out += fmt::format("    {{{}, {}, {}L, {}, {}, {}, {}, {}, {{{}, {}}}}},  // LTI\n", c.lti.gain,
                     c.lti.gain_shift, c.lti.offset, weights(c.lti.input_weight, kOrder),
                     weights(c.lti.chain_weight, kOrder * (kOrder - 1) / 2 + 1), numbers(c.lti.tap, kOrder),
                     c.lti.tap_fraction, c.lti.is_direct, numbers(c.lti.direct.b, kOrder),
                     numbers(c.lti.direct.a, kOrder));
  out +=
      fmt::format("    {}, {},  // output curve\n", text_of(c.output_curve, knots_out), c.output_curve_shift);
  return out + fmt::format("    {}, {}, {}}};  // saturation and rest, Q4\n\n", c.lower, c.upper, c.rest);
}

std::string channel_text(const model::Channel& channel, double period_s, int finger) {
  switch (model::detail::order_at(channel.lti, period_s)) {
    case 0:  // a static gain is a first order whose tap passes all of the input, here as on the host
    case 1:
      return channel_text<1>(channel, period_s, finger);
    case 2:
      return channel_text<2>(channel, period_s, finger);
    default:
      return channel_text<3>(channel, period_s, finger);
  }
}

std::string key_text(const Key& key) {
  if (!key) return "constexpr const link::Key* kKey = nullptr;  // plain frames\n";
  return fmt::format("const link::Key kPair = {{{}}};\nconstexpr const link::Key* kKey = &kPair;\n",
                     numbers(key->bytes, 16));
}

constexpr const char* kHead = "// Written by flexor deploy {}; not to be edited.\n#pragma once\n\n";

}  // namespace

std::array<const model::Channel*, kFingers> channels_of(const model::Model& model) {
  std::array<const model::Channel*, kFingers> out{};
  for (const model::Channel& channel : model.channels) {
    const auto& names = model::finger_names();
    const auto at = std::ranges::find(names, channel.name) - names.begin();
    if (at < kFingers) out[static_cast<std::size_t>(at)] = &channel;
  }
  return out;
}

namespace {

double value_at(const CountsAsTheyAre&, double counts) { return counts; }

double value_at(const Divider& d, double counts) {
  constexpr double kTop = sensor::kAdcTop;
  if (counts >= kTop) return 1e9;
  return (d.fixed_kohm * counts / (kTop - counts) - d.flat_kohm) / d.kohm_per_deg;
}

double value_at(const Points& p, double n) {
  std::size_t i = 1;
  while (i + 1 < p.counts.size() && n > p.counts[i]) ++i;
  return p.value[i - 1] +
         (p.value[i] - p.value[i - 1]) * (n - p.counts[i - 1]) / (p.counts[i] - p.counts[i - 1]);
}

}  // namespace

double Sensor::operator()(double counts) const {
  return std::visit([&](const auto& sensor) { return value_at(sensor, counts); }, kind);
}

Sensor divider(double fixed_kohm, double flat_kohm, double kohm_per_deg) {
  return {Divider{fixed_kohm, flat_kohm, kohm_per_deg}};
}

bool reads_alpha(const model::Channel& channel) {
  return channel.input_unit == "deg" && channel.input_column.ends_with("_alpha");
}

Sensor counts_as_they_are() { return {CountsAsTheyAre{}}; }

Sensor through_points(std::vector<double> counts, std::vector<double> value) {
  return {Points{std::move(counts), std::move(value)}};
}

int sample_rate_hz(const model::Model& model) {
  const double rate = 1 / model.sample_period_s;
  for (const int known : {10, 20, 50, 100}) {
    if (std::abs(rate - known) < 1e-6 * known) return known;
  }
  throw InputError(
      fmt::format("a sample rate of {:g} Hz: the firmware has builds for 10, 20, 50 and 100 Hz", rate));
}

int samples_per_frame(const Glove& glove) {
  const int rate = sample_rate_hz(glove.model);
  if (glove.output == Output::opengloves) return 1;
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
  const int rate = sample_rate_hz(glove.model);
  const auto channels = channels_of(glove.model);
  GloveTables out;
  for (std::size_t i = 0; i < kFingers; ++i) {
    sensor::MonitorSettings& monitor = out.monitor[i];
    monitor.rail_samples = static_cast<std::uint8_t>(std::max(1.0, std::round(kRail_s * rate)));
    monitor.stuck_samples = static_cast<std::uint8_t>(std::round(kStuck_s * rate));
    sensor::GuardSettings& guard = out.guard[i];
    guard.hold_samples = static_cast<std::uint16_t>(std::ceil(kHold_s * rate));
    guard.max_step = q4(kGuardSpeed_deg_s / rate);
    const model::Channel* channel = channels[i];
    if (channel == nullptr) {
      monitor.high = 0;  // no strip: open, always
      continue;
    }
    guard.rest =
        q4(std::clamp(channel->rest_deg, channel->saturation.lower_deg, channel->saturation.upper_deg));
    const model::Saturation& saturation = channel->saturation;
    out.straight[i] = q4(std::max(saturation.lower_deg, 0.0));
    const double range = std::max(1.0, 16 * saturation.upper_deg - out.straight[i]);
    out.flexion_scale[i] = static_cast<std::uint32_t>(std::ceil(link::kGloveTop * 65536 / range));
    for (std::size_t k = 0; k < sensor::kKnots; ++k) {
      const double u = glove.sensor[i](16.0 * static_cast<double>(k));
      out.calibration[i].alpha[k] =
          static_cast<std::int16_t>(std::lround(32 * std::clamp(u, -1023.0, 1023.0)));
    }
    // Readings that the model refuses are the rails.
    const auto accepted = [&](int n) {
      const double u = out.calibration[i](static_cast<std::uint16_t>(n)) / 32.0;
      return u >= channel->valid_min && u <= channel->valid_max;
    };
    int low = 0;
    while (low < sensor::kAdcTop && !accepted(low)) ++low;
    int high = sensor::kAdcTop;
    while (high > 0 && !accepted(high)) --high;
    if (low >= high) {
      throw InputError(fmt::format("channel {}: no ADC reading lies within its valid inputs {:g} to {:g} {}",
                                   channel->name, channel->valid_min, channel->valid_max,
                                   channel->input_unit));
    }
    monitor.low = static_cast<std::uint16_t>(std::max(low - 1, 0));
    monitor.high = static_cast<std::uint16_t>(std::min(high + 1, static_cast<int>(sensor::kAdcTop)));
  }
  return out;
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
  c.potentiometer.low = kPotentiometerMargin;
  c.potentiometer.high = sensor::kAdcTop - kPotentiometerMargin;
  c.careful_step = step(hand.careful_deg_s);
  c.stall_duty = int16(0.5 * hand.duty * hand::kFullDuty);
  c.stall_ticks = static_cast<std::uint16_t>(std::min(hand.stall_s / kTick_s, 65535.0));
  c.stall_travel = q4(1);
  return c;
}

namespace {

std::string glove_head(const Glove& glove, const GloveTables& tables) {
  const bool radio = glove.output == Output::radio;
  std::string out = fmt::format(kHead, FLEXOR_VERSION);
  // No text of the model's: what ends a comment, or goes on after it, would be compiled.
  out += fmt::format("// model {}\n", io::digest(model::to_json(glove.model)));
  if (glove.assembly) out += "#define FLEXOR_AVR_ASSEMBLY\n";
  if (!radio) out += "#define FLEXOR_OUTPUT_OPENGLOVES\n";
  out +=
      "#include <avr/pgmspace.h>\n\n#include \"firmware/board.hpp\"\n#include "
      "\"firmware/glove/signal_chain.hpp\"\n"
      "#include \"runtime/compensator/channel.hpp\"\n\nnamespace flexor {\nnamespace config {\n\n";
  out += fmt::format(
      "constexpr uint16_t kRate_hz = {};\nconstexpr uint8_t kSamplesPerFrame = {};\nconstexpr uint16_t "
      "kUartDivisor = {};\n",
      sample_rate_hz(glove.model), samples_per_frame(glove), uart_divisor(radio ? glove.baud : kUsbBaud));
  if (radio) {
    out += key_text(glove.key);
  } else {
    out += fmt::format("constexpr int16_t kStraight[] = {};\nconstexpr uint32_t kFlexionScale[] = {};\n",
                       numbers(tables.straight.data(), kFingers),
                       numbers(tables.flexion_scale.data(), kFingers));
  }
  return out + "\n";
}

std::string sensor_tables(const GloveTables& tables) {
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
                         numbers(tables.calibration[i].alpha, sensor::kKnots));
    }
  }
  out += "\nconstexpr firmware::ChannelSettings kChannels[] = {\n";
  for (std::size_t i = 0; i < kFingers; ++i) {
    const sensor::MonitorSettings& m = tables.monitor[i];
    const sensor::GuardSettings& g = tables.guard[i];
    out += fmt::format("    {{&kCalibration{}, {{{}, {}, {}, {}}}, {{{}, {}, {}}}}},\n", table[i], m.low,
                       m.high, m.rail_samples, m.stuck_samples, g.rest, g.max_step, g.hold_samples);
  }
  return out + "};\n\n";
}

}  // namespace

std::string glove_config(const Glove& glove) {
  const double period_s = glove.model.sample_period_s;
  const auto channels = channels_of(glove.model);
  const GloveTables tables = glove_tables(glove);
  std::string out = glove_head(glove, tables) + sensor_tables(tables);
  std::string states;
  std::string resets;
  std::string steps;
  for (int i = 0; i < kFingers; ++i) {
    if (channels[static_cast<std::size_t>(i)] == nullptr) continue;
    out += channel_text(*channels[static_cast<std::size_t>(i)], period_s, i);
    states += fmt::format("  config::Channel{}::State state{}_;\n", i, i);
    resets += fmt::format("    angle[{0}] = config::Channel{0}::rest(config::kCoefficients{0});\n", i);
    steps += fmt::format(
        "    if (config::Channel{0}::step(config::kCoefficients{0}, state{0}_, started, {1}, alpha[{0}], "
        "angle[{0}]) == "
        "core::Status::ok) good |= {1};\n",
        i, 1 << i);
  }
  out +=
      "}  // namespace config\n\nclass GloveCompensator {\n public:\n  int16_t alpha[firmware::kFingers] = "
      "{};\n  int16_t angle[firmware::kFingers] = {};\n\n  GloveCompensator() {\n" +
      resets +
      "  }\n\n  uint8_t step() {\n"
      "    firmware::mark(firmware::Marker::step_begin);\n    const uint8_t good = run();\n"
      "    firmware::mark(firmware::Marker::step_end);\n    return good;\n  }\n\n private:\n"
      "  __attribute__((noinline)) uint8_t run() {\n"
      "    uint8_t good = 0;\n    uint8_t started = started_;\n" +
      steps + "    started_ = started;\n    return good;\n  }\n\n" + states +
      "  uint8_t started_ = 0;\n};\n\n}  // namespace flexor\n";
  return out;
}

std::string hand_config(const Hand& hand) {
  std::string out = fmt::format(kHead, FLEXOR_VERSION);
  out +=
      "#include \"runtime/hand/finger.hpp\"\n#include \"runtime/link/siphash.hpp\"\n\nnamespace flexor "
      "{\nnamespace config {\n\n";
  out += fmt::format("constexpr uint16_t kUartDivisor = {};\n", uart_divisor(hand.baud));
  out += key_text(hand.key);
  // Fingers with the same settings share them.
  std::vector<std::string> settings;
  std::array<std::ptrdiff_t, kFingers> of{};
  std::array<std::int16_t, kFingers> rest{};
  for (int i = 0; i < kFingers; ++i) {
    const hand::FingerSettings c = finger_settings(hand, i);
    const std::string text =
        fmt::format("    {{{{{}, {}, {}L, {}, {}, {}L, {}, {}}}, {{{}, {}, {}, {}}}, {}L, {}, {}, {}}},\n",
                    c.loop.lower, c.loop.upper, c.loop.max_step, c.loop.proportional, c.loop.integral,
                    c.loop.integral_limit, c.loop.duty_limit, c.loop.feed_forward, c.potentiometer.scale,
                    c.potentiometer.offset, c.potentiometer.low, c.potentiometer.high, c.careful_step,
                    c.stall_duty, c.stall_ticks, c.stall_travel);
    const auto f = static_cast<std::size_t>(i);
    rest[f] = q4(std::clamp(hand.rest_deg[f], hand.lower_deg[f], hand.upper_deg[f]));
    const auto known = std::ranges::find(settings, text);
    of[f] = known - settings.begin();
    if (known == settings.end()) settings.push_back(text);
  }
  out += fmt::format(
      "\nconst hand::FingerSettings kSettings[] = {{\n{}}};\nconst uint8_t kSettingsOf[] = {};  // thumb to "
      "pinky\n"
      "const int16_t kRest[] = {};\n",
      fmt::join(settings, ""), numbers(of.data(), kFingers), numbers(rest.data(), kFingers));
  return out + "\n}  // namespace config\n}  // namespace flexor\n";
}

}  // namespace flexor::deploy
