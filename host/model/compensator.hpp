// Runs a model document through the blocks of runtime/compensator: the very code that ships on the
// microcontroller, one block after the other.
#pragma once

#include <span>
#include <type_traits>
#include <variant>
#include <vector>

#include "host/model/formats.hpp"
#include "runtime/core/status.hpp"

namespace flexor::model {

struct FixedArithmetic {
  using Number = std::int16_t;
};
struct DoubleArithmetic {
  using Number = double;
};
struct FloatArithmetic {
  using Number = float;
};

namespace detail {

template <class K, class Arithmetic>
using CoefficientsOf = std::conditional_t<std::is_same_v<Arithmetic, FixedArithmetic>, typename K::Fixed,
                                          typename K::template Floating<typename Arithmetic::Number>>;

// Blocks without a state have an empty one.
std::monostate state_of(...);
template <class Coefficients>
typename Coefficients::State state_of(const Coefficients*);

template <class K, class Arithmetic>
struct Node {
  CoefficientsOf<K, Arithmetic> c;
  decltype(state_of(&c)) state{};
};

}  // namespace detail

template <class Arithmetic>
class Compensator {
 public:
  // Throws io::InputError when the model does not fit the arithmetic.
  explicit Compensator(const Model& model);

  std::size_t inputs() const { return valid_min_.size(); }
  std::size_t joints() const { return samples_.size(); }

  struct Sample {
    double angle_deg;
    core::Status status;
  };

  // One reading of each input, in the model's units. An angle whose inputs are all good follows them; any other is
  // held, with the status of its first bad input, and so is the state of every block that a bad input reaches. In
  // fixed point readings are rounded to Q5 and saturated, so that NaN is refused as below the range.
  std::span<const Sample> step(std::span<const double> reading);

  // For a model of one input and one joint.
  Sample step(double reading) { return step({&reading, 1}).front(); }

 private:
  using Number = typename Arithmetic::Number;
  template <class K>
  using NodeOf = detail::Node<K, Arithmetic>;
  using Node = typename EachOf<NodeOf, Kind>::type;
  static constexpr bool kFixed = std::is_same_v<Arithmetic, FixedArithmetic>;

  struct Block {
    Node node;
    std::vector<std::uint16_t> from;
    bool started = false;
  };
  struct Output {
    std::uint16_t signal;
    std::uint16_t unlimited;  // the signal before the saturation
    int fraction;
  };

  static Number number(double u);
  static double in_degrees(Number y, int fraction);
  core::Status read(std::size_t input, double u);
  void run(Block& block, Number& out);
  void forget(std::size_t signal);

  std::vector<Number> valid_min_;
  std::vector<Number> valid_max_;
  std::vector<std::uint8_t> refinement_;  // of inputs, bits beyond Q5
  std::vector<Block> blocks_;
  std::vector<Output> outputs_;
  std::vector<Number> signals_;
  std::vector<core::Status> status_;  // of each signal
  std::vector<Sample> samples_;
};

extern template class Compensator<DoubleArithmetic>;
extern template class Compensator<FloatArithmetic>;
extern template class Compensator<FixedArithmetic>;

}  // namespace flexor::model
