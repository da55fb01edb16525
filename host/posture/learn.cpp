#include "host/posture/learn.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <random>
#include <set>

#include "host/io/io.hpp"
#include "host/posture/regression.hpp"
#include "host/recording/csv.hpp"

namespace flexor::posture {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kKnotStep_deg = 10;
constexpr double kLowestKnot_deg = -140;
constexpr int kKnots = 19;
constexpr double kMostAngle_deg = 360;

Hand rest_of(const Recorded& recorded) {
  Hand sum = Hand::Zero();
  double count = 0;
  double begin_s = recorded.t_s.front();
  for (std::size_t i = 0; i < recorded.t_s.size(); ++i) {
    if (i > 0 && recorded.t_s[i] < recorded.t_s[i - 1]) begin_s = recorded.t_s[i];
    if (recorded.t_s[i] - begin_s > kRest_s) continue;
    sum += recorded.hands_deg.row(static_cast<Index>(i)).transpose().array();
    ++count;
  }
  return sum / count;
}

Person person_of(const Recorded& recorded, std::uint64_t seed) {
  double total_s = 0;
  for (std::size_t i = 1; i < recorded.t_s.size(); ++i)
    total_s += step_s(recorded.t_s[i - 1], recorded.t_s[i]);
  if (total_s < 1)
    throw io::InputError(fmt::format("{}: less than a second of motion; record more", recorded.source));
  return {recorded.source, recorded.digest, static_cast<int>(recorded.t_s.size()), rest_of(recorded),
          make_codebook(recorded.hands_deg, total_s, kCells, seed)};
}

// The normal equations of a curve's values at the knots, well conditioned by the prior.
struct CurveFit {
  MatrixXd left = MatrixXd::Zero(kKnots, kKnots);
  VectorXd right = VectorXd::Zero(kKnots);
};

CurveFit equations_of(const Recorded& recorded, const Coupling& coupling) {
  CurveFit fit;
  const double share = 1 / static_cast<double>(recorded.hands_deg.rows());
  for (Index row = 0; row < recorded.hands_deg.rows(); ++row) {
    const double place = (recorded.hands_deg(row, coupling.follows) - kLowestKnot_deg) / kKnotStep_deg;
    const double within = std::clamp(place, 0.0, kKnots - 1.0);
    const Index i = std::min(static_cast<Index>(within), Index{kKnots - 2});
    const Eigen::Vector2d hat(1 - (within - static_cast<double>(i)), within - static_cast<double>(i));
    fit.left.block<2, 2>(i, i) += share * hat * hat.transpose();
    fit.right.segment<2>(i) += share * recorded.hands_deg(row, coupling.joint) * hat;
  }
  return fit;
}

CoupledCurve solve(const CurveFit& fit, const Coupling& coupling) {
  constexpr double kStraight = 1e-4;
  MatrixXd bend = MatrixXd::Zero(kKnots - 2, kKnots);
  for (Index i = 0; i + 2 < kKnots; ++i) bend.block<1, 3>(i, i) << 1, -2, 1;
  const VectorXd value = (fit.left + kStraight * bend.transpose() * bend).ldlt().solve(fit.right);
  CoupledCurve curve{coupling, {}, {value.begin(), value.end()}, 0};
  for (int i = 0; i < kKnots; ++i) curve.knot_deg.push_back(kLowestKnot_deg + i * kKnotStep_deg);
  return curve;
}

CoupledCurve coupled_curve(const std::vector<Recorded>& people, const Coupling& coupling) {
  std::vector<CurveFit> fits;
  CurveFit all;
  for (const Recorded& recorded : people) {
    fits.push_back(equations_of(recorded, coupling));
    all.left += fits.back().left;
    all.right += fits.back().right;
  }
  std::vector<Weighted> errors;
  for (std::size_t i = 0; i < people.size(); ++i) {
    const CurveFit others{all.left - fits[i].left, all.right - fits[i].right};
    const CoupledCurve curve = solve(others, coupling);
    const Hands& hands = people[i].hands_deg;
    const double share = 1 / static_cast<double>(hands.rows());
    for (Index row = 0; row < hands.rows(); ++row) {
      const double angle_deg = curve.at(hands(row, coupling.follows));
      errors.push_back({std::abs(hands(row, coupling.joint) - angle_deg), share});
    }
  }
  CoupledCurve curve = solve(all, coupling);
  curve.sd_deg = standard_error(std::move(errors));
  return curve;
}

// How far joints go in healthy adults, or infinite where there is no agreed figure. Active ranges of the American Academy
// of Orthopaedic Surgeons (1965), with 10 degrees for the spread between people.
Limits anatomical_limits() {
  constexpr double kSpread_deg = 10;
  constexpr double kNone_deg = std::numeric_limits<double>::infinity();
  Limits limits{Hand::Constant(kNone_deg), Hand::Constant(-kNone_deg)};
  const auto set = [&](std::string_view part, double flexion_deg, double extension_deg) {
    for (int j = 0; j < kJoints; ++j) {
      if (!joint_name(j).ends_with(part) || joint_name(j).starts_with("thumb")) continue;
      limits.low_deg[j] = -flexion_deg - kSpread_deg;
      limits.high_deg[j] = extension_deg + kSpread_deg;
    }
  };
  set("_mcp", 90, 45);
  set("_pip", 100, 0);
  set("_dip", 90, 0);
  return limits;
}

// The wider of what is known of hands and what these people did: gloves differ in what they call 0.
Limits limits_of(const std::vector<Recorded>& people) {
  constexpr double kMargin_deg = 10;
  Limits limits = anatomical_limits();
  for (const Recorded& recorded : people) {
    limits.low_deg =
        limits.low_deg.min(recorded.hands_deg.colwise().minCoeff().transpose().array() - kMargin_deg);
    limits.high_deg =
        limits.high_deg.max(recorded.hands_deg.colwise().maxCoeff().transpose().array() + kMargin_deg);
  }
  return limits;
}

void require_people(const std::vector<Recorded>& people) {
  if (people.size() < 3) {
    throw io::InputError(
        fmt::format("{} recording(s): what holds for others needs three people or more", people.size()));
  }
  std::set<std::string> digests;
  for (const Recorded& recorded : people) {
    if (digests.insert(recorded.digest).second) continue;
    throw io::InputError(fmt::format("{}: the same recording twice; give each person once", recorded.source));
  }
}

}  // namespace

