#include "host/posture/regression.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace flexor::posture {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// -1 / (2 l^2).
double exponent(Index inputs) { return -2.5 / static_cast<double>(std::max(inputs, Index{1})); }

// Errors of a regression on one person that it has not seen, weighted by time.
struct LeftOut {
  Hand square_deg2 = Hand::Zero();
  Hand relative_deg2 = Hand::Zero();  // over the variance that it claims in units of s^2
  VectorXd target_deg2;
  VectorXd target_worst_deg;
};

double claimed(const Regression& regression, const VectorXd& x, const VectorXd& with_cells) {
  return regression.own(x, x) - with_cells.dot(VectorXd(regression.solve(with_cells))) + regression.instant();
}

LeftOut errors_on(const Person& person, const Regression& regression, const InputMatrix& inputs,
                  const InputMatrix& targets, bool with_variance) {
  LeftOut out;
  out.target_deg2 = VectorXd::Zero(targets.rows());
  out.target_worst_deg = VectorXd::Zero(targets.rows());
  const Hand offset = regression.offset_deg(person.rest_deg);
  for (Index c = 0; c < person.book.seconds.size(); ++c) {
    const VectorXd hand = person.book.centre_deg.row(c).transpose();
    const VectorXd x = regression.scaled(inputs * hand, offset);
    const VectorXd with_cells = regression.with_cells(x);
    const Hand error = regression.mean_deg(with_cells, offset) - hand.array();
    const double share = person.book.seconds[c] / person.seconds();
    const double variance = with_variance ? claimed(regression, x, with_cells) : 1;
    out.square_deg2 += share * error.square();
    out.relative_deg2 += share / variance * (error.square() + person.book.within_deg2);
    const VectorXd target = (targets * error.matrix()).cwiseAbs();
    out.target_deg2 += share * target.cwiseAbs2();
    out.target_worst_deg = out.target_worst_deg.cwiseMax(target);
  }
  return out;
}

People without(const People& people, std::size_t one) {
  People others = people;
  others.erase(others.begin() + static_cast<std::ptrdiff_t>(one));
  return others;
}

double left_out_rmse_deg(const People& people, const InputMatrix& inputs, const Shape& shape) {
  double sum = 0;
  for (std::size_t i = 0; i < people.size(); ++i) {
    const Regression regression(without(people, i), inputs, shape);
    sum +=
        errors_on(*people[i], regression, inputs, InputMatrix(0, kJoints), false).square_deg2.sqrt().mean();
  }
  return sum / static_cast<double>(people.size());
}

}  // namespace

Regression::Regression(const People& people, const InputMatrix& inputs, const Shape& shape)
    : inputs_(inputs), shape_(shape) {
  const auto count = static_cast<double>(people.size());
  mean_seconds_ = 0;
  for (const Person* person : people) {
    mean_rest_deg_ += person->rest_deg / count;
    mean_seconds_ += person->seconds() / count;
    for (Index c = 0; c < person->book.seconds.size(); ++c)
      who_.push_back(static_cast<int>(&person - people.data()));
  }
  instant_ = noise_of(mean_seconds_ * count / static_cast<double>(who_.size()));
  take_cells(people);
}

