#include "apps/camera/cameras.hpp"

namespace flexor::filming {

nlohmann::ordered_json to_json(const Tracked& r, const TrackRequest& request) {
  nlohmann::ordered_json angles = nlohmann::ordered_json::object();
  for (const camera::AngleSummary& a : r.summary.angles) {
    angles[a.name] = {
        {"frames_good", a.frames[0]}, {"frames_doubtful", a.frames[1]},      {"frames_hidden", a.frames[2]},
        {"frames_lost", a.frames[3]}, {"standard_error_deg", a.mean_se_deg}, {"min_deg", a.min_deg},
        {"max_deg", a.max_deg}};
  }
  nlohmann::ordered_json unsure = nlohmann::ordered_json::array();
  for (const camera::Unsure& u : r.summary.unsure) {
    unsure.push_back({{"from_s", u.from_s},
                      {"to_s", u.to_s},
                      {"frames", u.frames},
                      {"quality", static_cast<int>(u.worst)}});
  }
  return {{"video", request.video.string()},
          {"joints", request.joints.string()},
          {"out", request.out.string()},
          {"frames", r.summary.frames},
          {"frames_labelled", r.summary.labelled},
          {"frames_dropped", r.summary.dropped},
          {"from_s", r.summary.from_s},
          {"to_s", r.summary.to_s},
          {"width", r.width},
          {"height", r.height},
          {"angles", std::move(angles)},
          {"unsure_stretches", r.summary.unsure_stretches},
          {"unsure", std::move(unsure)},
          {"decoding_s", r.decoding_s},
          {"tracking_s", r.tracking_s},
          {"warnings", r.warnings},
          {"version", FLEXOR_VERSION}};
}

nlohmann::ordered_json to_json(const camera::MarkProposal& proposal, const MarkProposalRequest& request) {
  nlohmann::ordered_json candidates = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < proposal.candidates.size(); ++i) {
    const camera::Mark& m = proposal.candidates[i];
    candidates.push_back({{"number", i + 1},
                          {"mark", proposal.name[i]},
                          {"x_px", m.centre.x},
                          {"y_px", m.centre.y},
                          {"area_px", m.area_px}});
  }
  return {{"candidates", std::move(candidates)},
          {"trouble", proposal.trouble},
          {"picture", request.picture.string()},
          {"joints", request.save.string()},
          {"version", FLEXOR_VERSION}};
}

nlohmann::ordered_json to_json(const camera::LensFit& result, const LensFitRequest& request) {
  nlohmann::ordered_json json = nlohmann::ordered_json::parse(camera::to_json(result.lens));
  json["used"] = result.used;
  json["refused"] = result.refused;
  json["file"] = request.out.string();
  json["version"] = FLEXOR_VERSION;
  return json;
}

}  // namespace flexor::filming
