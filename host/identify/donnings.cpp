#include "host/identify/donnings.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

#include "host/model/compensator.hpp"

namespace flexor::identify {
namespace {

struct OffsetAndGain {
  double offset_deg;
  double gain;
};

// Of the samples whose estimate is within the limits; none where the finger hardly moved.
std::optional<OffsetAndGain> against(const Session& session,
                                     model::Compensator<model::DoubleArithmetic> compensator,
                                     const model::Saturation& limits) {
  const double middle = (limits.lower_deg + limits.upper_deg) / 2;
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  std::vector<double> reading(static_cast<std::size_t>(session.input.cols()));
  for (Eigen::Index k = 0; k < session.angle_deg.size(); ++k) {
    for (std::size_t s = 0; s < reading.size(); ++s)
      reading[s] = session.input(k, static_cast<Eigen::Index>(s));
    const double angle = compensator.step(reading).front().angle_deg;
    if (!session.use[static_cast<std::size_t>(k)] || angle <= limits.lower_deg || angle >= limits.upper_deg)
      continue;
    const Eigen::Vector2d row(1, angle - middle);
    squares += row * row.transpose();
    right += row * (session.angle_deg(k) - middle);
  }
  const double spread = squares(0, 0) > 0 ? squares.determinant() / (squares(0, 0) * squares(0, 0)) : 0;
  if (!(spread > 1)) return std::nullopt;
  const Eigen::Vector2d out = squares.ldlt().solve(right);
  return OffsetAndGain{out(0), out(1)};
}

}  // namespace

std::optional<Donnings> donnings_of(const std::vector<Session>& sessions, const model::Model& model) {
  const model::Saturation& limits = std::get<model::Saturation>(model.blocks.back().kind);
  const model::Compensator<model::DoubleArithmetic> fresh(model);
  std::vector<OffsetAndGain> all;
  for (const Session& session : sessions) {
    if (const auto one = against(session, fresh, limits)) all.push_back(*one);
  }
  if (all.size() < 2) return std::nullopt;
  const auto deviation = [&](double OffsetAndGain::*which) {
    double mean = 0;
    for (const OffsetAndGain& one : all) mean += one.*which / static_cast<double>(all.size());
    double sum = 0;
    for (const OffsetAndGain& one : all) sum += (one.*which - mean) * (one.*which - mean);
    return std::sqrt(sum / static_cast<double>(all.size() - 1));
  };
  return Donnings{static_cast<int>(all.size()), deviation(&OffsetAndGain::offset_deg),
                  deviation(&OffsetAndGain::gain)};
}

}  // namespace flexor::identify
