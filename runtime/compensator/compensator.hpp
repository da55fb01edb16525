// A glove's compensator: N channels side by side, one sample of each per step.
#pragma once

#include "runtime/compensator/channel.hpp"

namespace flexor {
namespace compensator {

// Arithmetic is Floating<float, ShapeT>, Floating<double, ShapeT> or Fixed<ShapeT>; kChannels >= 1.
template <class Arithmetic, class ShapeT, int kChannels>
class Compensator {
 public:
  using ChannelT = Channel<Arithmetic, ShapeT>;
  using Coefficients = typename ChannelT::Coefficients;
  using Input = typename Arithmetic::Input;
  using Output = typename Arithmetic::Output;
  using Status = core::Status;

  // `coefficients` are kChannels of them and must outlive this object.
  explicit Compensator(const Coefficients* coefficients) : coefficients_(coefficients) { reset(); }

  // Forgets the past: the next good sample of each channel starts it without a transient.
  void reset() {
    for (int i = 0; i < kChannels; ++i) {
      last_[i] = ChannelT::rest(coefficients_[i]);
      started_[i] = 0;
    }
  }

  // input, output and status: kChannels elements each.
  void step(const Input* input, Output* output, Status* status) {
    for (int i = 0; i < kChannels; ++i) {
      status[i] = ChannelT::step(coefficients_[i], states_[i], started_[i], 1, input[i], last_[i]);
      output[i] = last_[i];
    }
  }

 private:
  const Coefficients* coefficients_;
  typename ChannelT::State states_[kChannels];
  Output last_[kChannels];
  uint8_t started_[kChannels];
};

}  // namespace compensator
}  // namespace flexor
