#include "host/twin/motion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/model/model.hpp"

namespace flexor::twin {
namespace {

// The published hand's range, between which a trial's offsets are interpolated.
constexpr PerFinger kLower = {90, 28, 28, 28, 28};
constexpr PerFinger kUpper = {170, 113, 113, 113, 113};

constexpr double kLeastTurn_deg = 1e-6;  // what is less takes no time

// Integral of a ramp that rises from 0 to R during [0, R].
double ramp_integral(double x, double r) {
  if (x <= 0) return 0;
  return x < r ? x * x / 2 : r * r / 2 + r * (x - r);
}

constexpr double kLeastSpeed_deg_s = 0.1;
constexpr double kMostSpeed_deg_s = 10000;

std::size_t finger_of(const std::string& name, const io::JsonReader& reader) {
  try {
    return model::finger_index(name);
  } catch (const io::InputError& error) {
    reader.fail(error.what());
  }
}

}  // namespace

struct Motion::Reader {
  io::JsonReader document;
  Motion& motion;
  Json poses = document.object_or_empty("poses");
  double usual_speed_deg_s = 0;

  // A number, or the name of a pose.
  double angle(const Json& value, std::size_t finger) const {
    const std::string& name = model::finger_names()[finger];
    const Json* number = &value;
    if (!value.is_number()) {
      if (!value.is_string() || !poses.contains(value.get<std::string>()))
        document.fail(fmt::format("{} is neither an angle in degrees nor a pose in \"poses\"", value.dump()));
      const Json& pose = poses.at(value.get<std::string>());
      if (!pose.is_object() || !pose.contains(name) || !pose.at(name).is_number())
        document.fail(fmt::format("pose {} has no angle for {}", value.dump(), name));
      number = &pose.at(name);
    }
    const double angle_deg = number->get<double>();
    if (!(angle_deg >= 0 && angle_deg <= 180)) {
      document.fail(fmt::format("{} of {} is {:g} degrees; it must lie between 0 and 180",
                                value.is_number() ? "angle" : value.dump(), name, angle_deg));
    }
    return angle_deg;
  }

  void settings() {
    motion.name_ = document.text("name");
    motion.description_ = document.text_or_empty("description");
    motion.number_ = document.has("number") ? document.whole_within("number", 0, 6) : 0;
    motion.duration_s_ = document.number_within("duration_s", 0.01, kMaxDuration_s);
    motion.corner_s_ = document.number_within("corner_s", 0.001, kMaxDuration_s);
    usual_speed_deg_s = document.number_within("speed_deg_s", kLeastSpeed_deg_s, kMostSpeed_deg_s);
    const Json& start = document.member("start");
    for (std::size_t i = 0; i < kFingers; ++i) {
      const std::string& name = model::finger_names()[i];
      if (start.is_object() && !start.contains(name)) document.fail(fmt::format("\"start\" has no {}", name));
      motion.start_deg_[i] = angle(start.is_object() ? start.at(name) : start, i);
    }
  }

  void moves(const std::string& source) {
    std::array<double, kFingers> busy_until{};
    std::array<double, kFingers> at = motion.start_deg_;
    double first_move_s = kMaxDuration_s;
    const Json& list = document.member("moves");
    if (!list.is_array()) document.fail("\"moves\" must be a list");
    for (const Json& entry : list) {
      io::JsonReader move(entry, fmt::format("{}: moves", source));
      const double start_s = move.number_within("start_s", 0, motion.duration_s_);
      const double speed = move.has("speed_deg_s")
                               ? move.number_within("speed_deg_s", kLeastSpeed_deg_s, kMostSpeed_deg_s)
                               : usual_speed_deg_s;
      const Json& to = move.member("to");
      for (const Json& finger : move.list("fingers")) {
        if (!finger.is_string()) move.fail("\"fingers\" must be names");
        const std::size_t i = finger_of(finger.get<std::string>(), move);
        const double target = angle(to, i);
        if (std::abs(target - at[i]) < kLeastTurn_deg) continue;
        if (start_s < busy_until[i]) {
          move.fail(fmt::format(
              "{} starts at {} s while its move before lasts until {:.2f} s: start later or move faster",
              model::finger_names()[i], start_s, busy_until[i]));
        }
        const Move one{start_s, std::abs(target - at[i]) / speed, at[i], target};
        busy_until[i] = start_s + one.ramp_s + motion.corner_s_;
        at[i] = target;
        motion.moves_[i].push_back(one);
        first_move_s = std::min(first_move_s, start_s);
      }
      move.done();
    }
    if (first_move_s < kMaxDuration_s) motion.anchor_s_ = first_move_s;
  }
};

Motion Motion::from_json(const std::string& text, const std::string& source) {
  const Json json = io::parse_json(text, source);
  Motion m;
  m.document_ = text;
  Reader read{io::JsonReader(json, source), m};
  read.document.schema("flexor-gesture", 1);
  (void)read.document.has("choices");
  read.settings();
  read.moves(source);
  read.document.done();
  return m;
}

Motion Motion::from_samples(std::string name, std::vector<double> t_s,
                            std::array<std::vector<double>, kFingers> angle_deg) {
  Motion m;
  m.name_ = std::move(name);
  m.duration_s_ = t_s.back();
  m.t_s_ = std::move(t_s);
  m.sample_deg_ = std::move(angle_deg);
  return m;
}

double Motion::planned(int finger, double t_s, const Variation& v) const {
  const auto i = static_cast<std::size_t>(finger);
  const double t = anchor_s_ + (t_s - v.delay_s - anchor_s_) * v.speed;
  if (!t_s_.empty()) {
    const auto after = std::ranges::upper_bound(t_s_, t);
    if (after == t_s_.begin()) return sample_deg_[i].front();
    if (after == t_s_.end()) return sample_deg_[i].back();
    const auto k = static_cast<std::size_t>(after - t_s_.begin());
    const double share = (t - t_s_[k - 1]) / (t_s_[k] - t_s_[k - 1]);
    return sample_deg_[i][k - 1] + share * (sample_deg_[i][k] - sample_deg_[i][k - 1]);
  }
  double angle = start_deg_[i];
  for (const Move& move : moves_[i]) {
    if (t <= move.start_s) break;
    const double r = move.ramp_s;
    const double x = t - move.start_s;
    const double done =
        std::min((ramp_integral(x, r) - ramp_integral(x - corner_s_, r)) / (r * corner_s_), 1.0);
    angle = move.from_deg + done * (move.to_deg - move.from_deg);
  }
  return angle;
}

double Motion::angle(int finger, double t_s, const Variation& v) const {
  const auto i = static_cast<std::size_t>(finger);
  const double in_full = planned(finger, t_s, v);
  const double angle = in_full - (1 - v.pose_share) * (in_full - kLower[i]);
  const double share = (angle - kLower[i]) / (kUpper[i] - kLower[i]);
  return angle + v.lower_offset_deg[i] + share * (v.upper_offset_deg[i] - v.lower_offset_deg[i]);
}

}  // namespace flexor::twin
