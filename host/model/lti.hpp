// {"type": "lti", "gain" (1), "offset" (0), "poles_rad_s", "taps" (all zero)}
//
// H(s) = gain (c_0 + c_1 H_1 + ... + (1 - sum c) H_n), H_i = prod_{j<=i} a_j / (s + a_j), real poles -a_j;
// `offset` is added before the lags. No poles: a static gain and offset. Poles are negative, at most three,
// |pole| times the sample period from 1e-9 to 1e3; as many taps, at most 1000 either way, or none; gain and offset
// at most 1e29 either way.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "host/model/discrete.hpp"
#include "host/model/kind.hpp"
#include "runtime/compensator/lti.hpp"

namespace flexor::model {

inline constexpr double kMaxGain =
    1e29;  // kMaxSignal of the least range; float holds its product with kMaxSignal

// The most that fixed point may be from double on the same input in Q5: one step of the output, 1/16 degree.
// An input between two steps of Q5 is rounded first, by 1/64 of its unit at most, and takes the model's slope
// times that on top; so does a dead zone's edge between two steps.
inline constexpr double kFixedError_deg = 0.0625;

struct Lti {
  static constexpr bool kKeepsFraction = false;
  using Fixed = compensator::FixedLti<compensator::kMaxOrder, true>;
  template <class Real>
  using Floating = compensator::Lti<Real, compensator::kMaxOrder, true>;

  double gain = 1;
  double offset = 0;
  std::vector<double> poles_rad_s;
  std::vector<double> taps;

  static constexpr auto members() {
    return std::tuple(defaulted("gain", &Lti::gain), defaulted("offset", &Lti::offset),
                      required("poles_rad_s", &Lti::poles_rad_s, Bounds{0, compensator::kMaxOrder}),
                      defaulted("taps", &Lti::taps, Bounds{0, compensator::kMaxOrder}));
  }
  void check(const Place& place) const;
  Interval values(std::span<const Interval> in, double period_s) const;
  Need need(const FixedSignal& in, const Need&) const { return {in.values, kMostFraction, false}; }
  template <class Real>
  Floating<Real> floating(double period_s) const {
    const Padded padded = padded_at(period_s);
    Floating<Real> c{};
    c.gain = static_cast<Real>(gain);
    c.offset = static_cast<Real>(offset);
    for (int i = 0; i < kOrder; ++i) {
      c.input_weight[i] = static_cast<Real>(padded.input_weight(i));
      c.tap[i] = static_cast<Real>(padded.tap(i));
      for (int j = 0; j < i; ++j)
        c.chain_weight[compensator::chain_index(i, j)] = static_cast<Real>(padded.chain_weight(i, j));
    }
    return c;
  }
  Fixed fixed(const FixedBlock& block) const;
  bool operator==(const Lti&) const = default;

 private:
  // The chain padded in front: a chain of n < kOrder lags uses the last n, the others stay at their start value and have no weight.
  static constexpr int kOrder = compensator::kMaxOrder;
  struct Padded {
    Eigen::Vector<double, kOrder> input_weight = Eigen::Vector<double, kOrder>::Zero();
    Eigen::Matrix<double, kOrder, kOrder> chain_weight = Eigen::Matrix<double, kOrder, kOrder>::Zero();
    Eigen::Vector<double, kOrder> tap = Eigen::Vector<double, kOrder>::Zero();
  };
  Padded padded_at(double period_s) const;
};

namespace detail {

// Coefficients of compensator::DirectForm and the most that it can be from double, degrees: for every
// sequence of inputs in Q5 from 0 to `top`, as long as the angle stays below `upper_deg`. None where that
// exceeds kFixedError_deg, or where the block has what the form cannot do. The same bound keeps the form's
// angle, which has no sign, from falling below zero.
struct Direct {
  std::array<std::uint16_t, compensator::kMaxOrder> b{};
  std::array<std::uint16_t, compensator::kMaxOrder> a{};
  double error_deg = 0;
};
std::optional<Direct> direct_form(const Lti& lti, double top, double upper_deg, double period_s);

}  // namespace detail

}  // namespace flexor::model
