// Who receives the angles of the model that is worn: an OpenGloves driver, a stream, a file.
#pragma once

#include <exception>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "host/export/sink.hpp"
#include "host/model/model.hpp"

namespace flexor::live {

class Outs {
 public:
  using Open = std::function<std::unique_ptr<exports::Sink>(const model::Model&)>;
  using Failed =
      std::function<void(const std::exception&)>;  // one that can take no more ends, and nothing else

  Outs(std::vector<Open> open, Failed failed) : open_(std::move(open)), failed_(std::move(failed)) {}

  // They stay as long as the joints are the same, and are opened again for others.
  void wear(const model::Model& model) {
    std::vector<std::string> joints;
    for (const model::Joint& joint : model.joints) joints.push_back(joint.name);
    if (joints == std::exchange(joints_, joints)) return;
    sinks_.clear();
    for (const Open& open : open_) try_it([&] { sinks_.push_back(open(model)); });
  }
  void add(double t_s, const std::vector<double>& joints_deg) {
    std::erase_if(sinks_, [&](const auto& sink) { return !try_it([&] { sink->add(t_s, joints_deg); }); });
  }

 private:
  template <class Work>
  bool try_it(Work&& work) try {
    work();
    return true;
  } catch (const std::exception& error) {
    failed_(error);
    return false;
  }

  std::vector<Open> open_;
  Failed failed_;
  std::vector<std::string> joints_;
  std::vector<std::unique_ptr<exports::Sink>> sinks_;
};

}  // namespace flexor::live
