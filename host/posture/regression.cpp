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
struct Errors {
  Hand square_deg2 = Hand::Zero();
  VectorXd target_deg2;
  VectorXd target_worst_deg;
};

Errors errors_on(const Person& person, const Regression& regression, const InputMatrix& inputs,
                 const InputMatrix& targets) {
  Errors out;
  out.target_deg2 = VectorXd::Zero(targets.rows());
  out.target_worst_deg = VectorXd::Zero(targets.rows());
  const Hand offset = regression.offset_deg(person.rest_deg);
  for (Index c = 0; c < person.book.seconds.size(); ++c) {
    const VectorXd hand = person.book.centre_deg.row(c).transpose();
    const VectorXd x = regression.scaled(inputs * hand, offset);
    const Hand error = regression.mean_deg(regression.with_cells(x), offset) - hand.array();
    const double share = person.book.seconds[c] / person.seconds();
    out.square_deg2 += share * error.square();
    const VectorXd target = (targets * error.matrix()).cwiseAbs();
    out.target_deg2 += share * target.cwiseAbs2();
    out.target_worst_deg = out.target_worst_deg.cwiseMax(target);
  }
  return out;
}

// Errors over the standard error that is claimed in units of s_j.
using Relatives = std::array<std::vector<Weighted>, kJoints>;

// Within a cell the hand is about its centre: three points have its variance.
void add_relatives(const Hand& error, const Hand& within_deg2, const Hand& claimed, double share,
                   Relatives& out) {
  const Hand spread = (1.5 * within_deg2).sqrt();
  for (int j = 0; j < kJoints; ++j) {
    for (const double side : {-1.0, 0.0, 1.0}) {
      out[static_cast<std::size_t>(j)].push_back(
          {std::abs(error[j] + side * spread[j]) / std::sqrt(claimed[j]), share / 3});
    }
  }
}

// Of whom the first `seen` cells are shown; how well the others are told counts.
void add_person(const Calibrated::LeftOut& left_out, const InputMatrix& inputs, Index seen, Relatives& out) {
  const auto& [person, others] = left_out;
  const Codebook& book = person->book;
  const Hand offset = others.offset_deg(person->rest_deg);
  std::vector<Hand> hands;
  for (Index c = 0; c < seen; ++c) hands.emplace_back(book.centre_deg.row(c).transpose());
  const Seen shown(others, inputs, offset, hands);
  const double unseen_s = book.seconds.tail(book.seconds.size() - seen).sum();
  for (Index c = seen; c < book.seconds.size(); ++c) {
    const VectorXd hand = book.centre_deg.row(c).transpose();
    const VectorXd x = others.scaled(inputs * hand, offset);
    const VectorXd with_cells = others.with_cells(x);
    const Hand error = shown.mean_deg(x, with_cells) - hand.array();
    const Seen::Variance claimed = shown.variance(x, with_cells);
    add_relatives(error, book.within_deg2,
                  shown.shown() * claimed.shown + (1 - shown.shown()) * claimed.hidden,
                  book.seconds[c] / unseen_s, out);
  }
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
    sum += errors_on(*people[i], regression, inputs, InputMatrix(0, kJoints)).square_deg2.sqrt().mean();
  }
  return sum / static_cast<double>(people.size());
}

}  // namespace

