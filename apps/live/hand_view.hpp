// All 23 joints of the hand from those that the model gives (host/posture), beside the server's thread: learning how some
// joints determine the others takes a while, and the newest angles are enough for a picture.
#pragma once

#include <chrono>
#include <future>
#include <optional>
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
  // A model of which no joint is known gives nothing.
  explicit HandView(const model::Model& model) : inputs_(hand_inputs(model)) {}

  void add(double host_s, const std::vector<double>& joints_deg) { newest_ = {host_s, joints_deg}; }
  // The hand of angles that were the newest a while ago, once it is known; never waits. Throws where none can be made.
  std::optional<WholeHand> poll();

 private:
  struct Newest {
    double host_s = 0;
    std::vector<double> joints_deg;
  };
  WholeHand complete(const Newest& newest);

  std::vector<HandInput> inputs_;
  std::optional<Newest> newest_;  // of which no hand was made yet
  std::chrono::steady_clock::time_point due_;
  std::optional<posture::Completer> completer_;  // of what runs beside
  std::future<WholeHand> coming_;                // last, so that it ends first
};

}  // namespace flexor::live
