#include "cosim/replay.hpp"

#include <algorithm>
#include <cmath>
#include <deque>

#include "firmware/markers.hpp"
#include "host/deploy/host_chain.hpp"
#include "host/twin/random.hpp"
#include "runtime/link/opengloves.hpp"

namespace flexor::cosim {
namespace {

using firmware::Marker;

// "ldi, out" of the closing marker: the opening one ends where the measurement begins.
constexpr std::uint64_t kMarkerCycles = 2;

// The host's side: what the image must send, to the byte.
class Expected {
 public:
  explicit Expected(const deploy::Glove& glove)
      : glove_(glove), tables_(deploy::glove_tables(glove)), chain_(glove) {}

  void sample(const std::array<int, deploy::kFingers>& counts) {
    frame_ = chain_.step(counts);
    ++samples_;
  }

  std::string message() {
    if (glove_.output == deploy::Output::opengloves) return line();
    // The first start of a board whose EEPROM is empty.
    frame_.counter = (1U << 16) + messages_++;
    frame_.time_ms = static_cast<std::uint16_t>(std::lround(1000 * glove_.model.sample_period_s) * samples_);
    std::array<std::uint8_t, link::kWireSealed> wire{};
    const std::uint8_t size = link::encode(frame_, glove_.key ? &*glove_.key : nullptr, wire.data());
    return {wire.begin(), wire.begin() + size};
  }

 private:
  std::string line() const {
    std::array<std::uint16_t, deploy::kFingers> flexion{};
    for (std::size_t i = 0; i < flexion.size(); ++i) {
      flexion[i] = link::flexion_of(frame_.angle[i], tables_.straight[i], tables_.flexion_scale[i]);
    }
    std::array<char, link::kMaxGloveText> text{};
    return {text.data(), link::encode_gloves(flexion.data(), text.data())};
  }

  const deploy::Glove& glove_;
  deploy::GloveTables tables_;
  deploy::HostChain chain_;
  link::Frame frame_{};
  long samples_ = 0;
  std::uint32_t messages_ = 0;
};

}  // namespace

study::GloveFigures replay(const Firmware& firmware, const deploy::Glove& glove, const Counts& counts,
                           std::vector<std::string>* messages) {
  study::GloveFigures result;
  Expected host(glove);
  std::deque<std::string> expected;
  std::string sent;
  const char end = glove.output == deploy::Output::opengloves ? '\n' : '\0';
  Cycles step_begin = 0;
  Cycles sampled = 0;
  Board board(firmware);
  const auto now_read = [&]() -> const std::array<int, deploy::kFingers>& {
    return counts[std::min(result.samples, counts.size() - 1)];
  };
  board.on_sample = [&](Cycles, int channel) {
    return channel < deploy::kFingers ? now_read()[static_cast<std::size_t>(channel)] : 0;
  };
  board.on_marker = [&](Cycles now, std::uint8_t value) {
    switch (static_cast<Marker>(value)) {
      case Marker::sampled:
        sampled = now;
        host.sample(now_read());
        ++result.samples;
        return;
      case Marker::step_begin:
        step_begin = now;
        return;
      case Marker::step_end:
        if (result.samples > 1) result.step.add(now - step_begin - kMarkerCycles);
        return;
      case Marker::frame_sealed:
        expected.push_back(host.message());
        result.sample.add(now - sampled);
        return;
      default:
        return;
    }
  };
  board.on_byte = [&](Cycles, std::uint8_t byte) {
    sent += static_cast<char>(byte);
    if (sent.back() != end) return;
    ++result.frames;
    result.angles += deploy::kFingers;
    if (expected.empty() || sent != expected.front()) ++result.mismatches;
    if (!expected.empty()) expected.pop_front();
    if (messages != nullptr) messages->push_back(sent);
    sent.clear();
  };
  while (result.samples < counts.size()) board.run_until(board.now() + kCyclesPerMs);
  board.run_until(board.now() + 100 * kCyclesPerMs);
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

study::HandFigures measure_hand(const Firmware& firmware, const deploy::Glove& glove, double seconds) {
  study::HandFigures result;
  Board board(firmware);
  Cycles begin = 0;
  board.on_marker = [&](Cycles now, std::uint8_t value) {
    if (static_cast<Marker>(value) == Marker::tick_begin) begin = now;
    if (static_cast<Marker>(value) == Marker::tick_end) result.tick.add(now - begin - kMarkerCycles);
  };
  twin::Random random(1);
  link::Frame frame{};
  frame.counter = 1U << 16;
  const auto byte_cycles = static_cast<Cycles>(10 / glove.baud * 1000 * kCyclesPerMs);
  const auto end = static_cast<Cycles>(seconds * 1000 * kCyclesPerMs);
  Cycles free = 50 * kCyclesPerMs;
  while (board.now() < end) {
    for (int i = 0; i < deploy::kFingers; ++i) {
      board.set_counts(i, 400 + static_cast<int>(200 * random.uniform()));
      frame.angle[i] = static_cast<std::int16_t>(4095 * random.uniform());
    }
    if (board.now() + kCyclesPerMs > free) {
      std::array<std::uint8_t, link::kWireSealed> wire{};
      const std::uint8_t size = link::encode(frame, glove.key ? &*glove.key : nullptr, wire.data());
      for (std::uint8_t k = 0; k < size; ++k) board.receive(free += byte_cycles, wire[k]);
      ++frame.counter;
    }
    board.run_until(board.now() + kCyclesPerMs);
  }
  result.stack_bytes = board.stack_bytes();
  result.awake_share = static_cast<double>(board.awake_cycles()) / static_cast<double>(board.now());
  return result;
}

}  // namespace flexor::cosim
