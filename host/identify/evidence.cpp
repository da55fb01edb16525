#include "host/identify/evidence.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "host/model/compensator.hpp"

namespace flexor::identify {
namespace {

// Standard deviations of where a pose lies, of the way from the open hand to the fist.
constexpr double kOpenBent = 0.06;
constexpr double kOpenBeyond = 0.02;
constexpr double kFistShort = 0.3;
constexpr double kFistBeyond = 0.02;

constexpr double kTurnSd = 0.04;        // of one turn's reading, in spans, before any was seen
constexpr double kEndSd = 0.01;         // of a quantile there
constexpr double kDiffers = 0.5;        // of what the span differs by: where the middle may lie
constexpr double kDiffersAtFist = 0.3;  // the same where the open hand repeats
constexpr double kDiffersWhole = 0.4;   // of either, where every way goes from end to end
constexpr double kSameEnd = 0.15;       // of the stretch's reach: turns that are nearer are at one end
constexpr double kRepeats = 0.015;      // of the span: what its readings scatter by then
constexpr double kSameMotion = 0.6;     // of the variance of where a motion lies: all fingers together

constexpr double kLeastModelError_deg = 2;
constexpr double kUnknownError_deg = 5;  // of a model that does not say
constexpr double kMarks_deg = 3;
constexpr double kNews_s = 1;
constexpr double kHuber = 2;  // standard deviations
constexpr double kStep = 1e-3;
constexpr double kMoves_deg = 10;

double made_of(const Line& line, const model::Spread& made, double reading) {
  return made.middle() + std::exp(line.log_gain) * (reading - made.middle()) + line.shift * made.span();
}

// Shift and logarithm of the gain, of what `reading` is taken for; in spans.
Eigen::RowVector2d derivative(const Line& line, const model::Spread& made, double reading) {
  return {1, std::exp(line.log_gain) * (reading - made.middle()) / made.span()};
}

struct Place {
  double at;
  double slope;
};

// Of an unknown of unit variance: straight lines of either slope far from 0, smooth between them.
Place sided(double x, double below, double above) {
  const double root = std::hypot(x, 1.0);
  return {(above + below) / 2 * x + (above - below) / 2 * (root - 1),
          (above + below) / 2 + (above - below) / 2 * x / root};
}

// Of the mean of turns, in spans: what they scatter by, with kTurnSd for one more turn.
double turn_variance(const std::vector<double>& turns, double span) {
  const double n = std::max(1.0, static_cast<double>(turns.size()));
  return add_squares(kTurnSd * kTurnSd, turns, span * span) / n / n;
}

// From 0 to 1: how surely the open end is where the hand is straight. Straight fingers can go no farther, a fist is as
// tight as the wearer likes: where the open end comes back to one reading, what differs in reach differs at the fist.
double open_repeats(const Stretch& s) {
  if (s.bends == 0) return 0;
  const std::vector<double>& ends = s.bends > 0 ? s.window.turns.low_ends : s.window.turns.high_ends;
  const auto n = static_cast<double>(ends.size());
  if (n < 2) return 0;
  const double variance = add_squares(0, ends, n - 1);
  return 1 / (1 + variance / std::pow(kRepeats * s.made.span(), 2));
}

// Each end twice or more, and no turn between: where a hand does nothing but open and close, its ends are the finger's.
bool from_end_to_end(const Turns& turns) {
  if (turns.low_ends.size() < 2 || turns.high_ends.size() < 2) return false;
  const auto [lowest, highest_low] = std::ranges::minmax(turns.low_ends);
  const auto [lowest_high, highest] = std::ranges::minmax(turns.high_ends);
  const double same = kSameEnd * (highest - lowest);
  return highest_low - lowest < same && highest - lowest_high < same;
}

Eigen::MatrixXd covariance_of(const Stretch& s) {
  const auto n = static_cast<Eigen::Index>(s.made.reading.size());
  const double span = s.made.span();
  Eigen::VectorXd place(n);  // about the middle, in spans
  for (Eigen::Index i = 0; i < n; ++i)
    place(i) = (s.made.reading[static_cast<std::size_t>(i)] - s.made.middle()) / span;
  const Eigen::VectorXd low = 0.5 - place.array();
  const Eigen::VectorXd high = 0.5 + place.array();
  const double differs = std::log(s.window.span() / span);
  const double lacking = std::max(0.0, 1 - s.window.span() / span - s.prior.log_gain_sd);
  const double repeats = open_repeats(s);
  const double whole = from_end_to_end(s.window.turns) ? kDiffersWhole : 1;
  const double differs_sd = std::abs(differs) * whole * (kDiffers + repeats * (kDiffersAtFist - kDiffers));
  const double common = (1 - kSameMotion) * s.prior.motion_sd * s.prior.motion_sd + differs_sd * differs_sd;
  const double reach = s.prior.reach_sd * s.prior.reach_sd + lacking * lacking;
  const Eigen::VectorXd from_stay = place.array() + s.bends * 0.5 * repeats;
  Eigen::MatrixXd out = Eigen::MatrixXd::Constant(n, n, common) + reach * from_stay * from_stay.transpose();
  out += turn_variance(s.window.turns.low, span) * low * low.transpose();
  out += turn_variance(s.window.turns.high, span) * high * high.transpose();
  out.diagonal().array() += kEndSd * kEndSd;
  out.diagonal().segment(1, n - 2).array() += s.prior.density_sd * s.prior.density_sd;
  return out;
}

double error_of(const model::Joint& joint) {
  if (!joint.accuracy) return kUnknownError_deg;
  double square = 0;
  for (const double e : joint.accuracy->standard_error_deg)
    square += e * e / static_cast<double>(joint.accuracy->standard_error_deg.size());
  return std::max(kLeastModelError_deg, std::sqrt(square));
}

// Angles of the seen joints, each over the grid.
std::vector<std::vector<double>> angles_by(const std::vector<Line>& lines, const model::Model& model,
                                           const Seen& seen) {
  std::vector<model::Correction> correction;
  for (std::size_t i = 0; i < lines.size(); ++i)
    correction.push_back(correction_of(lines[i], *model.inputs[i].readings));
  model::Compensator<model::DoubleArithmetic> compensator(model);
  std::vector<std::vector<double>> out(seen.joints.size());
  std::vector<double> row(lines.size());
  for (std::size_t k = 0; k < seen.reading.front().size(); ++k) {
    for (std::size_t i = 0; i < row.size(); ++i) row[i] = correction[i](seen.reading[i][k]);
    const auto samples = compensator.step(row);
    for (std::size_t s = 0; s < out.size(); ++s) out[s].push_back(samples[seen.joints[s].joint].angle_deg);
  }
  return out;
}

// That count, of a part.
struct SeenSample {
  std::size_t joint;  // of those seen
  std::size_t at;
  double angle_deg;
};

std::vector<SeenSample> samples_of(const Seen& seen, double begin, double end) {
  std::vector<SeenSample> out;
  for (std::size_t s = 0; s < seen.joints.size(); ++s) {
    const Seen::Angles& one = seen.joints[s];
    const auto n = static_cast<double>(one.use.size());
    for (auto k = static_cast<std::size_t>(begin * n); k < static_cast<std::size_t>(end * n); ++k) {
      if (one.use[k]) out.push_back({s, k, one.angle_deg[k]});
    }
  }
  return out;
}

Rows camera_rows(const model::Model& model, const Seen& seen, const std::vector<SeenSample>& samples,
                 const std::vector<Line>& lines, const Eigen::VectorXd& own) {
  const auto now = angles_by(lines, model, seen);
  std::vector<std::vector<std::vector<double>>> moved;  // of each unknown of the sensors
  for (std::size_t i = 0; i < lines.size(); ++i) {
    for (double Line::*which : {&Line::shift, &Line::log_gain}) {
      std::vector<Line> there = lines;
      there[i].*which += kStep;
      moved.push_back(angles_by(there, model, seen));
    }
  }
  const double repeats = std::sqrt(std::max(1.0, kNews_s / model.sample_period_s));
  Rows out{Eigen::MatrixXd::Zero(std::ssize(samples), std::ssize(moved) + own.size()),
           Eigen::VectorXd(std::ssize(samples))};
  for (Eigen::Index r = 0; r < out.error.size(); ++r) {
    const auto& [s, k, angle_deg] = samples[static_cast<std::size_t>(r)];
    const double error_deg = error_of(model.joints[seen.joints[s].joint]);
    const auto mark = static_cast<Eigen::Index>(s);
    const double e = (angle_deg - now[s][k] - kMarks_deg * own(mark)) / error_deg;
    const double weight = std::pow(1 + e * e / (kHuber * kHuber), -0.25) / repeats;
    for (std::size_t c = 0; c < moved.size(); ++c)
      out.jacobian(r, static_cast<Eigen::Index>(c)) =
          weight * (moved[c][s][k] - now[s][k]) / (kStep * error_deg);
    out.jacobian(r, std::ssize(moved) + mark) = weight * kMarks_deg / error_deg;
    out.error(r) = weight * e;
  }
  return out;
}

}  // namespace

Evidence sightings(std::vector<Sighting> all, const model::Model& model) {
  return {2, [all = std::move(all), &model](const std::vector<Line>& lines, const Eigen::VectorXd& own) {
            const Eigen::Index sensors = column(lines.size());
            Rows out{Eigen::MatrixXd::Zero(std::ssize(all), sensors + 2), Eigen::VectorXd(std::ssize(all))};
            const Place open = sided(own(0), kOpenBeyond, kOpenBent);
            const Place fist = sided(own(1), kFistShort, kFistBeyond);
            for (Eigen::Index i = 0; i < out.error.size(); ++i) {
              const Sighting& s = all[static_cast<std::size_t>(i)];
              const model::Spread& made = *model.inputs[s.sensor].readings;
              const Line& line = lines[s.sensor];
              const Place& place = s.fist ? fist : open;
              const double off = (s.made - made_of(line, made, s.reading)) / made.span();
              out.error(i) = (off + s.pose * place.at) / s.error;
              out.jacobian.block<1, 2>(i, column(s.sensor)) = derivative(line, made, s.reading) / s.error;
              out.jacobian(i, sensors + (s.fist ? 1 : 0)) = -s.pose * place.slope / s.error;
            }
            return out;
          }};
}

Evidence quantiles(std::vector<Stretch> stretches) {
  std::vector<Eigen::MatrixXd> whitening;  // lower triangles of the covariances' Cholesky factors
  for (const Stretch& one : stretches) whitening.emplace_back(covariance_of(one).llt().matrixL());
  return {1, [stretches = std::move(stretches), whitening = std::move(whitening)](
                 const std::vector<Line>& lines, const Eigen::VectorXd& own) {
            Eigen::Index rows = 0;
            for (const Stretch& one : stretches) rows += std::ssize(one.made.reading);
            Rows out{Eigen::MatrixXd::Zero(rows, column(lines.size()) + 1), Eigen::VectorXd(rows)};
            Eigen::Index row = 0;
            for (std::size_t k = 0; k < stretches.size(); ++k) {
              const Stretch& one = stretches[k];
              const Line& line = lines[one.sensor];
              const auto n = std::ssize(one.made.reading);
              auto error = out.error.segment(row, n);
              auto jacobian = out.jacobian.middleRows(row, n);
              const double motion = one.prior.motion_sd * std::sqrt(kSameMotion);
              for (Eigen::Index i = 0; i < n; ++i) {
                const double reading = one.window.reading[static_cast<std::size_t>(i)];
                const double made = one.made.reading[static_cast<std::size_t>(i)];
                error(i) = (made - made_of(line, one.made, reading)) / one.made.span() - motion * own(0);
                jacobian.block<1, 2>(i, column(one.sensor)) = derivative(line, one.made, reading);
              }
              jacobian.rightCols(1).setConstant(motion);
              const auto lower = whitening[k].triangularView<Eigen::Lower>();
              lower.solveInPlace(error);
              lower.solveInPlace(jacobian);
              row += n;
            }
            return out;
          }};
}

Evidence camera(const model::Model& model, const Seen& seen, double begin, double end) {
  return {std::ssize(seen.joints), [&model, &seen, samples = samples_of(seen, begin, end)](
                                       const std::vector<Line>& lines, const Eigen::VectorXd& own) {
            return camera_rows(model, seen, samples, lines, own);
          }};
}

double mean_square_deg2(const model::Model& model, const Seen& seen, double begin, double end,
                        const std::vector<Line>& lines) {
  const auto now = angles_by(lines, model, seen);
  const std::vector<SeenSample> samples = samples_of(seen, begin, end);
  double sum = 0;
  for (const auto& [s, k, angle_deg] : samples) sum += (angle_deg - now[s][k]) * (angle_deg - now[s][k]);
  return samples.empty() ? 0 : sum / static_cast<double>(samples.size());
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

}  // namespace flexor::identify
