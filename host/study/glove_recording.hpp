// The calibration motion, played by a person who wears the twin's glove: what the glove logs, and what a
// camera with a clock of its own sees.
#pragma once

#include <cstdint>
#include <filesystem>

#include "host/recording/recording.hpp"
#include "host/study/catalogue.hpp"
#include "host/twin/parameters.hpp"

namespace flexor::study {

struct GloveRequest {
  twin::Parameters parameters;
  double rate_hz = 10;
  int rounds = 1;             // of 30 s; the glove comes off and goes on in between
  std::uint64_t seed = 1001;  // other than the experiment's: another draw of donning, drift and noise
};

struct GloveRecording {
  recording::Recording glove;   // FINGER_alpha
  recording::Recording camera;  // FINGER_deg
};

// Throws io::InputError: 1 to 100 rounds, and what the twin cannot play.
GloveRecording record_glove(const GloveRequest& request);

// glove.csv and camera.csv; numbers read back to the bit.
void write_recording(const GloveRecording& recording, const std::filesystem::path& folder);

// The lag from finger to hand that both cameras see with this compensator, with another donning; none where
// the best lag lies outside the search (host/score/trial.hpp).
std::optional<double> hand_lag_s(const GloveRequest& request, const model::Model& compensator);

}  // namespace flexor::study
