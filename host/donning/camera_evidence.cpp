#include "host/donning/camera_evidence.hpp"

#include <algorithm>
#include <cmath>

#include "host/model/compensator.hpp"

namespace flexor::donning {
namespace {

constexpr double kLeastError_deg = 2;
constexpr double kUnknownError_deg = 5;  // of a model that does not say
constexpr double kMarks_deg = 3;
constexpr double kNews_s = 1;
constexpr double kHuber = 2;  // standard deviations
constexpr double kStep = 1e-3;
constexpr double kMoves_deg = 10;

double error_of(const model::Joint& joint) {
  if (!joint.accuracy) return kUnknownError_deg;
  double square = 0;
  for (const double e : joint.accuracy->standard_error_deg)
    square += e * e / static_cast<double>(joint.accuracy->standard_error_deg.size());
  return std::max(kLeastError_deg, std::sqrt(square));
}

}  // namespace

CameraEvidence::CameraEvidence(const model::Model& model, const Seen& seen, std::vector<model::Spread> made,
                               double begin, double end)
    : model_(model), seen_(seen), made_(std::move(made)), begin_(begin), end_(end) {
  for (const auto& one : seen.joints) error_deg_.push_back(error_of(model.joints[one.joint]));
}

std::vector<std::vector<double>> CameraEvidence::angles(const std::vector<Line>& lines) const {
  std::vector<model::Correction> correction;
  for (std::size_t i = 0; i < lines.size(); ++i) correction.push_back(correction_of(lines[i], made_[i]));
  model::Compensator<model::DoubleArithmetic> compensator(model_);
  std::vector<std::vector<double>> out(seen_.joints.size());
  std::vector<double> row(lines.size());
  for (std::size_t k = 0; k < seen_.reading.front().size(); ++k) {
    for (std::size_t i = 0; i < row.size(); ++i) row[i] = correction[i](seen_.reading[i][k]);
    const auto samples = compensator.step(row);
    for (std::size_t s = 0; s < out.size(); ++s) out[s].push_back(samples[seen_.joints[s].joint].angle_deg);
  }
  return out;
}

Rows CameraEvidence::rows(const std::vector<Line>& lines, const Eigen::VectorXd& own) const {
  const auto now = angles(lines);
  std::vector<std::vector<std::vector<double>>> moved;  // of each unknown of the sensors
  for (std::size_t i = 0; i < lines.size(); ++i) {
    for (double Line::*which : {&Line::shift, &Line::log_gain}) {
      std::vector<Line> there = lines;
      there[i].*which += kStep;
      moved.push_back(angles(there));
    }
  }
  std::vector<double> error;
  std::vector<Eigen::RowVectorXd> jacobian;
  const double repeats = std::sqrt(std::max(1.0, kNews_s / model_.sample_period_s));
  const auto sensors = std::ssize(moved);
  for (std::size_t s = 0; s < now.size(); ++s) {
    const auto& seen = seen_.joints[s];
    const auto n = static_cast<double>(seen.use.size());
    for (auto k = static_cast<std::size_t>(begin_ * n); k < static_cast<std::size_t>(end_ * n); ++k) {
      if (!seen.use[k]) continue;
      const auto mark = static_cast<Eigen::Index>(s);
      const double e = (seen.angle_deg[k] - now[s][k] - kMarks_deg * own(mark)) / error_deg_[s];
      const double weight = std::pow(1 + e * e / (kHuber * kHuber), -0.25) / repeats;
      Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(sensors + own.size());
      for (std::ptrdiff_t c = 0; c < sensors; ++c)
        row(c) = weight * (moved[static_cast<std::size_t>(c)][s][k] - now[s][k]) / (kStep * error_deg_[s]);
      row(sensors + mark) = weight * kMarks_deg / error_deg_[s];
      error.push_back(weight * e);
      jacobian.push_back(std::move(row));
    }
  }
  Rows out{Eigen::MatrixXd(std::ssize(error), sensors + own.size()),
           Eigen::Map<Eigen::VectorXd>(error.data(), std::ssize(error))};
  for (std::size_t r = 0; r < jacobian.size(); ++r)
    out.jacobian.row(static_cast<Eigen::Index>(r)) = jacobian[r];
  return out;
}

double CameraEvidence::mean_square_deg2(const std::vector<Line>& lines) const {
  const auto now = angles(lines);
  double sum = 0;
  double count = 0;
  for (std::size_t s = 0; s < now.size(); ++s) {
    const auto& seen = seen_.joints[s];
    const auto n = static_cast<double>(seen.use.size());
    for (auto k = static_cast<std::size_t>(begin_ * n); k < static_cast<std::size_t>(end_ * n); ++k) {
      if (!seen.use[k]) continue;
      const double e = seen.angle_deg[k] - now[s][k];
      sum += e * e;
      ++count;
    }
  }
  return count > 0 ? sum / count : 0;
}

std::vector<std::size_t> told_by_camera(const model::Model& model, const Seen& seen) {
  const model::Graph graph(model);
  std::vector<std::size_t> out;
  for (const auto& one : seen.joints) {
    double low = 1e9;
    double high = -1e9;
    for (std::size_t k = 0; k < one.use.size(); ++k) {
      if (!one.use[k]) continue;
      low = std::min(low, one.angle_deg[k]);
      high = std::max(high, one.angle_deg[k]);
    }
    if (high - low < kMoves_deg) continue;
    for (const std::size_t sensor : graph.inputs[graph.joint[one.joint]]) {
      if (std::ranges::find(out, sensor) == out.end()) out.push_back(sensor);
    }
  }
  return out;
}

}  // namespace flexor::donning
