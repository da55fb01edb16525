#include "host/posture/learn.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <set>

#include "host/io/io.hpp"
#include "host/posture/standard_error.hpp"
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

// Every row counts the same, as in a root mean square error over the rows.
VectorXd seconds_of(const Recorded& recorded) {
  double total_s = 0;
  for (std::size_t i = 1; i < recorded.t_s.size(); ++i)
    total_s += step_s(recorded.t_s[i - 1], recorded.t_s[i]);
  return VectorXd::Constant(recorded.hands_deg.rows(), total_s / static_cast<double>(recorded.t_s.size()));
}

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
  const VectorXd seconds = seconds_of(recorded);
  if (seconds.sum() < 1) {
    throw io::InputError(fmt::format("{}: less than a second of motion; record more", recorded.source));
  }
  return {recorded.source, recorded.digest, static_cast<int>(recorded.t_s.size()), rest_of(recorded),
          make_codebook(recorded.hands_deg, seconds, kCells, seed)};
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

// Sizes of the errors on a person, in no order.
std::vector<double> errors_on(const CoupledCurve& curve, const Recorded& recorded) {
  std::vector<double> out;
  for (Index row = 0; row < recorded.hands_deg.rows(); ++row) {
    out.push_back(std::abs(recorded.hands_deg(row, curve.coupling.joint) -
                           curve.at(recorded.hands_deg(row, curve.coupling.follows))));
  }
  return out;
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
    const auto share = 1 / static_cast<double>(people[i].hands_deg.rows());
    for (const double size : errors_on(solve(others, coupling), people[i])) errors.push_back({size, share});
  }
  CoupledCurve curve = solve(all, coupling);
  curve.sd_deg = standard_error(std::move(errors));
  return curve;
}

// The wider of what is known of hands and what these people did: gloves differ in what they call 0.
Limits limits_of(const std::vector<Recorded>& people) {
  constexpr double kMargin_deg = 10;
  Limits limits = anatomical_limits();
  for (const Recorded& recorded : people) {
    const Hand low = recorded.hands_deg.colwise().minCoeff().transpose().array() - kMargin_deg;
    const Hand high = recorded.hands_deg.colwise().maxCoeff().transpose().array() + kMargin_deg;
    limits.low_deg = limits.low_deg.min(low);
    limits.high_deg = limits.high_deg.max(high);
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

Recorded read_recorded(const std::filesystem::path& file) {
  std::vector<std::string> columns;
  for (const std::string_view name : kJointNames) columns.push_back(fmt::format("{}_deg", name));
  recording::CsvReader reader(file, {columns, {}, true});
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
