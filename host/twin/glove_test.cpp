#include "host/twin/glove.hpp"

#include <gtest/gtest.h>

namespace flexor::twin {
namespace {

TEST(Divider, FollowsTheArticlesEquationThree) {
  const Divider divider{Parameters()};
  for (const double theta : {0.0, 45.0, 90.0, 180.0}) {
    const double volt_share = (100 * theta + 4500) / (100 * theta + 180 * (25 + 35));
    EXPECT_NEAR(divider.counts(theta), 1023 * volt_share, 0.5 + 1e-9) << theta;
  }
}

TEST(Divider, AlphaGivesTheBendBackWithinOneCount) {
  const Divider divider{Parameters()};
  for (double theta = -20; theta <= 180; theta += 0.7) {
    const int counts = divider.counts(theta);
    const double count_deg = divider.alpha_deg(counts + 1) - divider.alpha_deg(counts);
    EXPECT_NEAR(divider.alpha_deg(counts), theta, 0.51 * count_deg) << theta;
  }
}

TEST(Divider, TheRailsLieOutsideEveryRealBend) {
  const Divider divider{Parameters()};
  EXPECT_LT(divider.alpha_deg(0), -44);
  EXPECT_GT(divider.alpha_deg(kAdcTop), 1023);
  EXPECT_EQ(divider.counts(-1000), 0);
}

}  // namespace
}  // namespace flexor::twin
