#include "cosim/replay.hpp"

#include <algorithm>
#include <cmath>
#include <deque>

#include "cosim/radio_ear.hpp"
#include "firmware/markers.hpp"
#include "host/deploy/images.hpp"
#include "host/twin/plant_step.hpp"
#include "host/twin/random.hpp"
#include "runtime/glove/glove_text.hpp"
#include "runtime/glove/plain_text.hpp"
#include "runtime/link/hand_end.hpp"
#include "runtime/link/opengloves.hpp"

namespace flexor::cosim {
namespace {

using firmware::Marker;

// "ldi, out" of the closing marker: the opening one ends where the measurement begins.
constexpr std::uint64_t kMarkerCycles = 2;

// What is done to joystick and buttons while sample k is taken.
std::array<std::uint16_t, 2> joystick_counts(const deploy::Glove& glove, std::size_t k) {
  if (!glove.pins.joystick) return {link::kGloveMiddle, link::kGloveMiddle};
  return {static_cast<std::uint16_t>(37 * k % 1024), static_cast<std::uint16_t>(480 + k % 64)};
}

bool is_pressed(std::size_t button, std::size_t k) { return (k / 3 + button) % 4 == 0; }

std::uint8_t pressed(const deploy::Glove& glove, std::size_t k) {
  unsigned out = 0;
  for (std::size_t b = 0; b < model::kButtons; ++b) {
    if (glove.pins.button[b] && is_pressed(b, k)) out |= model::buttons()[b].bit;
  }
  return static_cast<std::uint8_t>(out);
}

// Presses the buttons on the board for sample k.
void press(Board& board, const model::Pins& pins, std::size_t k) {
  for (std::size_t b = 0; b < model::kButtons; ++b) {
    if (pins.button[b]) board.set_pin(*pins.button[b], !is_pressed(b, k));
  }
}

// What a conversion of this channel reads while sample k is taken.
int counts_of(const deploy::Glove& glove, const std::array<int, deploy::kFingers>& sensors, int channel,
              std::size_t k) {
  const std::vector<int> scan = model::scan_of(glove.pins);
  const auto at = static_cast<std::size_t>(std::ranges::find(scan, channel) - scan.begin());
  if (at < sensors.size()) return sensors[at];
  return at < scan.size() ? joystick_counts(glove, k)[at - sensors.size()] : 0;
}

// The host's side: what the image must send, to the byte.
class Expected {
 public:
  explicit Expected(const deploy::Glove& glove)
      : glove_(glove), settings_(deploy::glove_settings(glove).head), chain_(deploy::chain_parts(glove)) {
    leaving_.all = deploy::outputs_of(glove);
    if (!glove.key) return;
    session_.start(kNonce);
    while (!session_.ready()) session_.derive(*glove.key);
  }

  Expected(const Expected&) = delete;
  Expected& operator=(const Expected&) = delete;

  // What the hand would send first.
  std::vector<std::uint8_t> challenge() const {
    if (!glove_.key || glove_.output != deploy::Output::radio) return {};
    link::Packet packet;
    std::ranges::copy(kNonce.bytes, packet.body());
    std::vector<std::uint8_t> wire(link::kMaxWire);
    wire.resize(
        packet.seal({link::Type::challenge, false, false, 0}, link::kNonceBytes, &*glove_.key, wire.data()));
    return wire;
  }

  void sample(const std::array<int, deploy::kFingers>& counts) {
    frame_ = chain_.step(counts);
    std::ranges::copy(counts, counts_.begin());
    ++samples_;
  }

  // One of them: the board decides whether a frame leaves the hand its turn.
  std::array<std::string, 2> messages() {
    if (glove_.output != deploy::Output::radio) {
      const std::string text = line();
      return {text, text};
    }
    frame_.counter = messages_++;
    frame_.time_ms = static_cast<std::uint16_t>(std::lround(1000 * glove_.model.sample_period_s) * samples_);
    return {encoded(false), encoded(true)};
  }

 private:
  std::string encoded(bool listens) const {
    std::array<std::uint8_t, link::kMaxWire> wire{};
    const std::uint8_t size =
        link::encode(frame_, listens, glove_.key ? &session_.key() : nullptr, wire.data());
    return {wire.begin(), wire.begin() + size};
  }
  std::string line() {
    std::array<char, glove::GloveText::kRoom> text{};
    if (glove_.output != deploy::Output::opengloves)
      return {text.data(), plain_.step(frame_, counts_.data(), text.data())};
    const auto sample = static_cast<std::size_t>(samples_ - 1);
    const std::array<std::uint16_t, 2> joystick = joystick_counts(glove_, sample);
    const sensor::GuardSettings guard = {0, settings_.max_step, settings_.hold_samples};
    leaving_.angle = chain_.joint_angles() - deploy::kFingers;
    return {text.data(),
            text_.step(leaving_, frame_, guard, joystick.data(), pressed(glove_, sample), text.data())};
  }

