// What a stretch of ordinary motion shows of one sensor, without any angle; and what a model says of readings that rest: its
// joints' angles once all memory has faded.
#pragma once

#include <array>
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

inline constexpr std::array kSpreadShares = {0.02, 0.1, 0.5, 0.9, 0.98};  // of a model's readings

// Likewise of several sessions.
model::Spread mean_of(const std::vector<model::Spread>& all);

// `sum`, and the squares of what the values are off their mean, each divided by `unit`.
double add_squares(double sum, const std::vector<double>& values, double unit);

// Of each joint, degrees.
std::vector<double> still_angles(const model::Model& model, const std::vector<double>& readings);

// How the joints' angles go along one sensor's spread, the other sensors at their medians.
struct Reach {
  std::vector<std::vector<double>> slopes;  // of each joint in each of eight equal parts, degrees by the unit
  std::vector<double> range_deg;            // of each joint, from its lowest angle to its highest
  double most_deg = 0;                      // the largest of these
  int bends = 0;  // as the joint bends that it tells most of, 1: readings rise, -1: they fall, 0: not known
};

// All inputs of the model say what they read.
Reach reach_of(const model::Model& model, std::size_t input);

}  // namespace flexor::identify
