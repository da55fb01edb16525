// A model to a glove that runs: the sender's end of what runtime/glove/model_receiver.hpp takes.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "host/deploy/config.hpp"

namespace flexor::deploy {

// A cable, a radio, or a simulated board.
struct Line {
  std::function<void(std::span<const std::uint8_t>)> write;
  std::function<std::vector<std::uint8_t>(double timeout_s)>
      read;  // what comes first; empty: nothing within the time
  std::function<double()> now_s;
};

struct Sent {
  int bytes = 0;
  std::optional<int> pieces;  // over the line, with those that were sent again
  double took_s = 0;
};

// Called with bytes that are there, and all.
using SendProgress = std::function<void(int done, int all)>;

// The glove as it is at another sample rate.
using AtRate = std::function<Glove(double rate_hz)>;

// `glove`: the model, its sensors' calibration and the pair's key. The glove goes on with its old model until the new one is
// whole, which runs from the next sample on. Throws io::InputError, one line with the mend, where the
// glove takes no models, has another key, rate or calibration, or too little room; io::JobError when it does not answer,
// with what it runs now. Where `at_rate` is there, a glove that samples at another rate gets its model at that one.
Sent send_model(const Line& line, const Glove& glove, const SendProgress& progress,
                const AtRate& at_rate = {});

}  // namespace flexor::deploy
