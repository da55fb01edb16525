// How much of a log lies outside of the ranges that a model's inputs take, and which two columns were exchanged.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "host/model/model.hpp"

namespace flexor::model {

struct InputCount {
  std::uint64_t readings = 0;
  std::uint64_t outside = 0;
  double low = 0;  // what was read
  double high = 0;
  bool mostly_outside() const { return readings > 0 && 2 * outside >= readings; }
};

class RangeCount {
 public:
  explicit RangeCount(const Model& model);
  void add(std::span<const double> reading);  // of each input; NaN is none

  const std::vector<InputCount>& counts() const { return counts_; }
  // Two inputs of which one is mostly outside, and of which at most a tenth as much is with their columns exchanged. Not
  // looked for in more than 32 inputs.
  std::optional<std::pair<std::size_t, std::size_t>> exchanged() const;

 private:
  bool is_outside(double reading, std::size_t input) const;

  std::vector<std::pair<double, double>> ranges_;
  std::vector<InputCount> counts_;
  std::vector<std::vector<std::uint64_t>>
      crossed_;  // [i][j]: readings of column i outside of input j's range
};

}  // namespace flexor::model
