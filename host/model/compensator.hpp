// Runs a model document through runtime/compensator: the very code that ships on the microcontroller.
#pragma once

#include <cmath>
#include <vector>

#include "host/model/coefficients.hpp"

namespace flexor::model {

// Double, float or fixed point, for any document. Not for speed: firmware and benchmarks use exact shapes.
using DoubleArithmetic = compensator::Floating<double, AnyShape>;
using FloatArithmetic = compensator::Floating<float, AnyShape>;
using FixedArithmetic = compensator::Fixed<AnyShape>;

template <class Arithmetic>
class Compensator {
 public:
  // Throws io::InputError when the model does not fit the arithmetic.
  explicit Compensator(const Model& model) {
    for (const Channel& channel : model.channels) {
      coefficients_.push_back(make(channel, model.sample_period_s));
      states_.emplace_back();
      started_.emplace_back();
      last_.push_back(ChannelT::rest(coefficients_.back()));
    }
  }

  std::size_t channels() const { return states_.size(); }

  struct Sample {
    double angle_deg;
    core::Status status;
  };

  // One sample of channel i, in the model's input unit. In fixed point the input is rounded to Q5 and
  // saturated, so that NaN is refused as below the range.
  Sample step(std::size_t i, double u) {
    const core::Status status =
        ChannelT::step(coefficients_[i], states_[i], started_[i], 1, to_input(u), last_[i]);
    return {from_output(last_[i]), status};
  }

 private:
  using ChannelT = compensator::Channel<Arithmetic, AnyShape>;
  static constexpr bool kFixed = std::is_same_v<Arithmetic, FixedArithmetic>;

  static auto make(const Channel& channel, double period_s) {
    if constexpr (kFixed) {
      return fixed_coefficients<AnyShape>(channel, period_s);
    } else {
      return floating_coefficients<typename Arithmetic::Input, AnyShape>(channel, period_s);
    }
  }

  static typename Arithmetic::Input to_input(double u) {
    if constexpr (kFixed) {
      if (!(u > -1024)) return INT16_MIN;
      return static_cast<std::int16_t>(
          std::lround(std::ldexp(std::min(u, 32767.0 / 32), core::kInputFraction)));
    } else {
      return static_cast<typename Arithmetic::Input>(u);
    }
  }

  static double from_output(typename Arithmetic::Output output) {
    if constexpr (kFixed) {
      return std::ldexp(output, -core::kOutputFraction);
    } else {
      return output;
    }
  }

  std::vector<typename ChannelT::Coefficients> coefficients_;
  std::vector<typename ChannelT::State> states_;
  std::vector<std::uint8_t> started_;
  std::vector<typename Arithmetic::Output> last_;
};

}  // namespace flexor::model
