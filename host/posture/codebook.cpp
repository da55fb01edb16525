#include "host/posture/codebook.hpp"

#include <random>
#include <vector>

#include "host/io/io.hpp"

namespace flexor::posture {
namespace {

using Eigen::Index;

// Centres drawn in proportion to their time.
Hands first_centres(const Hands& hands, const Eigen::VectorXd& seconds, Index cells, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Hands centres(cells, kJoints);
  const double total = seconds.sum();
  for (Index c = 0; c < cells; ++c) {
    double left = total * static_cast<double>(random() >> 11) * 0x1p-53;
    Index row = 0;
    while (row + 1 < hands.rows() && left >= seconds[row]) left -= seconds[row++];
    centres.row(c) = hands.row(row);
  }
  return centres;
}

Index nearest(const Hands& centres, const Hands& hands, Index row) {
  Index best = 0;
  (centres.rowwise() - hands.row(row)).rowwise().squaredNorm().minCoeff(&best);
  return best;
}

}  // namespace

Codebook make_codebook(const Hands& hands, const Eigen::VectorXd& seconds, int cells, std::uint64_t seed) {
  if (hands.rows() == 0 || !(seconds.sum() > 0))
    throw io::InputError("a recording without a second of motion");
  constexpr int kRounds = 15;
  Hands centres = first_centres(hands, seconds, cells, seed);
  Eigen::VectorXd weight(cells);
  Hands sum(cells, kJoints);
  Hand within = Hand::Zero();
  for (int round = 0; round < kRounds; ++round) {
    weight.setZero();
    sum.setZero();
    within.setZero();
    for (Index row = 0; row < hands.rows(); ++row) {
      const Index cell = nearest(centres, hands, row);
      weight[cell] += seconds[row];
      sum.row(cell) += seconds[row] * hands.row(row);
      within += seconds[row] * (hands.row(row) - centres.row(cell)).transpose().array().square();
    }
    for (Index c = 0; c < cells; ++c) {
      if (weight[c] > 0) centres.row(c) = sum.row(c) / weight[c];
    }
  }
  std::vector<Index> used;
  for (Index c = 0; c < cells; ++c) {
    if (weight[c] > 0) used.push_back(c);
  }
  return {centres(used, Eigen::all), weight(used), within / seconds.sum()};
}

}  // namespace flexor::posture
