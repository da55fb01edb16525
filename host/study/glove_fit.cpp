#include "host/study/glove_fit.hpp"

#include "host/deploy/hardware.hpp"

namespace flexor::study {

std::vector<identify::Take> hand_recordings(const std::vector<GloveRecording>& recordings) {
  std::vector<identify::Take> out;
  for (const GloveRecording& one : recordings) {
    out.push_back({one.glove, std::vector<recording::Recording>(kFingers, one.camera)});
    for (recording::Column& column : out.back().sensor.columns) column.unit = "deg";  // as its name says
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
