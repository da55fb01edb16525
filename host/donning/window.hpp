// What a stretch of ordinary motion shows of one sensor, without any angle.
#pragma once

#include <span>
#include <vector>

#include "host/model/model.hpp"

namespace flexor::donning {

struct Window {
  std::vector<double> quantile;  // of the readings, at the shares that were asked for
  int reversals = 0;             // turns of the motion, by `turn` or more each way
  double seconds = 0;

  double span() const { return quantile.back() - quantile.front(); }
  double middle() const { return (quantile.back() + quantile.front()) / 2; }
};

// `readings` evenly spaced by period_s, at least one; `turn` in their unit.
Window window_of(std::span<const double> readings, double period_s, std::span<const double> shares, double turn);

// The reading that a share of the sorted ones does not exceed, straight between neighbours.
double quantile_of(std::span<const double> sorted, double share);

// How often the readings turn, going `turn` or more from each turn to the next; the first way that far is none.
int reversals_of(std::span<const double> readings, double turn);

}  // namespace flexor::donning
