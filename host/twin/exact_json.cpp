#include "host/twin/exact_json.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/io/io.hpp"
#include "host/io/json.hpp"

namespace flexor::twin {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kSource = "pipe";  // names what was read in errors

template <class Numbers>
Json list(const Numbers& numbers) {
  Json out = Json::array();
  for (const auto number : numbers) out.push_back(exact_json(static_cast<double>(number)));
  return out;
}

template <class Number>
std::vector<Number> vector_of(const Json& json) {
  std::vector<Number> out;
  out.reserve(json.size());
  for (const Json& number : json) out.push_back(static_cast<Number>(number_of(number)));
  return out;
}

PerFinger per_finger_of(const Json& json) {
  PerFinger out{};
  for (std::size_t i = 0; i < kFingers; ++i) out[i] = number_of(json.at(i));
  return out;
}

template <class Number>
Json fingers(const std::array<std::vector<Number>, kFingers>& values) {
  Json out = Json::array();
  for (const std::vector<Number>& finger : values) out.push_back(list(finger));
  return out;
}

template <class Number>
std::array<std::vector<Number>, kFingers> fingers_of(const Json& json) {
  std::array<std::vector<Number>, kFingers> out;
  for (std::size_t i = 0; i < kFingers; ++i) out[i] = vector_of<Number>(json.at(i));
  return out;
}

}  // namespace

Json exact_json(double number) {
  if (std::isfinite(number)) return number;
  return std::isnan(number) ? "nan" : number > 0 ? "inf" : "-inf";
}

double number_of(const Json& json) {
  if (json.is_number()) return json.get<double>();
  const std::string word = json.get<std::string>();
  if (word == "nan") return std::numeric_limits<double>::quiet_NaN();
  if (word == "inf") return std::numeric_limits<double>::infinity();
  if (word == "-inf") return -std::numeric_limits<double>::infinity();
  throw io::InputError(kSource + (": " + word) + " is no number");
}

Json exact_json(const Motion& motion) {
  if (!motion.document().empty()) return {{"document", motion.document()}};
  return {{"name", motion.name()}, {"t_s", list(motion.t_s())}, {"angle_deg", fingers(motion.sample_deg())}};
}

Motion motion_of(const Json& json) {
  if (json.contains("document")) return Motion::from_json(json.at("document").get<std::string>(), kSource);
  std::vector<double> t_s = vector_of<double>(json.at("t_s"));
  std::array<std::vector<double>, kFingers> angle_deg = fingers_of<double>(json.at("angle_deg"));
  const bool all_there =
      std::ranges::all_of(angle_deg, [&](const auto& finger) { return finger.size() == t_s.size(); });
  if (t_s.empty() || !all_there) throw io::InputError("pipe: a motion without its samples");
  return Motion::from_samples(json.at("name").get<std::string>(), std::move(t_s), std::move(angle_deg));
}

Json exact_json(const TrialInput& input) {
  return {{"parameters", Json::parse(to_json(input.parameters))},
          {"motion", exact_json(input.motion)},
          {"compensator", Json::parse(model::to_json(input.compensator))},
          {"seed", input.seed},
          {"record_samples", input.record_samples}};
}

TrialInput trial_input_of(const Json& json) {
  return {from_json(json.at("parameters").dump(), kSource), motion_of(json.at("motion")),
          model::from_json(json.at("compensator").dump(), kSource), json.at("seed").get<std::uint64_t>(),
          json.at("record_samples").get<bool>()};
}

Json exact_json(const std::array<std::vector<float>, kFingers>& angles) { return fingers(angles); }

std::array<std::vector<float>, kFingers> angles_of(const Json& json) { return fingers_of<float>(json); }

Json exact_json(const Trial& t) {
  return {{"glove_deg", fingers(t.glove_deg)},    {"hand_deg", fingers(t.hand_deg)},
          {"error_deg_s", list(t.error_deg_s)},   {"impacts", t.impacts},
          {"impact_deg_s", list(t.impact_deg_s)}, {"pressed_s", list(t.pressed_s)},
          {"frames_sent", t.frames_sent},         {"frames_lost", t.frames_lost},
          {"sample_s", list(t.sample_s)},         {"reading", fingers(t.reading)},
          {"beta_deg", fingers(t.beta_deg)},      {"true_deg", fingers(t.true_deg)}};
}

Trial trial_of(const Json& json) {
  Trial t;
  t.glove_deg = angles_of(json.at("glove_deg"));
  t.hand_deg = angles_of(json.at("hand_deg"));
  t.error_deg_s = per_finger_of(json.at("error_deg_s"));
  t.impacts = json.at("impacts").get<std::array<int, kFingers>>();
  t.impact_deg_s = per_finger_of(json.at("impact_deg_s"));
  t.pressed_s = per_finger_of(json.at("pressed_s"));
  t.frames_sent = json.at("frames_sent").get<int>();
  t.frames_lost = json.at("frames_lost").get<int>();
  t.sample_s = vector_of<double>(json.at("sample_s"));
  t.reading = fingers_of<double>(json.at("reading"));
  t.beta_deg = fingers_of<double>(json.at("beta_deg"));
  t.true_deg = fingers_of<double>(json.at("true_deg"));
  return t;
}

}  // namespace flexor::twin