  static constexpr link::Nonce kNonce = {{1, 2, 3, 4, 5, 6, 7, 8}};

  const deploy::Glove& glove_;
  link::Session session_;
  // As GloveText asks.
  struct Leaving {
    std::vector<deploy::BoardOutput> all;
    const std::int16_t* angle = nullptr;
    std::uint8_t outputs() const { return static_cast<std::uint8_t>(all.size()); }
    compensator::Output output(std::uint8_t k) const { return all[k].output; }
  };

  glove::SettingsHead settings_;
  model::HostChain chain_;
  Leaving leaving_;
  glove::GloveText text_;
  glove::PlainText plain_{settings_.output == deploy::Output::log, settings_.period_ms};
  std::array<std::uint16_t, deploy::kFingers> counts_{};
  link::Frame frame_{};
  long samples_ = 0;
  std::uint32_t messages_ = 0;
};

constexpr Cycles kSwitchedOn = 60 * kCyclesPerMs;  // the UART is up, a model is loaded

// What a glove sends that waits for a challenge, which begins with a delimiter. COBS: the first byte is a distance, the
// next the frame's first.
bool is_state(const deploy::Glove& glove, const std::string& wire) {
  return glove.output == deploy::Output::radio &&
         (wire.size() == 1 || (wire[1] & 15) == static_cast<int>(link::Type::state));
}

// Until so many are taken; a board that samples no more ends it, too. Then what is on its way.
void run(Board& board, double period_s, std::size_t samples, const std::size_t& taken) {
  const auto end = static_cast<Cycles>(1000 * period_s * static_cast<double>(samples + 20)) * kCyclesPerMs;
  while (taken < samples && board.now() < end) board.run_until(board.now() + kCyclesPerMs);
  board.run_until(board.now() + 100 * kCyclesPerMs);
}

// The twin's motors and joints on a hand's pins: readings that its watch believes, so that no finger is limp.
class Motors {
 public:
  explicit Motors(Board& board) : board_(board) {
    for (int i = 0; i < deploy::kFingers; ++i) {
      x_.lower[i] = static_cast<float>(parameters_.hand_lower_deg[static_cast<std::size_t>(i)]);
      x_.upper[i] = static_cast<float>(parameters_.hand_upper_deg[static_cast<std::size_t>(i)]);
      x_.motor[i] = x_.joint[i] = (x_.lower[i] + x_.upper[i]) / 2;
      x_.noise[i] = 1U + static_cast<std::uint32_t>(i);
    }
  }

  void step() {
    for (int i = 0; i < deploy::kFingers; ++i) {
      twin::detail::move_hand(constants_, x_, i,
                              static_cast<std::int16_t>(std::lround(board_.duty(i) * hand::kFullDuty)));
      board_.set_counts(i, twin::detail::read_potentiometer(constants_, x_, i));
    }
  }

