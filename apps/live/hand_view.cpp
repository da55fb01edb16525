#include "apps/live/hand_view.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "host/study/builtin.hpp"

namespace flexor::live {
namespace {

constexpr auto kPeriod = std::chrono::milliseconds(50);

}  // namespace

std::vector<HandInput> hand_inputs(const model::Model& model) {
  std::vector<HandInput> out;
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    const std::string& name = model.joints[j].name;
    const bool bare = name.find('_') == std::string::npos;
    const std::optional<int> joint = posture::find_joint(bare ? name + "_mcp" : name);
    if (!joint) continue;
    const bool is_known = std::ranges::any_of(
        out, [&](const HandInput& other) { return other.input.joints == std::vector<int>{*joint}; });
    if (is_known) continue;  // index and index_mcp are one: the first counts
    HandInput input;
    input.joint = j;
    input.input = {name, {*joint}};
    const model::Ends ends = model::ends(model, model.joints[j]);
    input.open_deg = ends.open_deg;
    const bool falls = ends.fist_deg < ends.open_deg;
    input.sign = falls == posture::flexes(*joint) ? 1 : -1;
    out.push_back(input);
  }
  return out;
}

std::optional<WholeHand> HandView::poll() {
  std::optional<WholeHand> out;
  if (coming_.valid() && coming_.wait_for(std::chrono::seconds(0)) == std::future_status::ready)
    out = coming_.get();
  const auto now = std::chrono::steady_clock::now();
  if (coming_.valid() || inputs_.empty() || !newest_ || now < due_) return out;
  due_ = now + kPeriod;
  coming_ = std::async(std::launch::async, &HandView::complete, this, *std::exchange(newest_, {}));
  return out;
}

WholeHand HandView::complete(const Newest& newest) {
  static const posture::Posture known = posture::parse(study::builtin("posture.json"), "posture.json");
  if (!completer_) {
    std::vector<posture::Input> inputs;
    for (const HandInput& input : inputs_) inputs.push_back(input.input);
    completer_.emplace(known, inputs, false);
  }
  Eigen::VectorXd readings(std::ssize(inputs_));
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    const double angle = newest.joints_deg[inputs_[i].joint];
    readings[static_cast<Eigen::Index>(i)] = inputs_[i].sign * (angle - inputs_[i].open_deg);
  }
  posture::Estimate estimate = completer_->complete(readings);
  // What a sensor reads is drawn, also where it is unlikely: who looks at it shall see what is measured.
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    const double reading = readings[static_cast<Eigen::Index>(i)];
    if (std::isfinite(reading)) estimate.angle_deg[inputs_[i].input.joints.front()] = reading;
  }
  for (int j = 0; j < posture::kJoints; ++j)
    if (posture::flexes(j)) estimate.angle_deg[j] *= -1;
  return {newest.host_s, estimate.angle_deg, estimate.se_deg};
}

}  // namespace flexor::live
