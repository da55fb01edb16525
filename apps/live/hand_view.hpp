// All 23 joints of the hand from those that the model gives (host/posture), on a thread of their own: learning what some
// joints say of the others takes a while, and the newest angles are enough for a picture.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "host/model/model.hpp"
#include "host/posture/complete.hpp"

namespace flexor::live {

// Flexion positive, 0 when straight; the others as host/posture has them.
struct WholeHand {
  double host_s = 0;
  posture::Hand angle_deg;
  posture::Hand se_deg;
};

// A joint of the model as one of the 23: index_pip is itself, index the knuckle of the article's hand. None: it is no such joint.
struct HandInput {
  std::size_t joint = 0;  // of the model
  posture::Input input;
  double sign = 1;      // in host/posture flexion of the fingers is negative
  double open_deg = 0;  // where it is straight
};
std::vector<HandInput> hand_inputs(const model::Model& model);

class HandView {
 public:
  // `ready` and, where no hand can be made of it, `failed` are called on its thread. A model of which no joint is known gives nothing.
  HandView(const model::Model& model, std::function<void(const WholeHand&)> ready,
           std::function<void(const std::exception&)> failed);

  void add(double host_s, const std::vector<double>& joints_deg);

 private:
  struct Newest {
    double host_s = 0;
    std::vector<double> joints_deg;
  };
  void run(const std::stop_token& stop);

  std::vector<HandInput> inputs_;
  std::function<void(const WholeHand&)> ready_;
  std::function<void(const std::exception&)> failed_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::optional<Newest> newest_;
  std::jthread thread_;  // last, so that it ends first
};

}  // namespace flexor::live
