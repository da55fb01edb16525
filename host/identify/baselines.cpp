#include "host/identify/baselines.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "host/identify/fit.hpp"
#include "host/io/io.hpp"

namespace flexor::identify {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// One row for each sample of all pairs, states started anew with each.
struct Rows {
  VectorXd input;
  VectorXd angle;
  std::vector<Index> fitted;
  std::vector<Index> held_out;
  std::vector<Index> begin;
  double period_s = 0;

  explicit Rows(const std::vector<const recording::Aligned*>& pairs) : period_s(pairs.front()->period_s) {
    std::vector<double> u;
    std::vector<double> y;
    for (const recording::Aligned* a : pairs) {
      const auto at = std::ssize(u);
      begin.push_back(at);
      u.insert(u.end(), a->input.begin(), a->input.end());
      y.insert(y.end(), a->angle_deg.begin(), a->angle_deg.end());
      for (std::size_t k = 0; k < a->size(); ++k) {
        const auto row = at + static_cast<Index>(k);
        if (k >= a->holdout_begin) held_out.push_back(row);
        if (k < a->holdout_begin && !a->gap[k]) fitted.push_back(row);
      }
    }
    begin.push_back(std::ssize(u));
    input = Eigen::Map<const VectorXd>(u.data(), std::ssize(u));
    angle = Eigen::Map<const VectorXd>(y.data(), std::ssize(y));
  }

  VectorXd motion(double lag_s) const {
    const double keep = std::exp(-period_s / lag_s);
    VectorXd out(input.size());
    for (std::size_t p = 0; p + 1 < begin.size(); ++p) {
      double state = input(begin[p]);
      for (Index k = begin[p]; k < begin[p + 1]; ++k) {
        state = keep * state + (1 - keep) * input(k);
        out(k) = input(k) - state;
      }
    }
    return out;
  }
};

// Least squares, then limited to the angles that were seen.
struct Regression {
  VectorXd estimate;
  double squares = 0;
};

Regression regress(const Rows& rows, const MatrixXd& x) {
  const VectorXd y = rows.angle(rows.fitted);
  const VectorXd w = MatrixXd(x(rows.fitted, Eigen::all)).colPivHouseholderQr().solve(y);
  Regression out{(x * w).cwiseMax(y.minCoeff()).cwiseMin(y.maxCoeff()), 0};
  out.squares = (out.estimate(rows.fitted) - y).squaredNorm();
  return out;
}

std::vector<double> held_out(const Rows& rows, const VectorXd& estimate) {
  const VectorXd part = estimate(rows.held_out);
  return {part.begin(), part.end()};
}

Baseline line(const Rows& rows) {
  MatrixXd x(rows.input.size(), 2);
  x << VectorXd::Ones(rows.input.size()), rows.input;
  return {"line", held_out(rows, regress(rows, x).estimate), ""};
}

Baseline line_lead(const Rows& rows) {
  Regression best{{}, std::numeric_limits<double>::infinity()};
  for (const double lag_s : {0.05, 0.1, 0.2, 0.4, 0.8}) {
    MatrixXd x(rows.input.size(), 3);
    x << VectorXd::Ones(rows.input.size()), rows.input, rows.motion(lag_s);
    Regression next = regress(rows, x);
    if (next.squares < best.squares) best = std::move(next);
  }
  return {"line_lead", held_out(rows, best.estimate), ""};
}

Baseline published_form(const Rows& rows) {
  Data data;
  data.channel = "published form";
  data.period_s = rows.period_s;
  data.input = rows.input;
  data.angle_deg = rows.angle;
  data.use.resize(static_cast<std::size_t>(rows.input.size()), 0);
  for (const Index k : rows.fitted) data.use[static_cast<std::size_t>(k)] = 1;
  try {
    return {"published_form", held_out(rows, fit(make_dead_zone_structure(1), data).predicted_deg), ""};
  } catch (const io::JobError& error) {
    return {"published_form", {}, error.what()};
  }
}

}  // namespace

std::vector<Baseline> baselines(const std::vector<const recording::Aligned*>& pairs) {
  const Rows rows(pairs);
  return {line(rows), line_lead(rows), published_form(rows)};
}

}  // namespace flexor::identify
