#include "host/twin/exact_json.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>

#include "host/io/io.hpp"

namespace flexor::twin {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kModels = FLEXOR_SOURCE_DIR "/models/";

// As through a pipe: on one line and back.
Json line(const Json& json) { return Json::parse(json.dump()); }

TrialInput gesture() {
  Parameters p;
  p.noise_deg = 1.0 / 3;
  p.loss = 0.1;
  p.faults.push_back({2, FaultKind::loose, 0.1, 1.0 / 7});
  model::Model model = model::load(std::string(kModels) + "published_hw.json");
  model.sample_period_s = 1.0 / 30;
  return {p, Motion::from_json(io::read_file(std::string(kModels) + "gestures/4.json"), "4.json"), model,
          UINT64_MAX - 5, true};
}

TEST(ExactJson, ASetupThatCameThroughAPipePlaysTheSameTrial) {
  const twin::TrialInput input = gesture();
  const twin::TrialInput back = trial_input_of(line(exact_json(input)));
  EXPECT_EQ(back.compensator, input.compensator);
  EXPECT_EQ(back.motion.number(), 4);
  EXPECT_EQ(to_json(back.parameters), to_json(input.parameters));
  EXPECT_TRUE(simulate(back, 3, 1) == simulate(input, 3, 1));
}

TEST(ExactJson, ARecordedMotionKeepsItsSamples) {
  std::array<std::vector<double>, kFingers> angle_deg;
  std::vector<double> t_s;
  for (int k = 0; k < 50; ++k) {
    t_s.push_back(k / 30.0);
    for (std::size_t i = 0; i < kFingers; ++i)
      angle_deg[i].push_back(60 + 100 * std::sin(k + 0.1 * static_cast<double>(i)) / 3);
  }
  const Motion motion = Motion::from_samples("wave \"1\"", t_s, angle_deg);
  const Motion back = motion_of(line(exact_json(motion)));
  EXPECT_EQ(back.name(), motion.name());
  EXPECT_EQ(back.duration_s(), motion.duration_s());
  for (double t = -0.5; t < 2; t += 0.013) EXPECT_EQ(back.angle(2, t, {}), motion.angle(2, t, {}));
  Json cut = exact_json(motion);
  cut.at("angle_deg").at(3).erase(0);
  EXPECT_THROW(motion_of(cut), io::InputError);
}

TEST(ExactJson, ATrialKeepsEveryBit) {
  const Trial trial = simulate(gesture(), 0, 1).front();
  ASSERT_GT(trial.sample_s.size(), 100U);
  EXPECT_TRUE(trial_of(line(exact_json(trial))) == trial);
}

TEST(ExactJson, NumbersThatJsonHasNoWordFor) {
  const double inf = std::numeric_limits<double>::infinity();
  for (const double x : {0.1, -0.0, inf, -inf, std::numeric_limits<double>::denorm_min()}) {
    EXPECT_EQ(std::bit_cast<std::uint64_t>(number_of(line(exact_json(x)))), std::bit_cast<std::uint64_t>(x));
  }
  EXPECT_TRUE(std::isnan(number_of(line(exact_json(std::nan(""))))));
  EXPECT_THROW(number_of("none"), io::InputError);
}

}  // namespace
}  // namespace flexor::twin
