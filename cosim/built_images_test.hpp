// For tests: what a trial begins with, and both boards' images for it.
#pragma once

#include <string>

#include "cosim/co_simulation.hpp"
#include "host/study/boards.hpp"

namespace flexor::cosim {

inline twin::TrialInput published_input(double rate_hz = 20, const std::string& gesture = "1") {
  return {twin::Parameters(), study::motions(gesture).front(),
          study::compensator("published-hw", rate_hz).model, 1, false};
}

// Between end stops that give.
inline twin::TrialInput between_soft_stops(twin::TrialInput input) {
  input.parameters.stop_stiffness_mNm_deg = 100;
  input.parameters.stop_damping_mNms_deg = 0.05;
  return input;
}

// As a user would flash them.
inline Images built_images(const twin::TrialInput& input) {
  return {deploy::glove_for(input.parameters, input.compensator, study::bench_key()),
          deploy::safe_hand(input.parameters, input.compensator, study::bench_key())};
}

}  // namespace flexor::cosim
