#include "host/identify/hold.hpp"

#include <algorithm>
#include <cmath>

#include "host/model/compensator.hpp"

namespace flexor::identify {
namespace {

using Compensator = model::Compensator<model::DoubleArithmetic>;

constexpr double kHold_s = 60;
constexpr double kAllOver = 20;  // time constants: what is left to go is 2e-9
constexpr double kSettle_s = 1;
constexpr double kHeld_deg = 2;     // a hold of the finger itself
constexpr std::size_t kHolds = 40;  // of each session

double drift_deg(Compensator compensator, const std::vector<double>& reading, double period_s,
                 double hold_s) {
  std::vector<double> settled(compensator.joints());
  double worst = 0;
  const auto settle = static_cast<int>(std::ceil(kSettle_s / period_s));
  const auto end = static_cast<int>(std::ceil(hold_s / period_s));
  for (int k = 0; k <= end; ++k) {
    const auto angles = compensator.step(reading);
    for (std::size_t j = 0; j < settled.size(); ++j) {
      if (k == settle) settled[j] = angles[j].angle_deg;
      if (k > settle) worst = std::max(worst, std::abs(angles[j].angle_deg - settled[j]));
    }
  }
  return worst;
}

// The model's readings, row by row.
std::vector<std::vector<double>> readings_of(const model::Model& model, const Session& session,
                                             const std::vector<std::string>& sensors) {
  std::vector<std::vector<double>> out(static_cast<std::size_t>(session.input.rows()));
  for (const model::Input& input : model.inputs) {
    const auto column = session.input.col(std::ranges::find(sensors, input.name) - sensors.begin());
    for (std::size_t k = 0; k < out.size(); ++k) out[k].push_back(column(static_cast<Eigen::Index>(k)));
  }
  return out;
}

}  // namespace

double slowest_s(const model::Model& model) {
  double out_s = 0;
  const auto look = [&](double rate_rad_s) { out_s = std::max(out_s, 1 / std::abs(rate_rad_s)); };
  for (const model::Block& block : model.blocks) {
    if (const auto* lag = std::get_if<model::Lag>(&block.kind)) look(lag->rate_rad_s);
    if (const auto* lti = std::get_if<model::Lti>(&block.kind)) std::ranges::for_each(lti->poles_rad_s, look);
    if (const auto* pair = std::get_if<model::PolePair>(&block.kind))
      look(pair->frequency_rad_s * pair->damping);
  }
  return out_s;
}

double hold_drift_deg(const model::Model& model, const std::vector<Session>& sessions,
                      const std::vector<std::string>& sensors) {
  double worst = 0;
  const double hold_s = std::min(kHold_s, kSettle_s + kAllOver * slowest_s(model));
  const Compensator fresh(model);
  for (const Session& session : sessions) {
    Compensator compensator = fresh;
    const std::vector<std::vector<double>> readings = readings_of(model, session, sensors);
    const std::size_t every = std::max<std::size_t>(1, readings.size() / kHolds);
    for (std::size_t k = 0; k < readings.size(); ++k) {
      (void)compensator.step(readings[k]);
      if (k % every == every / 2)
        worst = std::max(worst, drift_deg(compensator, readings[k], model.sample_period_s, hold_s));
    }
  }
  return worst;
}

std::vector<StillPart> holds_of(const Session& session, double period_s) {
  if (session.use.empty()) return {};
  return still_in({steadied({session.angle_deg.begin(), session.angle_deg.end()}, period_s)}, {kHeld_deg},
                  period_s, session.use);
}

double wander_deg(const model::Model& model, const std::vector<Session>& sessions,
                  const std::vector<std::string>& sensors) {
  double squares = 0;
  double samples = 0;
  for (const Session& session : sessions) {
    Compensator compensator(model);
    Eigen::ArrayXd angle(session.input.rows());
    for (Eigen::Index k = 0; const std::vector<double>& reading : readings_of(model, session, sensors))
      angle(k++) = compensator.step(reading).front().angle_deg;
    for (const StillPart& held : holds_of(session, model.sample_period_s)) {
      const Eigen::ArrayXd part = (angle - session.angle_deg.array()).segment(held.from, held.to - held.from);
      squares += (part - part.mean()).square().sum();
      samples += static_cast<double>(part.size());
    }
  }
  return samples > 0 ? std::sqrt(squares / samples) : 0;
}

}  // namespace flexor::identify
