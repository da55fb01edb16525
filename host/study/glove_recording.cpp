#include "host/study/glove_recording.hpp"

#include "host/io/io.hpp"
#include "host/recording/csv.hpp"
#include "host/score/trial.hpp"
#include "host/twin/random.hpp"
#include "host/twin/simulation.hpp"

namespace flexor::study {
namespace {

constexpr double kPause_s = 5;
constexpr double kGloveClock_s = 3.0;
constexpr double kCameraClock_s = 17.35;  // nobody told the camera what time the glove has

}  // namespace

GloveRecording record_glove(const GloveRequest& request) {
  if (request.rounds < 1 || request.rounds > 100) throw io::InputError("a calibration takes 1 to 100 rounds");
  const twin::Motion motion = calibration_motion();
  const twin::TrialInput input{request.parameters, motion, compensator("raw", request.rate_hz).model,
                               request.seed, true};
  twin::check(input);
  GloveRecording out;
  for (const std::string& finger : model::finger_names()) {
    out.glove.columns.push_back({finger + "_alpha", {}});
    out.camera.columns.push_back({finger + "_deg", {}});
  }
  // Between rounds the glove comes off and goes on again, and both logs pause.
  for (int round = 0; round < request.rounds; ++round) {
    const twin::Trial trial = twin::simulate(input, static_cast<std::uint64_t>(round), 1).front();
    const double start_s = round * (motion.duration_s() + kPause_s);
    for (const double t : trial.sample_s) out.glove.t_s.push_back(kGloveClock_s + start_s + t);
    for (std::size_t k = 0; k < trial.glove_deg[0].size(); ++k) {
      out.camera.t_s.push_back(kCameraClock_s + start_s +
                               static_cast<double>(k) / request.parameters.camera_rate_hz);
    }
    for (std::size_t i = 0; i < kFingers; ++i) {
      const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
      append(out.glove.columns[i].value, trial.alpha_deg[i]);
      append(out.camera.columns[i].value, trial.glove_deg[i]);
    }
  }
  return out;
}

void write_recording(const GloveRecording& recording, const std::filesystem::path& folder) {
  io::make_folder(folder);
  io::write_file(folder / "glove.csv", recording::to_csv(recording.glove));
  io::write_file(folder / "camera.csv", recording::to_csv(recording.camera));
}

std::optional<double> hand_lag_s(const GloveRequest& request, const model::Model& compensator) {
  const twin::TrialInput input{request.parameters, calibration_motion(), compensator,
                               twin::seed_of(request.seed, 1), false};
  const twin::Trial trial = twin::simulate(input, 0, 1).front();
  const score::TrialScore s =
      score::score_trial(trial.glove_deg, trial.hand_deg, 1 / request.parameters.camera_rate_hz);
  if (!s.lag_removed) return std::nullopt;
  return s.lag_removed->lag_s;
}

}  // namespace flexor::study
