// A person's recording as a few typical hands: centres of Lloyd's algorithm (1982), each with the seconds that it
// stands for. Averages, not samples: how far the hands of a cell lie from their centre is kept as a variance.
#pragma once

#include <cstdint>

#include "host/posture/joints.hpp"

namespace flexor::posture {

struct Codebook {
  Hands centre_deg;         // cells x 23
  Eigen::VectorXd seconds;  // cells, each above 0
  Hand within_deg2;         // variance about the centres
};

// `seconds` is how long each hand lasts, at least 0 and not all 0. At most `cells` cells; the same seed, the same
// cells. Throws io::InputError when there are no hands.
Codebook make_codebook(const Hands& hands_deg, const Eigen::VectorXd& seconds, int cells, std::uint64_t seed);

}  // namespace flexor::posture