void Regression::take_cells(const People& people) {
  const auto cells = static_cast<Index>(who_.size());
  Hands hands(cells, kJoints);
  VectorXd share(cells);
  seconds_.resize(cells);
  Index row = 0;
  for (const Person* person : people) {
    const Index count = person->book.seconds.size();
    const Hand offset = offset_deg(person->rest_deg);
    hands.middleRows(row, count) = person->book.centre_deg.rowwise() - offset.matrix().transpose();
    seconds_.segment(row, count) = person->book.seconds;
    share.segment(row, count) = person->book.seconds / person->seconds() / static_cast<double>(people.size());
    row += count;
  }
  mean_deg_ = (share.transpose() * hands).transpose().array();
  x_ = hands * inputs_.transpose();
  input_mean_deg_ = (share.transpose() * x_).transpose();
  x_.rowwise() -= input_mean_deg_.transpose();
  input_sd_deg_ = (share.transpose() * x_.array().square().matrix()).transpose().array().sqrt().max(1.0);
  x_.array().rowwise() /= input_sd_deg_.transpose().array();
  hands.rowwise() -= mean_deg_.matrix().transpose();
  MatrixXd kernel(cells, cells);
  for (Index a = 0; a < cells; ++a) {
    const VectorXd x = x_.row(a).transpose();
    kernel.col(a) = with_cells(x);
    for (Index b = 0; b < cells; ++b) {
      if (who_[static_cast<std::size_t>(a)] == who_[static_cast<std::size_t>(b)]) {
        kernel(b, a) = own(x, x_.row(b).transpose());
      }
    }
    kernel(a, a) += noise_of(seconds_[a]);
  }
  cells_.compute(kernel);
  weight_ = cells_.solve(hands);
}

Hand Regression::offset_deg(const Hand& rest_deg) const {
  const Hand offset = shape_.share * (rest_deg - mean_rest_deg_);
  return offset.isNaN().select(Hand::Zero(), offset);
}

VectorXd Regression::scaled(const VectorXd& inputs_deg, const Hand& offset_deg) const {
  return (inputs_deg - inputs_ * offset_deg.matrix() - input_mean_deg_).cwiseQuotient(input_sd_deg_);
}

VectorXd Regression::with_cells(const VectorXd& x) const {
  const VectorXd square = (x_.rowwise() - x.transpose()).rowwise().squaredNorm();
  return x_ * x + (exponent(x.size()) * square).array().exp().matrix();
}

double Regression::own(const VectorXd& a, const VectorXd& b) const {
  return a.dot(b) + 1 + 2 * std::exp(exponent(a.size()) * (a - b).squaredNorm());
}

Hand Regression::mean_deg(const VectorXd& with_cells, const Hand& offset_deg) const {
  return (weight_.transpose() * with_cells).array() + mean_deg_ + offset_deg;
}

Calibrated calibrate(const People& people, const InputMatrix& inputs, const Shape& shape,
                     const InputMatrix& targets) {
  Calibrated out{Regression(people, inputs, shape), Hand::Zero(), VectorXd::Zero(targets.rows()),
                 VectorXd::Zero(targets.rows())};
  for (std::size_t i = 0; i < people.size(); ++i) {
    const Regression regression(without(people, i), inputs, shape);
    const LeftOut errors = errors_on(*people[i], regression, inputs, targets, true);
    const auto count = static_cast<double>(people.size());
    out.scale_deg2 += errors.relative_deg2 / count;
    out.target_error_deg2 += errors.target_deg2 / count;
    out.target_worst_deg = out.target_worst_deg.cwiseMax(errors.target_worst_deg);
    out.rmse_deg += errors.square_deg2.sqrt().mean() / count;
  }
  return out;
}

Shape choose_shape(const People& people, const InputMatrix& inputs, bool rested) {
  constexpr double kShare = 0.6;
  constexpr double kAsGood = 1.01;
  constexpr std::array<double, 5> kNoise = {0.001, 0.003, 0.01, 0.03, 0.1};
  const double share = rested ? kShare : 0;
  std::array<double, kNoise.size()> rmse_deg{};
  for (std::size_t i = 0; i < kNoise.size(); ++i)
    rmse_deg[i] = left_out_rmse_deg(people, inputs, {kNoise[i], share});
  const double bound_deg = kAsGood * *std::ranges::min_element(rmse_deg);
  const auto good = std::ranges::find_if(rmse_deg, [&](double rmse) { return rmse <= bound_deg; });
  return {kNoise[static_cast<std::size_t>(good - rmse_deg.begin())], share};
}

}  // namespace flexor::posture
