// A trial's plan and its result on their way through a pipe: the same bits on the other side. Numbers are finite.
#pragma once

#include "host/io/pipe_json.hpp"
#include "host/twin/simulation.hpp"

namespace flexor::model {

inline void to_json(Json& json, const Model& model) { json = Json::parse(to_json(model)); }
inline void from_json(const Json& json, Model& model) { model = from_json(json.dump(), "pipe"); }
FLEXOR_PIPE(Poses, open, fist)
FLEXOR_PIPE(TrackedRange, poses, range_deg, valid_min, valid_max)

}  // namespace flexor::model

namespace flexor::twin {

inline void to_json(Json& json, const Parameters& parameters) { json = Json::parse(to_json(parameters)); }
inline void from_json(const Json& json, Parameters& parameters) {
  parameters = from_json(json.dump(), "pipe");
}
inline void to_json(Json& json, const Motion& motion) {
  json = {{"document", motion.document()}};
  if (motion.document().empty())
    json = {{"name", motion.name()}, {"t_s", motion.t_s()}, {"angle_deg", motion.sample_deg()}};
}
inline void from_json(const Json& json, Motion& motion) {
  motion = json.contains("document")
               ? Motion::from_json(json.at("document").get<std::string>(), "pipe")
               : Motion::from_samples(json.at("name"), json.at("t_s"), json.at("angle_deg"));
}
FLEXOR_PIPE(Worn, motion, duration_s, drift_turns_s)
FLEXOR_PIPE(Tracking, sensor)
FLEXOR_PIPE(TrialInput, parameters, motion, compensator, seed, record_samples, worn, tracking)
FLEXOR_PIPE(Trial, glove_deg, hand_deg, error_deg_s, impacts, impact_deg_s, pressed_s, frames_sent,
            frames_lost, sample_s, reading, beta_deg, true_deg)

}  // namespace flexor::twin
