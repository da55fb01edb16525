// What tells where the sensors of a glove lie: held poses, a stretch of motion, a camera; as rows of an estimate.
//
// The inputs of `model` say what they read; model and `seen` outlive the evidence.
#pragma once

#include <vector>

#include "host/identify/line_estimate.hpp"
#include "host/identify/window.hpp"

namespace flexor::identify {

// A reading of one sensor now, and what it would have been where the model was made; standard error in spans.
struct Sighting {
  std::size_t sensor = 0;
  double reading = 0;
  double made = 0;
  double error = 0;
  double pose = 0;  // from the open hand to the fist where the model was made, in spans
  bool fist = false;
};

// Held poses. A hand errs as a whole as well: all of its fingers may be less open, or less closed, than they were. A fist that is
// not as tight is common, one that is tighter is not: how far a pose lies towards the open hand is broad, beyond the pose narrow.
Evidence sightings(std::vector<Sighting> all, const model::Model& model);

// What a stretch of motion shows of one sensor.
struct Stretch {
  std::size_t sensor = 0;
  Window window;
  model::Spread made;
  Prior prior;
  int bends = 0;  // Reach::bends
};

// The quantiles of a stretch of motion, against those of the motion that the model was made from. Each end is known as well
// as the turns there repeat; another motion lies elsewhere by motion_sd, of whose variance a part is one for all sensors (the
// hand does the same with all of its fingers), and reaches farther by reach_sd; what lies between the ends has density_sd of
// its own besides. What the stretch lacks of the span, or goes beyond it, may be at either end: half of it is how far
// the middle may lie off (less where every turn is at one of two ends), and what is more than a gain makes likely counts as reach.
Evidence quantiles(std::vector<Stretch> stretches);

// Angles of joints beside the readings, every sample of the grid.
struct Seen {
  struct Angles {
    std::size_t joint = 0;
    std::vector<double> angle_deg;
    std::vector<std::uint8_t> use;
  };
  std::vector<std::vector<double>> reading;  // of each input
  std::vector<Angles> joints;
};

// The part of what a camera saw from `begin` to `end`, shares of it; the model runs from its start all the same. Each sample's
// error is that of the model where it was proven, of which only one a second counts as new; each joint's marks sit otherwise by
// 3 degrees (an unknown of its own); large errors count by their size (pseudo-Huber).
Evidence camera(const model::Model& model, const Seen& seen, double begin, double end);

// Of the same part, what the angles measured are off those of the model.
double mean_square_deg2(const model::Model& model, const Seen& seen, double begin, double end,
                        const std::vector<Line>& lines);

// Sensors that a joint depends on which the camera saw move by 10 degrees or more.
std::vector<std::size_t> told_by_camera(const model::Model& model, const Seen& seen);

}  // namespace flexor::identify
