#include "host/study/glove_fit.hpp"

#include <fmt/format.h>

#include "host/deploy/hardware.hpp"
#include "host/io/io.hpp"
#include "host/io/numbers.hpp"
#include "host/recording/align.hpp"
#include "host/recording/csv.hpp"
#include "host/score/trial.hpp"
#include "host/twin/random.hpp"
#include "host/twin/simulation.hpp"

namespace flexor::study {
namespace {

constexpr double kGloveClock_s = 3.0;
constexpr double kCameraClock_s = 17.35;  // the camera does not know the glove's time
constexpr int kMostDonnings = 100;

recording::Recording angles(const std::array<std::vector<float>, kFingers>& seen, double clock_s,
                            double frames_hz) {
  recording::Recording out;
  for (std::size_t k = 0; k < seen[0].size(); ++k)
    out.t_s.push_back(clock_s + static_cast<double>(k) / frames_hz);
  for (std::size_t i = 0; i < kFingers; ++i)
    out.columns.push_back({model::finger_names()[i] + "_deg", {seen[i].begin(), seen[i].end()}});
  return out;
}

GloveRecording to_recording(const twin::Trial& trial, double frames_hz, double camera_clock_s) {
  GloveRecording out;
  for (const double t : trial.sample_s) out.glove.t_s.push_back(kGloveClock_s + t);
  for (std::size_t i = 0; i < kFingers; ++i) {
    out.glove.columns.push_back({model::finger_names()[i] + "_alpha_deg", trial.reading[i]});
  }
  out.camera = angles(trial.glove_deg, camera_clock_s, frames_hz);
  out.hand = angles(trial.hand_deg, camera_clock_s, frames_hz);
  return out;
}

std::vector<std::vector<float>> fingers_of(const recording::Recording& seen) {
  std::vector<std::vector<float>> out;
  for (const recording::Column& column : seen.columns)
    out.emplace_back(column.value.begin(), column.value.end());
  return out;
}

std::optional<double> sensor_lag_s(const GloveRecording& one, std::size_t finger) {
  const auto series = [&](const recording::Recording& r) {
    return recording::Series{r.t_s, r.columns[finger].value};
  };
  try {
    return recording::align(series(one.glove), series(one.camera)).sensor_lag_s;
  } catch (const io::JobError&) {
    return std::nullopt;  // a sensor that shows nothing
  }
}

twin::TrialInput trial_of(const GloveRequest& request) {
  return {request.parameters, recommended_motion(), compensator("raw", request.rate_hz).model, request.seed,
          true};
}

}  // namespace

void check(const GloveRequest& request) {
  if (request.donnings < 1 || request.donnings > kMostDonnings)
    throw io::InputError("--donnings must be 1 to {}", kMostDonnings);
  twin::check(trial_of(request));
}

std::vector<GloveRecording> record_glove(const GloveRequest& request) {
  check(request);
  const twin::TrialInput input = trial_of(request);
  std::vector<GloveRecording> out;
  for (int donning = 0; donning < request.donnings; ++donning) {
    const twin::Trial trial = twin::simulate(input, static_cast<std::uint64_t>(donning), 1).front();
    // A camera starts at another time each day.
    const double camera_clock_s =
        kCameraClock_s + static_cast<double>(twin::seed_of(request.seed, donning) % 10000) / 1000;
    out.push_back(to_recording(trial, request.parameters.camera_rate_hz, camera_clock_s));
  }
  return out;
}

std::optional<HandLag> hand_lag(const std::vector<GloveRecording>& recordings) {
  std::vector<double> whole;
  std::vector<double> sensors;
  for (const GloveRecording& one : recordings) {
    const double period_s =
        (one.camera.t_s.back() - one.camera.t_s.front()) / static_cast<double>(one.camera.t_s.size() - 1);
    const auto fingers = fingers_of(one.camera);
    const auto hand = fingers_of(one.hand);
    if (const auto lag = score::score_trial(fingers, hand, period_s).lag_removed) whole.push_back(lag->lag_s);
    for (std::size_t i = 0; i < kFingers; ++i) {
      if (const auto lag = sensor_lag_s(one, i)) sensors.push_back(*lag);
    }
  }
  if (whole.empty()) return std::nullopt;
  return HandLag{io::median(whole), sensors.empty() ? 0 : io::median(sensors)};
}

void write_recordings(const std::vector<GloveRecording>& recordings, const std::filesystem::path& folder) {
  io::make_folder(folder);
  for (std::size_t n = 0; n < recordings.size(); ++n) {
    const auto write = [&](const char* name, const recording::Recording& one) {
      io::write_file(folder / fmt::format("{}-{}.csv", name, n + 1), recording::to_csv(one));
    };
    write("glove", recordings[n].glove);
    write("camera", recordings[n].camera);
    write("hand", recordings[n].hand);
  }
}

std::vector<identify::Take> hand_recordings(const std::vector<GloveRecording>& recordings) {
  std::vector<identify::Take> out;
  for (const GloveRecording& one : recordings) {
    out.push_back({one.glove, std::vector<recording::Recording>(kFingers, one.camera)});
    for (recording::Column& column : out.back().sensor.columns) column.unit = "deg";  // as its name states
  }
  return out;
}

GloveFit fit_glove(const GloveRequest& request, const std::vector<GloveRecording>& recordings) {
  GloveFit out;
  if (const auto lag = hand_lag(recordings)) out.lead_s = lag->lead_s();
  const std::vector<identify::Take> logs = hand_recordings(recordings);
  identify::Options plain;
  plain.rate_hz = request.rate_hz;
  for (const std::string& finger : model::finger_names()) {
    plain.map.push_back({finger, {finger + "_alpha_deg"}, finger + "_deg"});
  }
  identify::Options leading = plain;
  leading.lead_s = out.lead_s.value_or(0);
  std::vector<std::string> notes;
  const auto fit = [&](const identify::Options& options) {
    return deploy::on_hand(identify::fit_takes(logs, options), request.parameters, notes);
  };
  out.identified = fit(leading);
  plain.structure = "limited-line";
  out.baselines.push_back({"line", fit(plain)});
  leading.structure = "line-lead";
  out.baselines.push_back({"line-lead", fit(leading)});
  plain.structure = "auto";
  plain.initial = compensator("published-hw", request.rate_hz).model;
  plain.refit = true;
  out.baselines.push_back({"published-hw-refitted", fit(plain)});
  return out;
}

}  // namespace flexor::study
