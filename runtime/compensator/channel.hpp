// One finger's compensator: dead zone -> hysteresis -> curve -> LTI -> curve -> saturation.
//
// Shape says at compile time which blocks exist and how large they may be; a block of capacity zero costs
// nothing. Coefficients are constant and may live in flash; State is all that changes.
// No heap, no exceptions; a step takes bounded time.
#pragma once

#include "runtime/compensator/curve.hpp"
#include "runtime/compensator/dead_zone.hpp"
#include "runtime/compensator/hysteresis.hpp"
#include "runtime/compensator/lti.hpp"
#include "runtime/core/status.hpp"

namespace flexor {
namespace compensator {

template <int kPlaysCapacity, int kInputKnotsCapacity, int kLtiOrder, int kOutputKnotsCapacity,
          bool kLtiTaps = true>
struct Shape {
  static_assert(kLtiOrder >= 0 && kLtiOrder <= kMaxOrder, "LTI order is 0 to 3");
  static constexpr int kPlays = kPlaysCapacity;
  static constexpr int kInputKnots = kInputKnotsCapacity;
  static constexpr int kOrder = kLtiOrder;
  static constexpr int kOutputKnots = kOutputKnotsCapacity;
  static constexpr bool kTaps = kLtiTaps;
};

// The published compensators: dead zone, first order, saturation.
using HammersteinWienerShape = Shape<0, 0, 1, 0, false>;

namespace detail {

// Arrays of capacity zero do not exist in C++: a block that is left out keeps room for one element.
constexpr int at_least_one(int n) { return n > 0 ? n : 1; }

}  // namespace detail

// Floating point, Real is float or double. Input in the model's unit, output in degrees.
template <class Real, class ShapeT>
struct Floating {
  using Input = Real;
  using Output = Real;
  using HysteresisBlock = Hysteresis<Real, detail::at_least_one(ShapeT::kPlays)>;
  using InputCurve = Curve<Real, detail::at_least_one(ShapeT::kInputKnots)>;
  using LtiBlock = Lti<Real, detail::at_least_one(ShapeT::kOrder), ShapeT::kTaps>;
  using OutputCurve = Curve<Real, detail::at_least_one(ShapeT::kOutputKnots)>;

  static bool is_nan(Real u) { return u != u; }
  static bool is_finite(Real y) { return y - y == Real{0}; }
  static Real gained(const LtiBlock& lti, Real v) { return lti.gain * v + lti.offset; }
  static Real refine(Real v, uint8_t) { return v; }
  static constexpr bool is_direct(const LtiBlock&) { return false; }
  static Real step_direct(const LtiBlock&, typename LtiBlock::State&, Real v) { return v; }
  static Real to_output_curve(Real y) { return y; }
  static Real to_output(Real y) { return y; }
  static Real curve_to_output(Real y, uint8_t) { return y; }
};

// Fixed point: input Q5 int16, output Q4 int16 (degrees), states Q20 int32.
template <class ShapeT>
struct Fixed {
  using Input = int16_t;
  using Output = int16_t;
  using HysteresisBlock = FixedHysteresis<detail::at_least_one(ShapeT::kPlays)>;
  using InputCurve = FixedCurve<detail::at_least_one(ShapeT::kInputKnots)>;
  using LtiBlock = FixedLti<detail::at_least_one(ShapeT::kOrder), ShapeT::kTaps>;
  using OutputCurve = FixedCurve<detail::at_least_one(ShapeT::kOutputKnots)>;

  static bool is_nan(int16_t) { return false; }
  static constexpr bool is_finite(int16_t) { return true; }
  static int32_t gained(const LtiBlock& lti, int16_t v) { return lti.scaled(v); }
  // `bits` more fraction bits for the hysteresis and the curve; what no longer fits saturates, beyond the
  // curve's ends.
  FLEXOR_INLINE static int16_t refine(int16_t v, uint8_t bits) {
    if (bits == 0) return v;
    const int16_t limit = static_cast<int16_t>(INT16_MAX >> bits);
    return static_cast<int16_t>(core::clamp<int16_t>(v, static_cast<int16_t>(-limit), limit) * (1 << bits));
  }
  static bool is_direct(const LtiBlock& lti) { return lti.is_direct; }
  FLEXOR_INLINE static int16_t step_direct(const LtiBlock& lti, typename LtiBlock::State& state, int16_t v) {
    return static_cast<int16_t>(lti.direct.step(state.direct, static_cast<uint16_t>(v)));
  }
  // The host refuses models whose signals do not fit here.
  FLEXOR_INLINE static int16_t to_output_curve(int32_t y) {
    return static_cast<int16_t>(core::round_shift(y, core::kStateFraction - core::kInputFraction));
  }
  FLEXOR_INLINE static int16_t to_output(int32_t y) {
    return static_cast<int16_t>(core::round_shift(y, core::kStateFraction - core::kOutputFraction));
  }
  // `shift` fraction bits more than Q4.
  static int16_t curve_to_output(int16_t y, uint8_t shift) {
    return shift == 0 ? y : core::narrow(core::round_shift(y, shift));
  }
};

template <class Arithmetic, class ShapeT>
class Channel {
 public:
  using Input = typename Arithmetic::Input;
  using Output = typename Arithmetic::Output;
  using Status = core::Status;

