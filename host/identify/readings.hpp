// What readings show of a sensor: how they spread, turn and rest, without any angle; its poses where the model is made, for a glove
// that is zeroed without a computer or calibrated again (recalibrate.hpp); and what a model says of readings that rest.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host/identify/additive.hpp"
#include "host/model/model.hpp"

namespace flexor::identify {

// Where the readings turn, going some way or more from each turn to the next.
struct Turns {
  std::vector<double> low;
  std::vector<double> high;
  // The same and where the first way begins and the last one ends.
  std::vector<double> low_ends;
  std::vector<double> high_ends;
  int count = 0;              // of turns
  double there_and_back = 0;  // the farthest that the readings went one way and then the other
};

// Readings in degrees or radians, by one turn brought to the middle of what the model knows of each input, where that is at most
// a turn. What lies farther off is no angle that wrapped.
void turn_into_range(const model::Model& model, std::span<double> readings);

// The reading that each share of them does not exceed, straight between neighbours.
model::Spread spread_of(std::vector<double> readings, std::span<const double> shares);

// Of a sensor of which only the poses are known.
model::Spread spread_of(const model::Poses& poses);

// At least one reading; `turn` in their unit.
Turns turns_of(std::span<const double> readings, double turn);

inline constexpr std::array kSpreadShares = {0.02, 0.1, 0.5, 0.9, 0.98};  // of a model's readings

// `sum`, and the squares of what the values are off their mean, each divided by `unit`.
double add_squares(double sum, const std::vector<double>& values, double unit);

// The running median over half a second: neither a loose contact's spike nor a tremor ends a hold.
std::vector<double> steadied(const std::vector<double>& values, double period_s);

struct StillPart {
  Eigen::Index from = 0;
  Eigen::Index to = 0;
};

// Stretches of a second or more in which every signal, after steadied(), stays within so much; a sample that is not used ends one.
std::vector<StillPart> still_in(const std::vector<std::vector<double>>& steady,
                                const std::vector<double>& most, double period_s,
                                const std::vector<std::uint8_t>& use = {});

// A second or more in which no sensor goes farther than an eighth of its span, and the sensors' mean readings then.
struct Rest {
  StillPart when;
  std::vector<double> reading;
};

// The pose that is held first, taken for the open hand, and the other one; without rests where only one is held.
struct Held {
  std::vector<Rest> open;
  std::vector<Rest> fist;

  bool empty() const { return open.empty() && fist.empty(); }
};

// The two rests that lie farthest apart, and every rest that lies by one of them: a hand at ease before the poses, and then likewise after them, is none.
// `readings` of each sensor, evenly spaced; a sensor of NaN does not count. `made`: the sensors' spans. Throws io::JobError naming `source`: no rest, or too many between the poses.
Held poses_in(const std::vector<std::vector<double>>& readings, double period_s,
              const std::vector<model::Spread>& made, const std::string& source);

// What a sensor read in each of these rests, where it read anything.
std::vector<double> readings_in(const std::vector<Rest>& rests, std::size_t sensor);

// Median reading of `sensor`, a column of the sessions' input, where the angle is within the lowest and the highest
// tenth of its range; of samples that count. None where there are fewer than ten of either, or both are one.
std::optional<model::Poses> poses_of(const std::vector<Session>& sessions, Eigen::Index sensor);

// Poses and turns of the input, whose readings are `sensor` of the sessions, where they lie in its valid range.
void add_poses(const std::vector<Session>& sessions, Eigen::Index sensor, double sample_period_s,
               model::Input& input);

// Quantiles of the readings of `sensor` in the samples that count, their mean over the sessions, none where the sensor hardly reads two
// values; and what they say of how donnings differ: the shift of their middles and the logarithm of the ratio of their spans, none of
// fewer than two sessions.
void add_spread(const std::vector<Session>& sessions, Eigen::Index sensor, model::Input& input);

// Of each joint, degrees, where all memory has faded.
std::vector<double> still_angles(const model::Model& model, const std::vector<double>& readings);

// How the joints' angles go along one sensor's spread, the other sensors at their medians.
struct Reach {
  std::vector<std::vector<double>> slopes;  // of each joint in each of eight equal parts, degrees by the unit
  std::vector<double> range_deg;  // of each joint, from the lowest reading to the highest; below 0: it falls
  double most_deg = 0;            // the largest of these
};

// All inputs of the model say what they read.
Reach reach_of(const model::Model& model, std::size_t input);

}  // namespace flexor::identify
