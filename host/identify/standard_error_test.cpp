// The curves' standard errors on real recordings beside those of a block bootstrap, which leans on other assumptions:
// blocks of 20 s of the fitted part drawn with replacement, the same structure fitted to each draw with knots and priors of
// its own. They are small where those choices spread.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <random>

#include "host/identify/hand.hpp"
#include "host/identify/structure_text.hpp"

namespace flexor::identify {
namespace {
namespace fs = std::filesystem;

constexpr double kSample_s = 0.05;
constexpr double kBlock_s = 20;
constexpr double kJoin_s = 1;  // at the start of each block, where plays and lags remember another one
constexpr int kDraws = 60;

Session fitted_part(const JointSamples& samples) {
  Session out;
  const auto n = static_cast<Eigen::Index>(samples.holdout_begin);
  out.input = Eigen::Map<const Eigen::VectorXd>(samples.reading.front().data(), n);
  out.angle_deg = Eigen::Map<const Eigen::VectorXd>(samples.measured_deg.data(), n);
  for (Eigen::Index k = 0; k < n; ++k) out.use.push_back(samples.gap[static_cast<std::size_t>(k)] == 0);
  return out;
}

Session drawn(const Session& from, std::mt19937& random) {
  const auto block = static_cast<Eigen::Index>(kBlock_s / kSample_s);
  const Eigen::Index n = from.angle_deg.size();
  Session out;
  out.input.resize(n, 1);
  out.angle_deg.resize(n);
  for (Eigen::Index k = 0, at = 0; k < n; ++k, ++at) {
    if (k % block == 0) at = std::uniform_int_distribution<Eigen::Index>(0, n - 1)(random);
    const Eigen::Index source = at % n;  // circular: every sample is drawn as often
    out.input(k, 0) = from.input(source, 0);
    out.angle_deg(k) = from.angle_deg(source);
    out.use.push_back(from.use[static_cast<std::size_t>(source)] &&
                      static_cast<double>(k % block) * kSample_s >= kJoin_s);
  }
  return out;
}

Additive fitted_to(const Session& session, const Candidates& structure) {
  const auto still = [](const Additive&) { return 0.0; };
  const auto any = [](const Additive&) { return true; };
  return fit_additive({session}, kSample_s, "index", structure, still, 1, any, {}).front();
}

double stated(const Additive& fit, std::size_t knot) {
  const auto k = static_cast<Eigen::Index>(knot);
  return std::sqrt(fit.covariance(k, k));
}

// Its curve of the reading itself.
double curve_deg(const Additive& fit, double reading) {
  const std::vector<double>& x = fit.knots.front();
  const double u = std::clamp(reading, x.front(), x.back());
  const auto right =
      std::clamp<std::ptrdiff_t>(std::ranges::upper_bound(x, u) - x.begin(), 1, std::ssize(x) - 1);
  const auto i = static_cast<std::size_t>(right);
  const double share = (u - x[i - 1]) / (x[i] - x[i - 1]);
  return fit.offset_deg + (1 - share) * fit.value(right - 1, 0) + share * fit.value(right, 0);
}

struct RecordedHand {
  const char* folder;
  const char* map;
};

void PrintTo(const RecordedHand& c, std::ostream* out) { *out << c.folder; }

class StandardErrors : public testing::TestWithParam<RecordedHand> {};

TEST_P(StandardErrors, AreThoseOfABlockBootstrap) {
  const fs::path folder = fs::path(FLEXOR_SOURCE_DIR) / "../shared/data/glove" / GetParam().folder;
  if (!fs::exists(folder)) {
    GTEST_SKIP() << "needs the recordings in ../shared/data/glove, which are not part of the repository";
  }
  HandRequest request;
  request.pairs = {{folder / "sensor_log.csv", folder / "camera_angles.csv"}};
  request.map = parse_map(GetParam().map);
  request.input_unit = "count";
  const HandIdentification hand = identify_hand(request, {});
  for (const JointResult& joint : hand.joints) {
    const Session session = fitted_part(joint.samples.front());
    const auto structure = std::get<Candidates>(parse_structure(joint.text, 1));
    const Additive all = fitted_to(session, structure);
    const std::vector<double>& knots = all.knots.front();
    std::vector<double> sum(knots.size());
    std::vector<double> squares(knots.size());
    std::mt19937 random(2019);
    for (int draw = 0; draw < kDraws; ++draw) {
      const Additive one = fitted_to(drawn(session, random), structure);
      for (std::size_t k = 0; k < knots.size(); ++k) {
        const double y = curve_deg(one, knots[k]);
        sum[k] += y / kDraws;
        squares[k] += y * y / kDraws;
      }
    }
    std::vector<double> ratio;
    for (std::size_t k = 0; k < knots.size(); ++k) {
      const double bootstrap = std::sqrt(squares[k] - sum[k] * sum[k]);
      ratio.push_back(stated(all, k) / bootstrap);
      std::printf("%s at %.0f: %.2f against %.2f deg, ratio %.2f\n", joint.name.c_str(), knots[k],
                  stated(all, k), bootstrap, ratio.back());
    }
    std::ranges::sort(ratio);
    std::printf("%s median ratio %.2f (%.2f to %.2f)\n", joint.name.c_str(), ratio[ratio.size() / 2],
                ratio.front(), ratio.back());
    EXPECT_GT(ratio[ratio.size() / 2], 0.5) << joint.name;
    EXPECT_LT(ratio[ratio.size() / 2], 1.5) << joint.name;
  }
}

INSTANTIATE_TEST_SUITE_P(Glove, StandardErrors,
                         testing::Values(RecordedHand{"index_ind2", "abc=SensorA1:∠ABC,bcd=SensorA1:∠BCD"},
                                         RecordedHand{"middle_mid1", "abc=SensorA2:∠ABC,bcd=SensorA2:∠BCD"}));

}  // namespace
}  // namespace flexor::identify