  struct Coefficients {
    Input valid_min;  // an input outside [valid_min, valid_max] is refused with a status
    Input valid_max;
    DeadZone<Input> dead_zone;
    uint8_t refinement;  // fixed point only: fraction bits beyond Q5 after the dead zone, with a curve only
    typename Arithmetic::HysteresisBlock hysteresis;
    typename Arithmetic::InputCurve input_curve;
    typename Arithmetic::LtiBlock lti;
    typename Arithmetic::OutputCurve output_curve;
    uint8_t output_curve_shift;  // fixed point only: fraction bits of the output curve beyond Q4
    Output lower;                // saturation, degrees
    Output upper;
    Output rest;  // output before the first good sample, degrees
  };

  struct State {
    typename Arithmetic::HysteresisBlock::State hysteresis;
    typename Arithmetic::LtiBlock::State lti;
  };

  // The output before the first good sample.
  FLEXOR_INLINE static Output rest(const Coefficients& c) { return core::clamp(c.rest, c.lower, c.upper); }

  // One sample in, one angle out: always within the saturation, whatever the input. `output` comes in as the
  // last one, at first rest(), and is left alone when the input is refused. The first good sample sets `bit`
  // of `started`, at first 0. The caller keeps both, so that a microcontroller writes each angle once and
  // holds the bits of all channels in one register. Floating point that overflows is refused too, as not a
  // number, and clears the bit: the state may hold an infinity, which the next good sample must not inherit.
  FLEXOR_INLINE static Status step(const Coefficients& c, State& state, uint8_t& started, uint8_t bit,
                                   Input u, Output& output) {
    if (__builtin_expect(!(u >= c.valid_min && u <= c.valid_max), false)) {
      return refusal(c, u);
    }
    Input v = c.dead_zone(u);
    if (ShapeT::kInputKnots > 0) v = Arithmetic::refine(v, c.refinement);
    if (__builtin_expect((started & bit) == 0, false)) {
      start(c, state, v);
      started = static_cast<uint8_t>(started | bit);
    }
    if (ShapeT::kPlays > 0) v = c.hysteresis.step(state.hysteresis, v);
    if (ShapeT::kInputKnots > 0) v = c.input_curve(v);
    const Output y = linear(c, state, v);
    if (__builtin_expect(!Arithmetic::is_finite(y), false)) {
      started = static_cast<uint8_t>(started & ~bit);
      return Status::not_a_number;
    }
    output = core::clamp(y, c.lower, c.upper);
    return Status::ok;
  }

 private:
  // LTI block and the curve after it.
  FLEXOR_INLINE static Output linear(const Coefficients& c, State& state, Input v) {
    if (ShapeT::kOrder > 0 && Arithmetic::is_direct(c.lti))
      return Arithmetic::step_direct(c.lti, state.lti, v);
    const auto y = ShapeT::kOrder > 0 ? c.lti.step(state.lti, v) : Arithmetic::gained(c.lti, v);
    if (ShapeT::kOutputKnots == 0 || c.output_curve.count == 0) return Arithmetic::to_output(y);
    return Arithmetic::curve_to_output(c.output_curve(Arithmetic::to_output_curve(y)), c.output_curve_shift);
  }

  FLEXOR_INLINE static Status refusal(const Coefficients& c, Input u) {
    if (Arithmetic::is_nan(u)) return Status::not_a_number;
    if (u < c.valid_min) return Status::below_range;
    return Status::above_range;
  }

  FLEXOR_INLINE static void start(const Coefficients& c, State& state, Input v) {
    if (ShapeT::kPlays > 0) c.hysteresis.start(state.hysteresis, v);
    if (ShapeT::kOrder > 0) c.lti.start(state.lti, ShapeT::kInputKnots > 0 ? c.input_curve(v) : v);
  }
};

}  // namespace compensator
}  // namespace flexor
