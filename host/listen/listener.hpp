// A glove's or a hand's serial port: rate and format found by listening, samples as they come, also after the plug was pulled.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host/io/serial.hpp"
#include "host/listen/decoder.hpp"
#include "runtime/link/hand_end.hpp"

namespace flexor::listen {

struct ListenerOptions {
  std::string port;
  unsigned baud = 0;                  // 0: to be found
  std::optional<Format> format = {};  // none: to be found
  bool readings = false;              // of Flexor's gloves: readings instead of angles, which are asked for
  std::optional<link::Key> key = {};  // of the pair: the glove is challenged, as its hand does
};

enum class Event {
  quiet,    // nothing within the time
  samples,  // bytes came, and perhaps samples
  gone,     // the port is not there any more; wait() looks for it from now on
  back,
};

class Listener {
 public:
  // `says` hears what is tried. Throws io::InputError, one line with the mend: no port, nothing comes, nothing that is
  // understood at any rate, a glove that waits for its hand, or a hand for its glove.
  Listener(ListenerOptions options, const std::function<void(const std::string&)>& says);

  // Waits for bytes, `timeout_s` at most; appends what they complete.
  Event wait(double timeout_s, std::vector<Sample>& out);

  unsigned baud() const { return options_.baud; }
  Format format() const { return *options_.format; }
  const Decoder& decoder() const { return *decoder_; }
  double now_s() const;  // the clock of Sample::host_s: since this listener was made
  int times_gone() const { return times_gone_; }

 private:
  void find(const std::function<void(const std::string&)>& says);
  std::optional<Format> hear(double longest_s);
  void follow(std::span<const std::uint8_t> bytes);
  void speak();
  void send_challenge();
  void ask_for_readings();

  ListenerOptions options_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::unique_ptr<io::SerialPort> port_;
  std::unique_ptr<Decoder> decoder_;
  std::optional<link::HandEnd> hand_;
  double ticked_s_ = 0;
  double asked_s_ = -1;
  std::vector<std::uint8_t> heard_;  // at the present rate, before the format was known
  std::size_t heard_bytes_ = 0;
  bool waits_ = false;  // frames came, and no samples
  int times_gone_ = 0;
};

}  // namespace flexor::listen
