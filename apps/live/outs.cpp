#include "apps/live/outs.hpp"

#include <exception>

namespace flexor::live {

void Outs::wear(const model::Model& model) {
  std::vector<std::string> joints;
  for (const model::Joint& joint : model.joints) joints.push_back(joint.name);
  if (joints == joints_) return;
  joints_ = joints;
  sinks_.clear();
  for (const Open& open : open_) {
    try {
      sinks_.push_back(open(model));
    } catch (const std::exception& error) {
      failed_(error);
    }
  }
}

void Outs::add(double t_s, const std::vector<double>& joints_deg) {
  std::erase_if(sinks_, [&](const std::unique_ptr<exports::Sink>& sink) {
    try {
      sink->add(t_s, joints_deg);
      return false;
    } catch (const std::exception& error) {
      failed_(error);
      return true;
    }
  });
}

}  // namespace flexor::live
