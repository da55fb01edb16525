#include "host/study/recalibrated.hpp"

#include "host/identify/recalibrate_files.hpp"
#include "host/io/io.hpp"
#include "host/model/wiring.hpp"
#include "host/twin/random.hpp"

namespace flexor::study {
namespace {

constexpr double kPoseError_deg = 2;
constexpr double kHeld_s = 2;
constexpr double kLongestHeld_s = 8;
constexpr double kBetween_s = 1;
constexpr double kMotion_s = 30;
constexpr std::uint64_t kPoseErrors = 0x706f7365;  // draws of their own

// Open hand, then fist, as somebody holds them who was told to.
twin::Motion poses(const twin::Parameters& p, std::uint64_t seed, double held_s) {
  twin::Random random(twin::seed_of(seed, kPoseErrors));
  std::array<std::vector<double>, kFingers> angle;
  for (std::size_t i = 0; i < kFingers; ++i) {
    const double open = p.hand_lower_deg[i] + kPoseError_deg * (2 * random.uniform() - 1);
    const double fist = p.hand_upper_deg[i] + kPoseError_deg * (2 * random.uniform() - 1);
    angle[i] = {open, open, fist, fist};
  }
  return twin::Motion::from_samples("poses", {0, held_s, held_s + kBetween_s, 2 * held_s + kBetween_s},
                                    angle);
}

// As the glove's log has it: a column for each input.
recording::Recording log_of(const twin::TrialInput& input, std::uint64_t number) {
  const auto reading = twin::worn_readings(input, number);
  const model::Wiring wiring = model::wiring_of(input.compensator);
  recording::Recording out;
  out.source = input.worn->motion.name();
  for (std::size_t k = 0; k < reading[0].size(); ++k)
    out.t_s.push_back(static_cast<double>(k) * input.compensator.sample_period_s);
  for (std::size_t i = 0; i < input.compensator.inputs.size(); ++i)
    out.columns.push_back({input.compensator.inputs[i].name, reading[wiring.strip[i]]});
  return out;
}

// A wearer who is told that a pose was not held still holds both again, twice as long; empty: he gave it up.
identify::Held held(twin::TrialInput& input, std::uint64_t number) {
  for (double held_s = kHeld_s; held_s <= kLongestHeld_s; held_s *= 2) {
    input.worn = twin::Worn{poses(input.parameters, twin::seed_of(input.seed, number), held_s),
                            2 * held_s + kBetween_s};
    try {
      return identify::poses_in({"open", "fist"}, log_of(input, number), input.compensator);
    } catch (const io::JobError&) {
      continue;
    }
  }
  return {};
}

}  // namespace

model::Model with_readings_of(const std::vector<Compensator>& compensators, model::Model model) {
  const model::Wiring own = model::wiring_of(model);
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    model::Input& input = model.inputs[i];
    for (const Compensator& c : compensators) {
      const std::optional<std::size_t> other = model::wiring_of(c.model).input[own.strip[i]];
      if (!other) continue;
      const model::Input& known = c.model.inputs[*other];
      if (!input.poses) input.poses = known.poses;
      if (!input.readings) input.readings = known.readings;
    }
  }
  return model;
}

twin::TrialInput recalibrated(twin::TrialInput input, const std::string& by, std::uint64_t number) {
  if (by != "poses" && by != "motion")
    throw io::InputError("recalibrated \"{}\": known are poses, motion", by);
  identify::RecalibrationRequest request;
  request.model = input.compensator;
  if (by == "motion") {
    input.worn = twin::Worn{short_motion(), kMotion_s};
    request.motion.push_back(identify::motion_in(log_of(input, number), request.model));
  } else {
    request.held = held(input, number);
  }
  if (!request.motion.empty() || !request.held.empty())
    input.compensator = identify::recalibrate(request).model;
  return input;
}

}  // namespace flexor::study
