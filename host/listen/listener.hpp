// A glove's or a hand's serial port: rate and format found by listening, samples as they come, also after the plug was pulled.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host/io/serial.hpp"
#include "host/listen/decoder.hpp"
#include "host/listen/source.hpp"
#include "runtime/link/hand_end.hpp"

namespace flexor::listen {

struct ListenerOptions {
  std::string port;
  unsigned baud = 0;                  // 0: to be found
  std::optional<Format> format = {};  // none: to be found
  bool readings = false;              // of Flexor's gloves: readings instead of angles, which are asked for
  // With `readings`: of what gives none within seconds, what it gives; a hand that waits for its glove, whose samples come later.
  bool any_will_do = false;
  std::optional<link::Key> key = {};  // of the pair: the glove is challenged, as its hand does
  std::shared_ptr<const std::atomic<bool>> stop = {};  // set: finding ends at once, with an io::InputError
};

class Listener : public Source {
 public:
  // `report` is called with what is tried. Throws io::InputError, one line with the mend: no port, nothing comes, nothing that is
  // understood at any rate, a glove that waits for its hand and gives no readings, or a hand that waits for its glove.
  Listener(ListenerOptions options, const std::function<void(const std::string&)>& report);

  // What was half when the port went is dropped, as is the first line of it when it is back, which may be the end of one.
  // Throws io::JobError, one line with both headers: another glove of lines was plugged in, whose columns are called otherwise.
  Event wait(double timeout_s, std::vector<Sample>& out) override;
  const std::vector<std::string>& columns() const override { return decoder_->columns(); }
  const Tally& tally() const override { return decoder_->tally(); }
  std::string description() const override;
  bool takes_models() const override { return format() == Format::frames && options_.readings; }
  bool is_compensated() const override { return format() == Format::frames && !options_.readings; }
  unsigned baud() const override { return options_.baud; }
  int descriptor() const override { return port_ ? port_->descriptor() : -1; }
  void let_go() override {
    port_.reset();
    decoder_->cut();
    was_let_go_ = true;
  }

  Format format() const { return *options_.format; }

 private:
  void find(const std::function<void(const std::string&)>& report);
  std::optional<Guess> receive(double longest_s);
  void follow(std::span<const std::uint8_t> bytes);
  void speak();
  void ask_for_readings();

  ListenerOptions options_;
  std::unique_ptr<io::SerialPort> port_;
  std::unique_ptr<Decoder> decoder_;
  std::optional<link::HandEnd> hand_;
  double ticked_s_ = 0;
  double asked_s_ = -1;
  std::vector<std::uint8_t> received_;  // at the present rate, before the format was known
  std::size_t received_bytes_ = 0;
  bool was_let_go_ = false;
  double tried_s_ = -1;  // to open a port that has gone
};

}  // namespace flexor::listen
