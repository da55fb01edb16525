// People whose hands are known: fingers bend by five numbers, each person differs by an offset and a gain of every
// joint, DIP follows PIP, and every angle has noise of one degree.
#pragma once

#include <fmt/format.h>

#include <random>
#include <string>
#include <vector>

#include "host/posture/posture.hpp"

namespace flexor::posture::test {

struct Recorded {
  Hands hands_deg;
  std::vector<double> t_s;
};

inline constexpr std::array<Coupling, 4> kCouplings = {{{6, 5}, {10, 9}, {14, 13}, {18, 17}}};

inline double coupled_deg(double pip_deg) { return pip_deg * pip_deg / -150; }

constexpr int kRows = 30;  // of a trial
constexpr int kRestRows = 5;

// Trials of three seconds at 10 Hz: half a second at rest, then a held posture.
inline Recorded person(std::uint64_t seed, int trials = 30) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> bend(0, 1);
  const auto finger_of = [](int joint) { return std::min(joint / 4, 4); };
  Hand offset = Hand::NullaryExpr([&] { return 6 * normal(random); });
  Hand gain = Hand::NullaryExpr([&] { return 1 + 0.1 * normal(random); });
  Recorded out{Hands(trials * kRows, kJoints), {}};
  for (int trial = 0; trial < trials; ++trial) {
    const double common = bend(random);
    std::array<double, 5> fingers{};
    for (double& f : fingers) f = 0.6 * common + 0.4 * bend(random);
    const double split = 0.2 * normal(random);  // of a bend between MCP and PIP: what a sensor cannot measure
    for (int k = 0; k < kRows; ++k) {
      const double share = k < kRestRows ? 0 : 1;
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

// What is to be learnt of such a person, without a search for typical hands: every eleventh hand is one.
inline Person typical(const Recorded& r) {
  constexpr Eigen::Index kStep = 11;
  const Eigen::Index cells = r.hands_deg.rows() / kStep;
  Person out{"x.csv", "x", static_cast<int>(r.hands_deg.rows()), Hand::Zero(), {}};
  out.book = {r.hands_deg(Eigen::seqN(0, cells, kStep), Eigen::all),
              Eigen::VectorXd::Constant(cells, 0.1 * kStep), Hand::Ones()};
  for (Eigen::Index row = 0; row < r.hands_deg.rows(); ++row) {
    if (row % kRows < kRestRows)
      out.rest_deg += r.hands_deg.row(row).transpose().array() * kRows / kRestRows / r.hands_deg.rows();
  }
  return out;
}

// A document of so many people.
inline Posture posture(int count, std::uint64_t seed) {
  Posture out{"x", 1, {}, {}, {Hand::Constant(360), Hand::Constant(-360)}};
  for (const int finger : {4, 8, 12, 16}) {  // as far as healthy fingers go, and 10 degrees
    out.limits.low_deg.segment<3>(finger) << -100, -110, -100;
    out.limits.high_deg.segment<3>(finger) << 55, 10, 10;
  }
  for (int i = 1; i <= count; ++i) {
    const Recorded r = person(seed * 1000 + static_cast<std::uint64_t>(i));
    out.people.push_back(typical(r));
    out.limits.low_deg = out.limits.low_deg.min(r.hands_deg.colwise().minCoeff().transpose().array() - 10);
    out.limits.high_deg = out.limits.high_deg.max(r.hands_deg.colwise().maxCoeff().transpose().array() + 10);
  }
  for (const Coupling& coupling : kCouplings) {
    CoupledCurve curve{coupling, {}, {}, 1.2};
    for (double pip_deg = -140; pip_deg <= 40; pip_deg += 10) {
      curve.knot_deg.push_back(pip_deg);
      curve.value_deg.push_back(coupled_deg(pip_deg));
    }
    out.curves.push_back(curve);
  }
  return out;
}

// The table of its first rows; `has_hole`: index_mcp is missing in the 41st.
inline std::string table_of(const Recorded& r, Eigen::Index rows, bool has_hole = false) {
  std::string text = "t_s";
  for (const auto name : kJointNames) text += fmt::format(",{}_deg", name);
  text += "\n";
  for (Eigen::Index row = 0; row < rows; ++row) {
    text += fmt::format("{:.1f}", r.t_s[static_cast<std::size_t>(row)]);
    for (int j = 0; j < kJoints; ++j)
      text += has_hole && row == 40 && j == 4 ? "," : fmt::format(",{:.2f}", r.hands_deg(row, j));
    text += "\n";
  }
  return text;
}

}  // namespace flexor::posture::test
