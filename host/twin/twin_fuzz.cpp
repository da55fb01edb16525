// Any bytes as the twin's configuration and as a gesture: an InputError of one line, or parameters that
// round-trip and a motion, with which a trial gives finite angles.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "host/io/fuzz_json.hpp"
#include "host/model/channel.hpp"
#include "host/twin/motion.hpp"
#include "host/twin/parameters.hpp"
#include "host/twin/simulation.hpp"

namespace {

using namespace flexor;
using io::fuzz::require;

// Sends the reading as it is.
model::Model straight_through() {
  model::Model m;
  m.sample_period_s = 0.01;
  for (const std::string& finger : model::finger_names()) {
    model::Channel c;
    c.name = finger;
    c.valid_min = -100;
    c.valid_max = 1023;
    c.saturation = {0, 180};
    c.rest_deg = 90;
    model::add(m, c);
  }
  return m;
}

void read_parameters(const std::string& text) {
  static const twin::Motion motion = twin::Motion::from_json(
      R"({"schema": "flexor-gesture", "schema_version": 1, "name": "x", "duration_s": 0.1, "corner_s": 0.01,
          "speed_deg_s": 800, "start": 60,
          "moves": [{"start_s": 0.01, "fingers": ["thumb", "ring"], "to": 90}]})",
      "motion");
  static const model::Model model = straight_through();
  const twin::Parameters p = twin::from_json(text, io::fuzz::kSource);
  const std::string again = twin::to_json(p);
  require(twin::to_json(twin::from_json(again, "again")) == again);
  for (const twin::Fault& fault : p.faults) require(std::isfinite(fault.start_s + fault.duration_s));
  // A trial takes a millisecond: one in twenty configurations plays one, chosen by its bytes, so that a finding repeats.
  if (std::hash<std::string>()(text) % 20 != 0) return;
  const twin::TrialInput input{p, motion, model, 1, true};
  try {
    twin::check(input);
  } catch (const io::InputError&) {
    return;  // a radio that is too slow for this glove
  }
  const twin::Trial trial = twin::simulate_scalar(input, 0, 1).front();
  for (std::size_t i = 0; i < twin::kFingers; ++i) {
    for (const float angle : trial.glove_deg[i]) require(std::isfinite(angle));
    for (const float angle : trial.hand_deg[i]) require(std::abs(angle) < 1000);
    for (const double angle : trial.beta_deg[i]) require(angle >= 0 && angle <= 180);
    require(std::isfinite(trial.error_deg_s[i] + trial.impact_deg_s[i] + trial.pressed_s[i]));
  }
}

void read_motion(const std::string& text) {
  const twin::Motion m = twin::Motion::from_json(text, io::fuzz::kSource);
  require(m.duration_s() >= 0.01 && m.duration_s() <= twin::kMaxDuration_s);
  require(m.number() >= 0 && m.number() <= 6);
  twin::Variation hurried;
  hurried.delay_s = 0.1;
  hurried.speed = 1.5;
  constexpr int kTimes = 200;
  for (int i = 0; i < twin::kFingers; ++i) {
    for (int k = -2; k <= kTimes + 2; ++k) {
      const double t_s = m.duration_s() * k / kTimes;
      for (const twin::Variation& v : {twin::Variation(), hurried}) {
        const double angle = m.angle(i, t_s, v);
        require(angle >= -1e-6 && angle <= 180 + 1e-6);
      }
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  io::fuzz::read_or_refuse([&] { read_parameters(text); });
  io::fuzz::read_or_refuse([&] { read_motion(text); });
  return 0;
}
