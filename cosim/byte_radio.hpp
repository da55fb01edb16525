// The radio of the twin, byte by byte: the same losses, delays and outages, and faults of single bytes and
// bits besides.
#pragma once

#include <cstdint>
#include <optional>

#include "cosim/board.hpp"
#include "host/twin/parameters.hpp"
#include "host/twin/random.hpp"

namespace flexor::cosim {

// Beside radio.loss and radio.corruption, which are shares of frames.
struct ByteFaults {
  double loss = 0;      // share of bytes
  double bit_flip = 0;  // share of bits
  double start_s = 0;
  double end_s = 1e9;
  // Gilbert (Bell Syst. Tech. J. 39 (1960) 1253) and Elliott: a radio that is now good, now bad, and changes between
  // two frames.
  double turns_bad = 0;   // probability
  double turns_good = 1;  // probability
  double bad_loss = 0;    // share of frames while it is bad
};

class ByteRadio {
 public:
  // `parameters` outlives the radio. `epoch` is t = 0 in cycles.
  ByteRadio(const twin::Parameters& parameters, std::uint64_t seed, ByteFaults faults, Cycles epoch);

  // A byte that the sender's UART began at `begin`: when its last bit arrives, if it does; `byte` as it
  // arrives.
  std::optional<Cycles> pass(Cycles begin, std::uint8_t& byte);

  // Of Gilbert and Elliott's two states, the one that loses frames.
  bool is_bad() const { return bad_; }

 private:
  const twin::Parameters& p_;
  twin::Random random_;
  ByteFaults faults_;
  Cycles epoch_;
  Cycles byte_cycles_;
  Cycles frame_delay_ = 0;
  Cycles last_begin_ = 0;
  Cycles last_end_ = 0;
  bool lost_ = false;
  bool corrupt_ = false;
  bool bad_ = false;
};

}  // namespace flexor::cosim
