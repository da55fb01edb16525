// Whether a log's readings are those that a model knows: within its inputs' ranges and where they lay when it was made, and
// which two columns were exchanged, or one turned round.
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
  std::uint64_t outside = 0;  // of the valid range
  std::uint64_t beyond = 0;   // a tenth of their span beyond those that the model was made from
  double low = 0;             // what was read
  double high = 0;
  bool mostly_outside() const { return readings > 0 && 2 * outside >= readings; }
  bool mostly_beyond() const { return readings > 0 && 2 * beyond >= readings; }
};

class RangeCount {
 public:
  explicit RangeCount(const Model& model);
  void add(std::span<const double> reading);  // of each input; NaN is none

  const std::vector<InputCount>& counts() const { return counts_; }
  // Two inputs whose readings lie where the other's lay when the model was made: their columns' quantiles are three times
  // closer to it so. Where the model has no readings, the ends of the valid range take their place.
  std::optional<std::pair<std::size_t, std::size_t>> exchanged() const;
  // Whether this input's readings, subtracted from the converter's full scale, are three times closer to those that the model was
  // made from: its divider is wired the other way round. Only of counts, and where the model has what it was made from.
  bool mirrored(std::size_t input) const;

 private:
  double distance(std::size_t column, std::size_t input, bool mirrored = false) const;

  const std::vector<Input> inputs_;
  std::vector<InputCount> counts_;
  std::vector<std::vector<double>> kept_;  // every `stride_`th row's readings
  std::uint64_t stride_ = 1;
  std::uint64_t rows_ = 0;
};

}  // namespace flexor::model
