// For tests only: a board on a pseudo-terminal, and what gloves send.
#pragma once

#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "host/io/terminal_test.hpp"
#include "runtime/link/glove_end.hpp"
#include "runtime/link/hand_end.hpp"

namespace flexor::listen {

// The board's end of the line; sends what `sends` gives every 10 ms, of what was received since.
class Board {
 public:
  using Sends = std::function<std::string(const std::string& received)>;

  explicit Board(Sends sends) {
    termios raw{};
    tcgetattr(line_.master(), &raw);
    cfmakeraw(&raw);
    tcsetattr(line_.master(), TCSANOW, &raw);
    thread_ = std::jthread([this, sends = std::move(sends)](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        const std::string text = sends(received());
        for (std::size_t put = 0; put < text.size() && !stop.stop_requested();)
          put += static_cast<std::size_t>(
              std::max<ssize_t>(0, write(line_.master(), text.data() + put, text.size() - put)));
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
      }
    });
  }
  ~Board() { unplug(); }
  Board(const Board&) = delete;
  Board& operator=(const Board&) = delete;
  void unplug() {
    if (!thread_.joinable()) return;
    thread_.request_stop();
    thread_.join();
    line_.hang_up();
  }
  const std::string& port() const { return line_.name(); }

 private:
  std::string received() const {
    std::array<char, 256> bytes{};
    const ssize_t count = read(line_.master(), bytes.data(), bytes.size());
    return count > 0 ? std::string(bytes.data(), static_cast<std::size_t>(count)) : std::string();
  }

  io::Terminal line_{O_NONBLOCK};
  std::jthread thread_;
};

// A glove's frame of readings, which has no counter.
inline std::vector<std::uint8_t> readings(std::uint16_t time_ms,
                                          const std::array<std::uint16_t, link::kFingers>& counts) {
  link::Packet packet;
  std::array<std::uint8_t, link::kMaxWire> wire{};
  const std::uint8_t bytes = link::put_readings(time_ms, counts.data(), link::kFingers, packet.body());
  const std::uint8_t size = link::GloveEnd::seal(link::Type::readings, packet, bytes, false, wire.data());
  return {wire.begin(), wire.begin() + size};
}

// A glove's frames, as its firmware sends them: angles in touch with its hand, else how it is; readings before, for a second,
// where it gives them and is asked. Angles and readings move.
class FramesGlove {
 public:
  FramesGlove(std::optional<link::Key> key, bool gives_readings)
      : key_(key), end_(key_ ? &*key_ : nullptr), gives_readings_(gives_readings) {}
  FramesGlove(const FramesGlove&) = delete;
  FramesGlove& operator=(const FramesGlove&) = delete;

  // The other requests are lost, as when the hand speaks at the same time.
  void receive_one_request_of(unsigned n) { receives_one_of_ = n; }

  std::string operator()(const std::string& received) {
    for (const char byte : received) {
      if (end_.push(static_cast<std::uint8_t>(byte)) != link::Received::pending) continue;
      if (end_.packet().type() != link::Type::request || !gives_readings_) continue;
      if (requests_++ % receives_one_of_ == 0) readings_left_ = kASecond;
    }
    ++slot_;
    std::string out;
    if (readings_left_ > 0) out = a_reading();
    std::array<std::uint8_t, link::kMaxWire> wire{};
    link::Frame frame{};
    frame.time_ms = static_cast<std::uint16_t>(10 * slot_);
    for (std::int16_t& angle : frame.angle) angle = static_cast<std::int16_t>(16 * (slot_ % 90));
    const std::uint8_t size =
        end_.in_touch() ? end_.angles(frame, false, wire.data()) : end_.state(0, 0, wire.data());
    return out + std::string(wire.begin(), wire.begin() + size);
  }

 private:
  std::string a_reading() {
    --readings_left_;
    std::array<std::uint16_t, link::kFingers> counts{};
    counts.fill(static_cast<std::uint16_t>(300 + slot_ % 400));
    const std::vector<std::uint8_t> frame = readings(static_cast<std::uint16_t>(10 * slot_), counts);
    return {frame.begin(), frame.end()};
  }

  static constexpr int kASecond = 100;  // slots

  std::optional<link::Key> key_;
  link::GloveEnd end_;
  bool gives_readings_;
  unsigned receives_one_of_ = 1;
  unsigned requests_ = 0;
  unsigned slot_ = 0;
  int readings_left_ = 0;
};

// What a hand sends, of which one finger is stalled.
inline std::vector<std::uint8_t> telemetry(link::HandEnd& hand, bool state) {
  link::Packet packet;
  std::array<std::uint8_t, link::kMaxWire> wire{};
  std::uint8_t size = 0;
  if (state) {
    link::State body{};
    body.board = link::BoardKind::hand;
    const std::uint8_t bytes = link::put_state(body, packet.body());
    size = hand.seal(link::Type::state, packet, bytes, wire.data());
  } else {
    std::array<link::FingerTelemetry, link::kFingers> finger{};
    finger[1] = {720, -127, 1};
    const std::uint8_t bytes =
        link::put_telemetry(2500, 0b1001, finger.data(), link::kFingers, packet.body());
    size = hand.seal(link::Type::telemetry, packet, bytes, wire.data());
  }
  return {wire.begin(), wire.begin() + size};
}

}  // namespace flexor::listen
