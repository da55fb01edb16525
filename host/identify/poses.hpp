// What a sensor reads where the model is made: at the open hand and at the fist, for a glove that is zeroed without a
// computer, and how its readings spread, for one that is calibrated anew (recalibrate.hpp).
#pragma once

#include <optional>
#include <vector>

#include "host/identify/additive.hpp"
#include "host/model/model.hpp"

namespace flexor::identify {

// A second or more in which no sensor goes farther than an eighth of its span, and the sensors' mean readings then.
struct Rest {
  std::size_t begin = 0;
  std::size_t end = 0;
  std::vector<double> reading;

  std::size_t length() const { return end - begin; }
};

// `readings` of each sensor, evenly spaced, after a running median over half a second. Of successive rests that lie within
// 0.3 of each sensor's span (`made`) the longest. A sensor of NaN does not count.
std::vector<Rest> rests_in(const std::vector<std::vector<double>>& readings, double period_s,
                           const std::vector<model::Spread>& made);

// Median reading of `sensor`, a column of the sessions' input, where the angle is within the lowest and the highest
// tenth of its range; of samples that count. None where there are fewer than ten of either, or both are one.
std::optional<model::Poses> poses_of(const std::vector<Session>& sessions, Eigen::Index sensor);

// Poses and turns of the input, whose readings are `sensor` of the sessions, where they lie in its valid range.
void add_poses(const std::vector<Session>& sessions, Eigen::Index sensor, double sample_period_s,
               model::Input& input);

// Quantiles of the readings of `sensor` in the samples that count, their mean over the sessions. None where the sensor
// hardly reads two values.
std::optional<model::Spread> readings_of(const std::vector<Session>& sessions, Eigen::Index sensor);

// What the sessions' own quantiles say of how donnings differ: the shift of their middles and the logarithm of the ratio of
// their spans. None of fewer than two sessions.
std::optional<model::DonningSpread> donning_spread(const std::vector<Session>& sessions, Eigen::Index sensor);

}  // namespace flexor::identify
