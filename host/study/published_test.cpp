#include "host/study/published.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace flexor::study {
namespace {

TEST(NullModel, FiguresThatAnIndependentCheckFound) {
  const Json m = null_model();
  EXPECT_NEAR(m.at("log_rms_gestures_1_to_4").get<double>(), 0.255, 0.0005);
  EXPECT_NEAR(m.at("log_rms_gestures_5_and_6").get<double>(), 0.437, 0.0005);
}

TEST(NullModel, NoOtherConstantIsNearer) {
  const Json constants = null_model().at("error_deg_s");
  for (const auto& [name, constant] : constants.items()) {
    double slope = 0;  // of half the sum of squares
    for (int g = 1; g <= 4; ++g) slope += std::log(constant.get<double>() / *published_error_deg_s(g, name));
    EXPECT_NEAR(slope, 0, 1e-9) << name;
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
