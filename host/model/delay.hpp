// {"type": "delay", "samples"}: by 1 to kMaxDelay samples.
#pragma once

#include "host/model/kind.hpp"
#include "runtime/compensator/delay.hpp"

namespace flexor::model {

inline constexpr int kMaxDelay = 32;

struct Delay {
  static constexpr const char* kType = "delay";
  static constexpr bool kKeepsFraction = true;
  using Fixed = compensator::Delay<std::int16_t, kMaxDelay>;
  template <class Real>
  using Floating = compensator::Delay<Real, kMaxDelay>;

  int samples = 1;

  static constexpr auto members() {
    return std::tuple(required("samples", &Delay::samples, Bounds{1, kMaxDelay}));
  }
  void check(const Place& place) const {
    place.require(samples >= 1 && samples <= kMaxDelay, fmt::format("must be 1 to {} samples", kMaxDelay));
  }
  Interval values(std::span<const Interval> in, double) const { return in[0]; }
  Need need(const FixedSignal&, const Need& out) const { return out; }
  template <class Real>
  Floating<Real> floating(double) const {
    return {static_cast<std::uint8_t>(samples)};
  }
  Fixed fixed(const FixedBlock&) const { return {static_cast<std::uint8_t>(samples)}; }
  static Source source(const Fixed& c) {
    return {fmt::format("Delay<int16_t, {}>", c.count), fmt::format("{{{}}}", c.count)};
  }
  bool operator==(const Delay&) const = default;
};

}  // namespace flexor::model
