// The curves' standard errors on real recordings beside those of a block bootstrap, which leans on other assumptions:
// blocks of 20 s of the fitted part drawn with replacement, the same structure fitted to each draw with knots and priors of
// its own. They are small where those choices spread.
#include "host/identify/hand_test.hpp"

#include <cmath>
#include <random>

#include "host/identify/structure_text.hpp"
#include "host/io/numbers.hpp"

namespace flexor::identify {
namespace {

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

double stated_deg(const Additive& fit, std::size_t knot) {
  return std::sqrt(fit.covariance.diagonal()(static_cast<Eigen::Index>(knot)));
}

// Its curve of the reading itself.
double curve_deg(const Additive& fit, double reading) {
  const std::vector<double>& knots = fit.knots.front();
  return fit.offset_deg + io::interpolate(knots, {fit.value.col(0).data(), knots.size()}, reading);
}

class StandardErrors : public RealRecordings,
                       public testing::WithParamInterface<std::pair<const char*, const char*>> {};

TEST_P(StandardErrors, AreThoseOfABlockBootstrap) {
  const HandIdentification hand = identify_hand(request(GetParam().first, GetParam().second), {});
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
      const double stated = stated_deg(all, k), bootstrap = std::sqrt(squares[k] - sum[k] * sum[k]);
      ratio.push_back(stated / bootstrap);
      std::printf("%s at %.0f: %.2f against %.2f deg\n", joint.name.c_str(), knots[k], stated, bootstrap);
    }
    std::ranges::sort(ratio);
    const double median = ratio[ratio.size() / 2];
    std::printf("%s median ratio %.2f (%.2f to %.2f)\n", joint.name.c_str(), median, ratio.front(),
                ratio.back());
    EXPECT_GT(median, 0.5) << joint.name;
    EXPECT_LT(median, 1.5) << joint.name;
  }
}

INSTANTIATE_TEST_SUITE_P(Glove, StandardErrors,
                         testing::Values(std::pair{"glove/index_ind2", "abc=SensorA1:∠ABC,bcd=SensorA1:∠BCD"},
                                         std::pair{"glove/middle_mid1",
                                                   "abc=SensorA2:∠ABC,bcd=SensorA2:∠BCD"}));

}  // namespace
}  // namespace flexor::identify
