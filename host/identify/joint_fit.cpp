#include "host/identify/joint_fit.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/identify/hold.hpp"
#include "host/io/io.hpp"
#include "host/model/fixed_error.hpp"
#include "host/model/formats.hpp"

namespace flexor::identify {
namespace {

using io::InputError;

constexpr double kMostDrift_deg = 1;
constexpr int kAttacks = 15;  // of the search for fixed point's error
constexpr int kReadings = 5000;
constexpr double kMostFixedError_deg = 0.06;  // beside 1/16, the step of what a glove sends

// Why this candidate cannot be worn; empty: it can.
std::string refusal_of(const model::Model& model, double drift_deg) {
  if (drift_deg > kMostDrift_deg) {
    return fmt::format("held still, its angle drifts by {:.1f} degrees within a minute", drift_deg);
  }
  try {
    model::check_fixed(model);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

std::string imprecision_of(const model::Model& model) {
  model::ErrorSearch search;
  search.attacks = kAttacks;
  search.noise = kReadings;
  const double error_deg = model::worst_fixed_error_deg(model, search);
  if (error_deg <= kMostFixedError_deg) return "";
  return fmt::format("in the glove's integers it is up to {:.3f} degrees off", error_deg);
}

}  // namespace

model::Model joint_model(const model::Model& inputs, const Additive& fit, const JointMap& joint) {
  model::Model own = inputs;
  std::erase_if(own.inputs, [&](const model::Input& input) {
    return std::ranges::find(joint.sensors, input.name) == joint.sensors.end();
  });
  add_to(own, fit, joint.sensors, joint.joint);
  return own;
}

JointFit fit_joint(const std::vector<Session>& sessions, const model::Model& inputs, const JointMap& joint,
                   const std::string& structure, const Step& step) {
  JointFit out;
  std::optional<Additive> best;
  std::vector<std::string> refusals;
  std::size_t at = 0;  // of the rows
  const auto drift = [&](const Additive& fit) {
    return hold_drift_deg(joint_model(inputs, fit, joint), sessions, joint.sensors);
  };
  // The best that can be worn, unless one is precise as well.
  const auto accept = [&](const Additive& fit) {
    const model::Model model = joint_model(inputs, fit, joint);
    refusals.push_back(refusal_of(model, *fit.hold_drift_deg));
    const bool worn = refusals.back().empty();
    if (worn) refusals.back() = imprecision_of(model);
    const bool precise = refusals.back().empty();
    if (worn && (precise || !best)) {
      best = fit;
      at = refusals.size() - 1;
    }
    return precise;
  };
  const std::vector<Additive> all = fit_additive(sessions, inputs.sample_period_s, joint.joint, structure,
                                                 drift, kMostDrift_deg, accept, step);
  for (std::size_t k = 0; k < all.size(); ++k) {
    out.rows.push_back({describe(all[k].branches), all[k].cross_validated_deg, all[k].fitted_rmse_deg,
                        all[k].effective, all[k].hold_drift_deg, k < refusals.size() ? refusals[k] : "",
                        k == at});
  }
  if (!best) throw io::JobError(fmt::format("{}: {}", joint.joint, refusals.front()));
  out.fit = *best;
  out.structure = out.rows[at].structure;
  out.hold_drift_deg = *best->hold_drift_deg;
  return out;
}

}  // namespace flexor::identify
