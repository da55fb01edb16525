#include "cosim/byte_radio.hpp"

#include <algorithm>

namespace flexor::cosim {
namespace {

constexpr double kCyclesPerSecond = 1000.0 * kCyclesPerMs;

Cycles cycles(double seconds) { return static_cast<Cycles>(seconds * kCyclesPerSecond); }

}  // namespace

ByteRadio::ByteRadio(const twin::Parameters& parameters, std::uint64_t seed, ByteFaults faults, Cycles epoch)
    : p_(parameters),
      random_(seed),
      faults_(faults),
      epoch_(epoch),
      byte_cycles_(cycles(10 / parameters.baud)) {}

std::optional<Cycles> ByteRadio::pass(Cycles begin, std::uint8_t& byte) {
  constexpr Cycles kGap = 3;  // byte-times of silence end a frame
  if (last_begin_ == 0 || begin - last_begin_ > kGap * byte_cycles_) {
    // The twin's draws, in its order.
    frame_delay_ = cycles(p_.module_latency_s + p_.jitter_s * random_.uniform());
    lost_ = random_.uniform() < p_.loss;
    corrupt_ = random_.uniform() < p_.corruption;
    if (faults_.turns_bad > 0) {
      bad_ = bad_ ? random_.uniform() >= faults_.turns_good : random_.uniform() < faults_.turns_bad;
      lost_ = lost_ || (bad_ && random_.uniform() < faults_.bad_loss);
    }
  }
  last_begin_ = begin;
  const double t_s = (static_cast<double>(begin) - static_cast<double>(epoch_)) / kCyclesPerSecond;
  const bool outage = t_s >= p_.outage_start_s && t_s < p_.outage_start_s + p_.outage_s;
  const bool faulty = t_s >= faults_.start_s && t_s < faults_.end_s;
  const bool byte_lost = faulty && faults_.loss > 0 && random_.uniform() < faults_.loss;
  if (faulty && faults_.bit_flip > 0) {
    for (int bit = 0; bit < 8; ++bit) {
      if (random_.uniform() < faults_.bit_flip) byte = static_cast<std::uint8_t>(byte ^ (1U << bit));
    }
  }
  if (lost_ || outage || byte_lost) return std::nullopt;
  if (corrupt_) {
    byte = static_cast<std::uint8_t>(byte ^ 1U);
    corrupt_ = false;
  }
  last_end_ = std::max(begin + byte_cycles_ + frame_delay_, last_end_ + byte_cycles_);
  return last_end_;
}

}  // namespace flexor::cosim
