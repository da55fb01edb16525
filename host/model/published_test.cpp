// The shipped models are the published compensators: poles and gains of the paper.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <array>

#include "host/model/channel.hpp"

namespace flexor::model {
namespace {

const std::string kModels = FLEXOR_SOURCE_DIR "/models/";

// State-space matrices as printed (Sensors 2019, 19(18), 3896): poles and C (-A)^-1 B.
struct Printed {
  Eigen::MatrixXd a;
  Eigen::VectorXd b;
  Eigen::RowVectorXd c;
};

std::vector<Printed> printed_wiener() {
  const Eigen::Matrix3d thumb{{-84.51, -56.92, -21.02}, {32, 0, 0}, {0, 16, 0}};
  const Eigen::Matrix2d middle_three{{-31.6, -14.7}, {16, 0}};
  const Eigen::Matrix3d pinky{{-7863, -673.9, -81.33}, {512, 0, 0}, {0, 64, 0}};
  const auto second = [&](double c) {
    return Printed{middle_three, Eigen::Vector2d(4, 0), Eigen::RowVector2d(0, c)};
  };
  return {{thumb, Eigen::Vector3d(4, 0, 0), Eigen::RowVector3d(0, 0, 5.073)},
          second(3.252),
          second(4.666),
          second(4.424),
          {pinky, Eigen::Vector3d(8, 0, 0), Eigen::RowVector3d(0, 0, 11.27)}};
}

TEST(PublishedWiener, PolesAndGainsAreThoseOfThePrintedMatrices) {
  const Model m = load(kModels + "published_wiener.json");
  const auto printed = printed_wiener();
  const std::array gains = {0.965, 0.885, 1.270, 1.204, 1.109};
  ASSERT_EQ(m.joints.size(), 5u);
  for (std::size_t i = 0; i < 5; ++i) {
    Eigen::VectorXd poles = Eigen::EigenSolver<Eigen::MatrixXd>(printed[i].a).eigenvalues().real();
    std::sort(poles.begin(), poles.end(), std::greater<>());
    const auto chain = channel(m, i);
    ASSERT_TRUE(chain.has_value());
    const auto& ours = chain->lti.poles_rad_s;
    ASSERT_EQ(ours.size(), static_cast<std::size_t>(poles.size()));
    for (std::size_t k = 0; k < ours.size(); ++k)
      EXPECT_NEAR(ours[k] / poles(static_cast<Eigen::Index>(k)), 1, 1e-9);
    const double gain = -(printed[i].c * printed[i].a.fullPivLu().solve(printed[i].b))(0);
    EXPECT_NEAR(chain->lti.gain, gain, 1e-9);
    EXPECT_NEAR(chain->lti.gain, gains[i], 0.0005);
  }
}

TEST(PublishedHammersteinWiener, PolesGainsAndDeadZonesAreThePapers) {
  const Model m = load(kModels + "published_hw.json");
  const std::array poles = {-54.0, -19.0, -19.0, -21.0, -15.0};
  const std::array gains = {1.278, 1.263, 1.421, 1.333, 1.400};
  ASSERT_EQ(m.joints.size(), 5u);
  for (std::size_t i = 0; i < 5; ++i) {
    const auto chain = channel(m, i);
    ASSERT_TRUE(chain.has_value());
    const Channel& c = *chain;
    EXPECT_EQ(c.lti.poles_rad_s, std::vector{poles[i]});
    EXPECT_NEAR(c.lti.gain, gains[i], 0.0005);
    EXPECT_EQ(c.dead_zone, (DeadZone{-10, i == 4 ? 30.0 : 20.0}));
    EXPECT_EQ(c.saturation, (i == 0 ? Saturation{90, 170} : Saturation{29, 112}));
  }
}

}  // namespace
}  // namespace flexor::model
