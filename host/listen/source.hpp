// Where samples come from: a serial port, a file that is played again, a simulated glove, a camera.
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "host/listen/decoder.hpp"

namespace flexor::listen {

enum class Event {
  quiet,    // nothing within the time
  samples,  // bytes came, and perhaps samples
  gone,     // the source is not there any more; wait() looks for it from now on
  back,
  ended,  // a file is at its end: nothing comes any more
};

class Source {
 public:
  virtual ~Source() = default;
  // Waits for samples, `timeout_s` at most; appends them.
  virtual Event wait(double timeout_s, std::vector<Sample>& out) = 0;
  // Names with units; the same for good from the first sample on.
  virtual const std::vector<std::string>& columns() const { return columns_; }
  virtual const Tally& tally() const { return tally_; }
  // The clock of Sample::host_s: since the source was made.
  virtual double now_s() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }
  virtual std::string description() const = 0;  // what it is, in a few words: "frames at 115200 baud"
  // A glove with Flexor's firmware, into which models can be sent.
  virtual bool takes_models() const { return false; }
  // Its samples are angles that the glove has made of readings which it does not give: nothing can be fitted to them.
  virtual bool is_compensated() const { return false; }
  // Of a serial port; 0: it is none.
  virtual unsigned baud() const { return 0; }
  // Gives up what it holds, for another program's sake; the next wait() takes it again.
  virtual void let_go() {}
  // Readable once wait() has something to do; -1: there is no such descriptor now, ask every 5 ms.
  virtual int descriptor() const { return -1; }

 protected:
  std::vector<std::string> columns_;
  Tally tally_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace flexor::listen
