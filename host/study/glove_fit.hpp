// Compensators fitted to recordings of the twin's glove, as a user fits them to a real one, by what flexor identify
// runs (host/identify/identify.hpp): `identified`, predicting by the lag from finger to hand, and beside it, from the
// very same recordings with the same loss, what a referee asks for first, all within the ends of the hand:
//   line                   gain and offset, inside the limits that the recordings show
//   line-lead              the same with motion, predicting by the same lead
//   published-hw-refitted  the published Hammerstein-Wiener model, of which only the gain and the dead zone's
//                          upper edge of each finger are fitted
#pragma once

#include <vector>

#include "host/identify/identify.hpp"
#include "host/study/glove_recording.hpp"

namespace flexor::study {

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