Codebook make_codebook(const Hands& hands, double total_s, int cells, std::uint64_t seed) {
  constexpr int kRounds = 15;
  const auto rows = static_cast<double>(hands.rows());
  const double row_s = total_s / rows;
  std::mt19937_64 random(seed);
  Hands centres(cells, kJoints);
  for (Index c = 0; c < cells; ++c)
    centres.row(c) = hands.row(static_cast<Index>(rows * static_cast<double>(random() >> 11) * 0x1p-53));
  VectorXd seconds(cells);
  Hands sum(cells, kJoints);
  Hand within = Hand::Zero();
  for (int round = 0; round < kRounds; ++round) {
    seconds.setZero();
    sum.setZero();
    within.setZero();
    for (Index row = 0; row < hands.rows(); ++row) {
      Index cell = 0;
      (centres.rowwise() - hands.row(row)).rowwise().squaredNorm().minCoeff(&cell);
      seconds[cell] += row_s;
      sum.row(cell) += row_s * hands.row(row);
      within += row_s * (hands.row(row) - centres.row(cell)).transpose().array().square();
    }
    for (Index c = 0; c < cells; ++c) {
      if (seconds[c] > 0) centres.row(c) = sum.row(c) / seconds[c];
    }
  }
  std::vector<Index> used;
  for (Index c = 0; c < cells; ++c) {
    if (seconds[c] > 0) used.push_back(c);
  }
  return {centres(used, Eigen::all), seconds(used), within / (row_s * rows)};
}

Recorded read_recorded(const std::filesystem::path& file) {
  std::vector<std::string> columns;
  for (const std::string_view name : kJointNames) columns.push_back(fmt::format("{}_deg", name));
  recording::CsvReader reader(file, {columns, {}, recording::Holes::all});
  Recorded recorded{file.filename().string(), {}, {}, {}};
  std::vector<double> values;
  for (recording::Row row; reader.next(row);) {
    for (std::size_t j = 0; j < kJoints; ++j) {
      if (std::abs(row.value[j]) <= kMostAngle_deg) continue;
      throw io::InputError(fmt::format(
          "{}: row {}: column \"{}\": {} is no angle of a joint; take the row out", file.string(), row.line,
          columns[j], std::isnan(row.value[j]) ? "nothing" : fmt::format("{:g}", row.value[j])));
    }
    values.insert(values.end(), row.value.begin(), row.value.end());
    recorded.t_s.push_back(row.t_s);
  }
  if (recorded.t_s.empty()) throw io::InputError(fmt::format("{}: no row below the header", file.string()));
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, kJoints, Eigen::RowMajor>;
  recorded.hands_deg =
      Eigen::Map<const RowMajor>(values.data(), static_cast<Index>(recorded.t_s.size()), kJoints);
  recorded.digest = reader.digest();
  return recorded;
}

Posture learn(const std::vector<Recorded>& people, std::uint64_t seed,
              const std::function<void(const std::string&, std::size_t, std::size_t)>& progress) {
  require_people(people);
  Posture posture{FLEXOR_VERSION, seed, {}, {}, limits_of(people)};
  for (const Recorded& recorded : people) {
    progress("person", posture.people.size(), people.size());
    posture.people.push_back(person_of(recorded, seed));
  }
  for (const Coupling& coupling : kCouplings) posture.curves.push_back(coupled_curve(people, coupling));
  return posture;
}

}  // namespace flexor::posture
