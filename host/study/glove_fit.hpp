// Compensators fitted to one recording of the twin's glove, as a user fits them to a real one.
//
// In steps, each adding to the one before: a curve; two poles; a play operator; and a lead, the lag from finger
// to hand, by which the last predicts. The last is called `identified`. Beside them, from the very same
// recording and with the same loss, what a referee asks for first:
//   line                   clamp(gain alpha + offset), inside the range of angles that the recording shows,
//                          which is what `identified` is kept in too
//   line-lead              the same with a fitted pole and zero behind it, predicting by the same lead
//   published-hw-refitted  the published Hammerstein-Wiener model, of which only the gain and the dead zone's
//                          upper edge of each finger are fitted
// The loss of all is pseudo-Huber, 0.3 degree wide: the mean absolute error, as the experiment scores it.
#pragma once

#include <functional>
#include <span>

#include "host/study/glove_recording.hpp"

namespace flexor::study {

struct FittedModel {
  std::string name;  // static-curve, dynamics, hysteresis, lead; line, line-lead, published-hw-refitted
  std::string what;
  model::Model model;
};

struct GloveFit {
  std::vector<FittedModel> steps;  // the last is the result
  std::vector<FittedModel> baselines;
  // From finger to hand, measured with the compensator of the step before the last; none: outside the search,
  // and nothing is predicted.
  std::optional<double> lag_s;
  std::vector<std::string> warnings;

  model::Model identified() const { return steps.back().model; }
};

using StepProgress = std::function<void(const std::string& what)>;

// all_steps: false leaves out the first two, which the last do not need. Throws io::InputError and
// io::JobError.
GloveFit fit_glove(const GloveRequest& request, const GloveRecording& recording, bool all_steps,
                   const StepProgress& progress);

// Records, fits and writes glove.csv, camera.csv, a model for each step and baseline, and the last step once
// more as identified.json. Throws io::InputError and io::JobError.
GloveFit calibrate_glove(const GloveRequest& request, const std::filesystem::path& folder,
                         const StepProgress& progress);

// gain alpha + offset inside the limits, with the smallest mean pseudo-Huber loss, 0.3 degree wide.
struct Line {
  double gain = 0;
  double offset_deg = 0;
};
Line fit_line(std::span<const double> alpha, std::span<const double> angle_deg,
              const model::Saturation& limits);

}  // namespace flexor::study