Regression::Regression(const People& people, const InputMatrix& inputs, const Shape& shape)
    : inputs_(inputs), shape_(shape) {
  const auto count = static_cast<double>(people.size());
  mean_seconds_ = 0;
  for (std::size_t i = 0; i < people.size(); ++i) {
    const Person& person = *people[i];
    mean_rest_deg_ += person.rest_deg / count;
    mean_seconds_ += person.seconds() / count;
    who_.insert(who_.end(), static_cast<std::size_t>(person.book.seconds.size()), static_cast<int>(i));
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
  const MatrixXd x_of =
      x_.transpose();  // a row of a matrix without columns, where nothing is sensed, is nowhere
  for (Index a = 0; a < cells; ++a) {
    const VectorXd x = x_of.col(a);
    kernel.col(a) = with_cells(x);
    for (Index b = 0; b < cells; ++b) {
      if (who_[static_cast<std::size_t>(a)] == who_[static_cast<std::size_t>(b)]) {
        kernel(b, a) = own(x, x_of.col(b));
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

Seen::Seen(const Regression& regression, const InputMatrix& inputs, const Hand& offset_deg,
           const std::vector<Hand>& hands)
    : regression_(&regression), offset_deg_(offset_deg) {
  std::vector<VectorXd> x;
  std::vector<Hand> error;
  Hand shown = Hand::Ones();
  for (const Hand& hand : hands) {
    const Hand missing = hand.isNaN().cast<double>();
    if ((inputs * missing.matrix()).any()) continue;
    const VectorXd readings = inputs * hand.isNaN().select(Hand::Zero(), hand).matrix();
    x.push_back(regression.scaled(readings, offset_deg));
    error.push_back(hand - regression.mean_deg(regression.with_cells(x.back()), offset_deg));
    shown *= 1 - missing;
  }
  const auto count = static_cast<Index>(x.size());
  x_.resize(count, inputs.rows());
  if (count == 0) return;
  shown_ = shown;
  MatrixXd with_cells(regression.with_cells(x[0]).size(), count);
  Hands errors(count, kJoints);
  for (Index i = 0; i < count; ++i) {
    x_.row(i) = x[static_cast<std::size_t>(i)].transpose();
    with_cells.col(i) = regression.with_cells(x[static_cast<std::size_t>(i)]);
    errors.row(i) = (shown_ > 0).select(error[static_cast<std::size_t>(i)], Hand::Zero()).transpose();
  }
  gain_ = regression.solve(with_cells);
  MatrixXd covariance = -with_cells.transpose() * gain_;
  for (Index i = 0; i < count; ++i) {
    for (Index j = 0; j < count; ++j) covariance(i, j) += regression.own(x_.row(i), x_.row(j));
    covariance(i, i) += regression.instant();
  }
  seen_.compute(covariance);
  weight_ = seen_.solve(errors);
}

VectorXd Seen::correlation(const VectorXd& x, const VectorXd& with_cells) const {
  VectorXd k = -gain_.transpose() * with_cells;
  for (Index i = 0; i < x_.rows(); ++i) k[i] += regression_->own(x, x_.row(i));
  return k;
}

Hand Seen::mean_deg(const VectorXd& x, const VectorXd& with_cells) const {
  const Hand mean = regression_->mean_deg(with_cells, offset_deg_);
  if (x_.rows() == 0) return mean;
  return mean + (weight_.transpose() * correlation(x, with_cells)).array();
}

Seen::Variance Seen::variance(const VectorXd& x, const VectorXd& with_cells) const {
  const Regression& r = *regression_;
  const double hidden = r.own(x, x) - with_cells.dot(VectorXd(r.solve(with_cells))) + r.instant();
  if (x_.rows() == 0) return {hidden, hidden};
  const VectorXd k = correlation(x, with_cells);
  return {std::max(hidden - k.dot(VectorXd(seen_.solve(k))), r.instant()), hidden};
}

Calibrated calibrate(const People& people, const InputMatrix& inputs, const Shape& shape,
                     const InputMatrix& targets) {
  Calibrated out{
      Regression(people, inputs, shape), {}, VectorXd::Zero(targets.rows()), VectorXd::Zero(targets.rows())};
  const auto count = static_cast<double>(people.size());
  for (std::size_t i = 0; i < people.size(); ++i) {
    out.left_out.push_back({people[i], Regression(without(people, i), inputs, shape)});
    const Errors errors = errors_on(*people[i], out.left_out.back().others, inputs, targets);
    out.target_error_deg2 += errors.target_deg2 / count;
    out.target_worst_deg = out.target_worst_deg.cwiseMax(errors.target_worst_deg);
    out.rmse_deg += errors.square_deg2.sqrt().mean() / count;
  }
  return out;
}

Hand scale_deg2(const Calibrated& calibrated, const InputMatrix& inputs, std::size_t seen) {
  Relatives relatives;
  for (const Calibrated::LeftOut& left_out : calibrated.left_out) {
    const Index half = left_out.person->book.seconds.size() / 2;
    add_person(left_out, inputs, std::min(static_cast<Index>(seen), half), relatives);
  }
  Hand scale;
  for (int j = 0; j < kJoints; ++j)
    scale[j] = standard_error(std::move(relatives[static_cast<std::size_t>(j)]));
  return scale.square();
}

Shape choose_shape(const People& people, const InputMatrix& inputs, bool rested) {
  constexpr double kShare = 0.6;
  constexpr std::array<double, 5> kNoise = {0.001, 0.003, 0.01, 0.03, 0.1};
  const double share = rested ? kShare : 0;
  std::array<double, kNoise.size()> rmse_deg{};
  for (std::size_t i = 0; i < kNoise.size(); ++i)
    rmse_deg[i] = left_out_rmse_deg(people, inputs, {kNoise[i], share});
  const auto least = std::ranges::min_element(rmse_deg) - rmse_deg.begin();
  return {kNoise[static_cast<std::size_t>(least)], share};
}

}  // namespace flexor::posture
