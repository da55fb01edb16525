// What a stretch of ordinary motion shows of one sensor, without any angle.
#pragma once

#include <span>
#include <vector>

#include "host/model/model.hpp"

namespace flexor::identify {

// Where the readings turn, going some way or more from each turn to the next; the first way that far ends in none.
struct Turns {
  std::vector<double> low;
  std::vector<double> high;
  // The same and where the first way began and the last one ended, as far as the stretch shows it.
  std::vector<double> low_ends;
  std::vector<double> high_ends;
  double there_and_back = 0;  // the farthest that the readings went one way and then the other

  int count() const { return static_cast<int>(low.size() + high.size()); }
};

struct Window : model::Spread {
  Turns turns;
};

// At least one reading; `turn` in their unit.
Window window_of(std::span<const double> readings, std::span<const double> shares, double turn);

model::Spread spread_of(std::vector<double> readings, std::span<const double> shares);

// Of a sensor of which only the poses are known.
model::Spread spread_of(const model::Poses& poses);

// The reading that a share of the sorted ones does not exceed, straight between neighbours.
double quantile_of(std::span<const double> sorted, double share);

Turns turns_of(std::span<const double> readings, double turn);

// `sum`, and the squares of what the values are off their mean, each divided by `unit`.
double add_squares(double sum, const std::vector<double>& values, double unit);

}  // namespace flexor::identify
