// People whose hands are known: fingers bend by five numbers, each person differs by an offset and a gain of every
// joint, DIP follows PIP, and every angle has noise of one degree.
#pragma once

#include <fmt/format.h>

#include <random>
#include <vector>

#include "host/posture/learn.hpp"

namespace flexor::posture::test {

inline double coupled_deg(double pip_deg) { return pip_deg * pip_deg / -150; }

// Trials of three seconds at 10 Hz: half a second at rest, then a held posture.
inline Recorded person(std::uint64_t seed, const std::string& name, int trials = 30) {
  constexpr int kRows = 30;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> bend(0, 1);
  const auto finger_of = [](int joint) { return std::min(joint / 4, 4); };
  Hand offset = Hand::NullaryExpr([&] { return 6 * normal(random); });
  Hand gain = Hand::NullaryExpr([&] { return 1 + 0.1 * normal(random); });
  Recorded out{name, fmt::format("seed{}", seed), Hands(trials * kRows, kJoints), {}};
  for (int trial = 0; trial < trials; ++trial) {
    const double common = bend(random);
    std::array<double, 5> fingers{};
    for (double& f : fingers) f = 0.6 * common + 0.4 * bend(random);
    const double split = 0.2 * normal(random);  // of a bend between MCP and PIP: what a strip cannot tell
    for (int k = 0; k < kRows; ++k) {
      const double share = k < 5 ? 0 : 1;
      Hand hand;
      for (int j = 0; j < kJoints; ++j) {
        const double range_deg = -60 * (j % 4 == 0 ? 1 + split : 1 - split);
        hand[j] = offset[j] + gain[j] * share * fingers[static_cast<std::size_t>(finger_of(j))] * range_deg;
      }
      for (const Coupling& c : kCouplings) hand[c.joint] = coupled_deg(hand[c.follows]);
      for (int j = 0; j < kJoints; ++j) hand[j] += normal(random);
      out.hands_deg.row(trial * kRows + k) = hand.transpose();
      out.t_s.push_back(0.1 * k);
    }
  }
  return out;
}

inline std::vector<Recorded> people(int count, std::uint64_t seed) {
  std::vector<Recorded> all;
  for (int i = 1; i <= count; ++i) {
    all.push_back(person(seed * 1000 + static_cast<std::uint64_t>(i), fmt::format("person{}.csv", i)));
  }
  return all;
}

}  // namespace flexor::posture::test
