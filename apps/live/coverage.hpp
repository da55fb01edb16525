// What a calibration's motion has shown of each finger so far, from its readings alone: a person who moves must see at once
// what is still missing. Shares are of the reading's own span, from the reading that 2 % of the samples do not exceed to
// that of 98 %; where it hardly exceeds the noise the finger has not moved. How far a finger
// could bend beyond that span is not known from readings.
#pragma once

#include <string>
#include <vector>

#include "host/io/pipe_json.hpp"

namespace flexor::live {

struct Covered {
  std::string name;
  double range = 0;     // bends from end to end, of three
  double slow = 0;      // seconds between 0.04 and 0.5 spans a second, of six
  double fast = 0;      // seconds above one span a second, of one
  double holds = 0;     // places at which it rested for a second, of three
  std::string missing;  // move, range, slow, holds, fast; empty: nothing
  bool is_enough() const { return missing.empty(); }
};

FLEXOR_PIPE(Covered, name, range, slow, fast, holds, missing)

class Coverage {
 public:
  explicit Coverage(std::vector<std::string> names);

  // One reading of each; times never decrease.
  void add(double t_s, const std::vector<double>& reading);

  // As it was at most a second ago: it takes a while.
  const std::vector<Covered>& covered() const;

 private:
  std::vector<std::string> names_;
  std::vector<std::vector<float>> kept_;  // of each finger, every 50 ms
  double due_s_ = 0;
  bool begun_ = false;
  std::size_t steps_ = 0;
  mutable std::size_t covered_at_ = 0;  // likewise
  mutable std::vector<Covered> covered_;
};

}  // namespace flexor::live
