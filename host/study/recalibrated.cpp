#include "host/study/recalibrated.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/donning/recalibrate_files.hpp"
#include "host/io/io.hpp"
#include "host/model/wiring.hpp"
#include "host/twin/random.hpp"

namespace flexor::study {
namespace {

constexpr double kPoseError_deg = 2;
constexpr double kHeld_s = 2;
constexpr double kBetween_s = 1;
constexpr double kMotion_s = 30;
constexpr std::uint64_t kPoseErrors = 0x706f7365;  // draws of their own

// Open hand, then fist, as somebody holds them who was told to.
twin::Motion poses(const twin::Parameters& p, std::uint64_t seed) {
  twin::Random random(twin::seed_of(seed, kPoseErrors));
  std::array<std::vector<double>, kFingers> angle;
  for (std::size_t i = 0; i < kFingers; ++i) {
    const double open = p.hand_lower_deg[i] + kPoseError_deg * (2 * random.uniform() - 1);
    const double fist = p.hand_upper_deg[i] + kPoseError_deg * (2 * random.uniform() - 1);
    angle[i] = {open, open, fist, fist};
  }
  return twin::Motion::from_samples("poses", {0, kHeld_s, kHeld_s + kBetween_s, 2 * kHeld_s + kBetween_s},
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
    throw io::InputError(fmt::format("recalibrated \"{}\": known are poses, motion", by));
  const bool still = by == "poses";
  input.worn = twin::Worn{still ? poses(input.parameters, twin::seed_of(input.seed, number)) : short_motion(),
                          still ? 2 * kHeld_s + kBetween_s : kMotion_s};
  const recording::Recording log = log_of(input, number);
  donning::Request request;
  request.model = input.compensator;
  if (still) request.holds = donning::poses_in({"open", "fist"}, log, request.model);
  if (!still) request.motion = donning::motion_in(log, request.model);
  input.compensator = donning::recalibrate(request).model;
  return input;
}

}  // namespace flexor::study
