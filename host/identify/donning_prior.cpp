#include "host/identify/donning_prior.hpp"

#include <cmath>

#include "host/io/json.hpp"

namespace flexor::identify {
namespace {

constexpr const char* kPriorSchema = "flexor-donning-prior";
constexpr int kPriorVersion = 1;
constexpr std::pair<const char*, double Prior::*> kDeviations[] = {{"shift_sd", &Prior::shift_sd},
                                                                   {"log_gain_sd", &Prior::log_gain_sd},
                                                                   {"motion_sd", &Prior::motion_sd},
                                                                   {"reach_sd", &Prior::reach_sd},
                                                                   {"density_sd", &Prior::density_sd}};
constexpr double kLeastSd = 1e-4;
constexpr double kMostSd = 10;

double pooled(double general, double own, int recordings) {
  const double freedom = recordings - 1;
  return std::sqrt((kGeneralWeight * general * general + freedom * own * own) / (kGeneralWeight + freedom));
}

}  // namespace

Prior shipped_prior() { return {9, 0.18, 0.13, 0.8, 0.05, 0.08, 0.1}; }

Prior prior_from_json(const std::string& text, const std::string& source) {
  const auto json = io::parse_json(text, source);
  io::JsonReader reader(json, source);
  reader.schema(kPriorSchema, kPriorVersion);
  Prior out;
  out.sessions = reader.whole_within("sessions", 0, 1000000);
  for (const auto& [name, deviation] : kDeviations)
    out.*deviation = reader.number_within(name, kLeastSd, kMostSd);
  out.alike = shipped_prior().alike;
  if (reader.has("alike")) out.alike = reader.number_within("alike", 0, kMostAlike);
  reader.done();
  return out;
}

Prior prior_of(const model::Input& input, const Prior& general) {
  if (!input.donnings || !input.readings) return general;
  Prior out = general;
  const double span = input.readings->span();
  const int recordings = input.donnings->recordings;
  const double to_mean = std::sqrt(1 + 1. / recordings);  // from a new one to the mean of these
  out.shift_sd = pooled(general.shift_sd, to_mean * input.donnings->shift_sd / span, recordings);
  out.log_gain_sd = pooled(general.log_gain_sd, to_mean * input.donnings->log_gain_sd, recordings);
  return out;
}

}  // namespace flexor::identify