 private:
  Board& board_;
  twin::Parameters parameters_;
  twin::PlantConstants constants_{parameters_};
  twin::PlantState<deploy::kFingers> x_{};
};

}  // namespace

deploy::GloveFigures replay(const deploy::Glove& glove, const Counts& counts,
                            std::vector<std::string>* messages) {
  const Firmware firmware{deploy::glove_flash(glove), deploy::glove_image().symbols};
  deploy::GloveFigures result;
  Expected host(glove);
  std::deque<std::array<std::string, 2>> expected;
  std::string sent;
  const char end = glove.output == deploy::Output::radio ? '\0' : '\n';
  Cycles step_begin = 0;
  Cycles sampled = 0;
  Board board(firmware);
  const auto now_read = [&]() -> const auto& { return counts[std::min(result.samples, counts.size() - 1)]; };
  board.on_sample = [&](Cycles, int channel) {
    return counts_of(glove, now_read(), channel, result.samples);
  };
  board.on_marker = [&](Cycles now, std::uint8_t value) {
    const auto marker = static_cast<Marker>(value);
    if (marker == Marker::step_begin) step_begin = now;
    if (marker == Marker::step_end && result.samples > 1) result.step.add(now - step_begin - kMarkerCycles);
    if (marker == Marker::sampled) {
      sampled = now;
      press(board, glove.pins, result.samples);
      host.sample(now_read());
      ++result.samples;
    }
    if (marker == Marker::frame_sealed) {
      expected.push_back(host.messages());
      result.sample.add(now - sampled);
    }
  };
  board.on_byte = [&](Cycles, std::uint8_t byte) {
    sent += static_cast<char>(byte);
    if (sent.back() != end) return;
    if (is_state(glove, sent)) return sent.clear();
    ++result.frames;
    result.angles += deploy::kFingers;
    if (expected.empty() || (sent != expected.front()[0] && sent != expected.front()[1])) ++result.mismatches;
    if (!expected.empty()) expected.pop_front();
    if (messages != nullptr) messages->push_back(sent);
    sent.clear();
  };
  for (Cycles at = kSwitchedOn; const std::uint8_t byte : host.challenge())
    board.receive(at += byte_cycles(glove.baud), byte);
  run(board, glove.model.sample_period_s, counts.size(), result.samples);
  result.mismatches += counts.size() - std::min(result.samples, counts.size());
  // What did not arrive at all is wrong, too; the last samples' messages may still be on their way.
  constexpr std::size_t kOnTheWay = 2;
  if (expected.size() > kOnTheWay) result.mismatches += expected.size() - kOnTheWay;
  result.stack_bytes = board.stack_bytes();
  result.awake_share = static_cast<double>(board.awake_cycles()) / static_cast<double>(board.now());
  return result;
}

Counts exercise(std::size_t samples, std::uint32_t seed) {
  twin::Random random(seed);
  Counts out(samples);
  std::array<double, deploy::kFingers> level{};
  for (std::size_t k = 0; k < samples; ++k) {
    for (std::size_t i = 0; i < deploy::kFingers; ++i) {
      const auto phase = (k / 50 + i) % 6;
      double& x = level[i];
      if (phase == 0) x = static_cast<double>((k * (i + 3)) % 1024);  // ramp
      if (phase == 1) x += 40 * random.normal();                      // walk
      if (phase == 2 && k % 10 == 0) x = 1023 * random.uniform();     // steps, and stuck in between
      if (phase == 3) x = 1023 * random.uniform();                    // noise
      if (phase == 4) x = 550 + 150 * std::sin(0.1 * static_cast<double>(k)) + random.normal();  // a finger
      if (phase == 5 && k % 50 == 20) x = k % 100 < 50 ? 0 : 1023;  // shorted, unplugged
      x = std::clamp(x, 0.0, 1023.0);
      out[k][i] = static_cast<int>(x);
    }
  }
  return out;
}

deploy::HandFigures measure_hand(const deploy::Hand& settings, double seconds) {
  deploy::HandFigures result;
  const Firmware firmware{deploy::hand_flash(settings), deploy::hand_image().symbols};
  Board board(firmware);
  Cycles begin = 0;
  board.on_marker = [&](Cycles now, std::uint8_t value) {
    if (static_cast<Marker>(value) == Marker::tick_begin) begin = now;
    if (static_cast<Marker>(value) == Marker::tick_end) result.tick.add(now - begin - kMarkerCycles);
  };
  RadioEar hand(settings.key);
  board.on_byte = [&](Cycles, std::uint8_t byte) { hand.hand_sent(byte); };
  twin::Random random(1);
  Motors motors(board);
  link::Frame frame{};
  const auto end = static_cast<Cycles>(seconds * 1000 * kCyclesPerMs);
  Cycles free = 50 * kCyclesPerMs;
  while (board.now() < end) {
    motors.step();
    for (std::int16_t& angle : frame.angle) angle = static_cast<std::int16_t>(4095 * random.uniform());
    if (board.now() + kCyclesPerMs > free) {
      std::array<std::uint8_t, link::kMaxWire> wire{};
      const std::uint8_t size = link::encode(frame, true, hand.session_key(), wire.data());
      for (std::uint8_t k = 0; k < size; ++k)
        board.receive(free += byte_cycles(settings.hardware.baud), wire[k]);
      ++frame.counter;
    }
    board.run_until(board.now() + kCyclesPerMs);
  }
  result.stack_bytes = board.stack_bytes();
  result.awake_share = static_cast<double>(board.awake_cycles()) / static_cast<double>(board.now());
  return result;
}

}  // namespace flexor::cosim
