#include "cosim/replay.hpp"

#include <algorithm>
#include <cmath>
#include <deque>

#include "firmware/markers.hpp"
#include "host/deploy/host_chain.hpp"
#include "host/twin/random.hpp"
#include "runtime/link/receiver.hpp"

namespace flexor::cosim {
namespace {

using firmware::Marker;

// "ldi, out" of the closing marker: the opening one ends where the measurement begins.
constexpr std::uint64_t kMarkerCycles = 2;

bool same(const link::Frame& a, const link::Frame& b) {
  return std::ranges::equal(a.angle, b.angle) && std::ranges::equal(a.status, b.status);
}

// What goes on the wire: angles limited to the field's range.
link::Frame limited(link::Frame frame) {
  for (std::int16_t& angle : frame.angle) angle = std::clamp<std::int16_t>(angle, 0, link::kMaxAngle);
  return frame;
}

}  // namespace

experiment::GloveFigures replay(const Firmware& firmware, const deploy::Glove& glove, const Counts& counts) {
  experiment::GloveFigures result;
  deploy::HostChain host(glove);
  link::Receiver receiver(glove.key ? &*glove.key : nullptr);
  std::deque<link::Frame> expected;
  link::Frame latest{};
  Cycles step_begin = 0;
  Cycles sampled = 0;
  Board board(firmware);
  board.on_sample = [&](Cycles, int channel) {
    const auto k = std::min(result.samples, counts.size() - 1);
    return channel < deploy::kFingers ? counts[k][static_cast<std::size_t>(channel)] : 0;
  };
  board.on_marker = [&](Cycles now, std::uint8_t value) {
    switch (static_cast<Marker>(value)) {
      case Marker::sampled:
        sampled = now;
        latest = host.step(counts[std::min(result.samples, counts.size() - 1)]);
        ++result.samples;
        return;
      case Marker::step_begin:
        step_begin = now;
        return;
      case Marker::step_end:
        if (result.samples > 1) result.step.add(now - step_begin - kMarkerCycles);
        return;
      case Marker::frame_sealed:
        expected.push_back(limited(latest));
        result.sample.add(now - sampled);
        return;
      default:
        return;
    }
  };
  board.on_byte = [&](Cycles, std::uint8_t byte) {
    if (receiver.receive(byte) != link::Received::frame) return;
    ++result.frames;
    result.angles += deploy::kFingers;
    if (expected.empty() || !same(receiver.frame(), expected.front())) ++result.mismatches;
    if (!expected.empty()) expected.pop_front();
  };
  while (result.samples < counts.size()) board.run_until(board.now() + kCyclesPerMs);
  board.run_until(board.now() + 100 * kCyclesPerMs);
  // A frame that did not arrive at all is wrong, too; one may still be on its way.
  if (expected.size() > 1) result.mismatches += expected.size() - 1;
  result.stack_bytes = board.stack_bytes();
  result.awake_share = static_cast<double>(board.awake_cycles()) / static_cast<double>(board.now());
  return result;
}

std::vector<std::string> replay_opengloves(const Firmware& firmware, const Counts& counts) {
  std::vector<std::string> lines(1);
  std::size_t sample = 0;
  Board board(firmware);
  board.on_sample = [&](Cycles, int channel) {
    return channel < deploy::kFingers
               ? counts[std::min(sample, counts.size() - 1)][static_cast<std::size_t>(channel)]
               : 0;
  };
  board.on_marker = [&](Cycles, std::uint8_t value) {
    sample += static_cast<Marker>(value) == Marker::sampled;
  };
  board.on_byte = [&](Cycles, std::uint8_t byte) {
    lines.back() += static_cast<char>(byte);
    if (byte == '\n') lines.emplace_back();
  };
  while (sample < counts.size()) board.run_until(board.now() + kCyclesPerMs);
  board.run_until(board.now() + 9 * kCyclesPerMs);
  lines.pop_back();
  return lines;
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

experiment::HandFigures measure_hand(const Firmware& firmware, const deploy::Glove& glove, double seconds) {
  experiment::HandFigures result;
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
