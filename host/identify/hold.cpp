#include "host/identify/hold.hpp"

#include <algorithm>
#include <cmath>

#include "host/model/compensator.hpp"

namespace flexor::identify {
namespace {

using Compensator = model::Compensator<model::DoubleArithmetic>;

constexpr double kHold_s = 60;
constexpr double kSettle_s = 1;
constexpr Eigen::Index kHolds = 40;  // of each session

double drift_deg(Compensator compensator, const std::vector<double>& reading, double period_s) {
  std::vector<double> settled(compensator.joints());
  double worst = 0;
  const auto settle = static_cast<int>(std::ceil(kSettle_s / period_s));
  const auto end = static_cast<int>(std::ceil(kHold_s / period_s));
  for (int k = 0; k <= end; ++k) {
    const auto angles = compensator.step(reading);
    for (std::size_t j = 0; j < settled.size(); ++j) {
      if (k == settle) settled[j] = angles[j].angle_deg;
      if (k > settle) worst = std::max(worst, std::abs(angles[j].angle_deg - settled[j]));
    }
  }
  return worst;
}

}  // namespace

double hold_drift_deg(const model::Model& model, const std::vector<Session>& sessions,
                      const std::vector<std::string>& sensors) {
  std::vector<Eigen::Index> column;
  for (const model::Input& input : model.inputs) {
    column.push_back(std::ranges::find(sensors, input.name) - sensors.begin());
  }
  double worst = 0;
  std::vector<double> reading(column.size());
  const Compensator fresh(model);
  for (const Session& session : sessions) {
    Compensator compensator = fresh;
    const Eigen::Index rows = session.input.rows();
    const Eigen::Index every = std::max<Eigen::Index>(1, rows / kHolds);
    for (Eigen::Index k = 0; k < rows; ++k) {
      for (std::size_t i = 0; i < column.size(); ++i) reading[i] = session.input(k, column[i]);
      (void)compensator.step(reading);
      if (k % every == every / 2)
        worst = std::max(worst, drift_deg(compensator, reading, model.sample_period_s));
    }
  }
  return worst;
}

}  // namespace flexor::identify
