#include "host/study/published.hpp"

#include <gtest/gtest.h>

namespace flexor::study {
namespace {

double distance(const std::string& compensator, double constant) {
  double sum = 0;
  for (int g = 1; g <= 4; ++g) {
    const double l = std::log(constant / *published_error_deg_s(g, compensator));
    sum += l * l;
  }
  return sum;
}

TEST(NullModel, FiguresThatAnIndependentCheckFound) {
  const NullModel m = null_model();
  EXPECT_NEAR(m.fitted_log_rms, 0.255, 0.0005);
  EXPECT_NEAR(m.other_log_rms, 0.437, 0.0005);
}

TEST(NullModel, NoOtherConstantIsNearer) {
  for (const auto& [compensator, constant] : null_model().error_deg_s) {
    EXPECT_LT(distance(compensator, constant), distance(compensator, 1.01 * constant));
    EXPECT_LT(distance(compensator, constant), distance(compensator, 0.99 * constant));
  }
}

TEST(Published, TheThreeTrialsAverageToThePrintedAverage) {
  for (const std::string& c : published_compensators()) {
    for (int g = 1; g <= 6; ++g) {
      const auto t = published_trials_deg_s(g, c);
      EXPECT_NEAR((t[0] + t[1] + t[2]) / 3, *published_error_deg_s(g, c), 0.35) << c << g;
    }
  }
}

}  // namespace
}  // namespace flexor::study
