// Which of the twin's parameters are free, and what is known of each without the published table.
//
// A free parameter v has a normal prior, of v itself or of ln v, cut off at [min, max]:
//   ln p(v) = -((x - m) / s)^2 / 2,   x = v or ln v, m = median or ln median, s = deviation (of ln v: of a
//                                     factor e^s); without a deviation flat in x
// A strip's bend at a finger's limits has as median the mean of the bends at which either published
// compensator answers rightly, and as deviation the 16 degrees by which these two differ.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host/twin/parameters.hpp"

namespace flexor::study {

struct FreeParameter {
  std::string name;  // of the twin's table, with ".finger" where it has one for each
  double median = 0;
  std::optional<double> deviation;
  bool is_log = false;
  double min = 0;
  double max = 0;
  std::string reason;

  double coordinate(double value) const;  // x
  double value(double coordinate) const;  // of x, inside [min, max]
  double log_prior(double value) const;   // up to a constant; minus infinity outside [min, max]
  // The value that so much of the prior lies below; without a deviation, and beyond the bounds, of those.
  double quantile(double share) const;
};

const std::vector<FreeParameter>& free_parameters();

// As many values as free parameters, of which four digits count: what is evaluated is what a file says.
twin::Parameters with_values(const twin::Parameters& base, std::span<const double> values);
std::vector<double> values_of(const twin::Parameters& parameters);

// Sum over the parameters; minus infinity where a strip bends less with the finger at its upper limit.
double log_prior(std::span<const double> values);

}  // namespace flexor::study
