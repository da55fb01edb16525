// What a user records: a person wears the twin's glove and plays the recommended motion, once for each donning. The
// glove logs, a camera with a clock of its own sees the fingers, another one the hand that follows them.
//
// And compensators fitted to these recordings, as a user fits them to a real one, by what flexor identify
// runs (host/identify/identify.hpp): `identified`, predicting by the lag from finger to hand, and beside it, from the
// very same recordings with the same loss, what a referee asks for first, all within the ends of the hand:
//   line                   gain and offset, inside the limits that the recordings show
//   line-lead              the same with motion, predicting by the same lead
//   published-hw-refitted  the published Hammerstein-Wiener model, of which only the gain and the dead zone's
//                          upper edge of each finger are fitted
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "host/identify/identify.hpp"
#include "host/recording/recording.hpp"
#include "host/study/catalogue.hpp"
#include "host/twin/parameters.hpp"

namespace flexor::study {

struct GloveRequest {
  twin::Parameters parameters;
  double rate_hz = 10;
  int donnings = 1;
  std::uint64_t seed = 1001;  // other than the experiment's: other draws of donning, drift and noise
};

struct GloveRecording {
  recording::Recording glove;   // FINGER_alpha_deg
  recording::Recording camera;  // FINGER_deg
  recording::Recording hand;    // FINGER_deg, on the camera's clock; the hand follows the raw readings
};

// Throws io::InputError unless there are 1 to 100 donnings that the twin can play.
void check(const GloveRequest& request);

// One for each donning. Throws like check().
std::vector<GloveRecording> record_glove(const GloveRequest& request);

struct HandLag {
  double finger_to_hand_s = 0;  // that the two cameras see, all fingers alike
  double sensor_s = 0;          // of that, from finger to reading: what a compensator takes out by itself

  double lead_s() const { return std::max(0.0, finger_to_hand_s - sensor_s); }  // what is left to predict
};

// Medians of the donnings; none where the best lag lies outside the search (host/score/trial.hpp).
std::optional<HandLag> hand_lag(const std::vector<GloveRecording>& recordings);

// glove-N.csv, camera-N.csv and hand-N.csv, N from 1; numbers read back to the bit.
void write_recordings(const std::vector<GloveRecording>& recordings, const std::filesystem::path& folder);

struct GloveFit {
  std::vector<Compensator> baselines;  // line, line-lead, published-hw-refitted
  model::Model identified;
  std::optional<double> lead_s;  // from reading to hand; none: outside the search, and nothing is predicted
};

// As flexor identify has read them.
std::vector<identify::Take> hand_recordings(const std::vector<GloveRecording>& recordings);

// Throws io::InputError and io::JobError.
GloveFit fit_glove(const GloveRequest& request, const std::vector<GloveRecording>& recordings);

}  // namespace flexor::study
