#include "runtime/sensor/zero.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <random>

namespace flexor::sensor {
namespace {

constexpr uint8_t kRate_hz = 50;
constexpr int16_t q5(double value) { return static_cast<int16_t>(32 * value); }

// A sensor that reads gain u + offset of what the model's sensor read.
struct Glove {
  double gain = 1;
  double offset = 0;
  double noise = 0;
  struct Settings {
    Poses poses;
  };
  std::array<Settings, 2> settings = {{{{q5(400), q5(700)}}, {{q5(600), q5(350)}}}};  // rising, falling
  Zero<2> zero{kRate_hz};
  std::mt19937 random{1};

  // `closed`: 0 open, 1 fist, by time.
  ZeroStage run(const std::function<double(double t_s)>& closed, double seconds = 6) {
    zero.press();
    for (int k = 0; k < seconds * kRate_hz; ++k) {
      std::array<int16_t, 2> alpha{};
      for (std::size_t i = 0; i < 2; ++i) {
        const double model = settings[i].poses.open +
                             (settings[i].poses.fist - settings[i].poses.open) * closed(k / double{kRate_hz});
        const double read = (model / 32 - offset) / gain + noise * std::normal_distribution<>()(random);
        alpha[i] = q5(read);
      }
      zero.step(settings.data(), alpha.data());
    }
    return zero.stage();
  }
};

double as_asked(double t_s) { return t_s < 3.3 ? 0 : 1; }

TEST(Zero, SetsGainAndOffsetAgainstTheStoredPoses) {
  for (const double gain : {0.8, 0.9, 1.0, 1.3, 1.9}) {
    Glove glove;
    glove.gain = gain;
    glove.offset = 25;
    glove.noise = 4;  // 20 counts from end to end, where an eighth of 250 is the most
    ASSERT_EQ(glove.run(as_asked), ZeroStage::done) << gain;
    for (std::size_t i = 0; i < 2; ++i) {
      for (const double model : {350.0, 500.0, 700.0}) {
        const int16_t alpha = q5((model - glove.offset) / gain);
        EXPECT_NEAR(glove.zero.corrections()[i](alpha) / 32.0, model, 1.5) << gain;
      }
    }
  }
}

TEST(Zero, AnUnchangedGloveStaysWithinACount) {
  Glove glove;
  ASSERT_EQ(glove.run(as_asked), ZeroStage::done);
  EXPECT_EQ(glove.zero.corrections()[0](q5(500)), q5(500));
  EXPECT_EQ(kUncorrected(q5(-321.5)), q5(-321.5)) << "and none is none, to the bit";
  EXPECT_EQ(kUncorrected(INT16_MAX), INT16_MAX);
}

TEST(Zero, RefusesPosesThatAreTooNearSwappedOrNotHeld) {
  EXPECT_EQ(Glove().run([](double) { return 0.0; }), ZeroStage::refused) << "never closed";
  EXPECT_EQ(Glove().run([](double t) { return 0.45 * as_asked(t); }), ZeroStage::refused) << "half closed";
  EXPECT_EQ(Glove().run([](double t) { return 1 - as_asked(t); }), ZeroStage::refused) << "swapped";
  EXPECT_EQ(Glove().run([](double t) { return std::fmod(t, 1.0) < 0.5 ? 0.0 : 1.0; }), ZeroStage::refused)
      << "moving";
  Glove noisy;
  noisy.noise = 10;
  EXPECT_EQ(noisy.run(as_asked), ZeroStage::refused);
  Glove far;
  far.gain = 0.45;
  far.offset = 250;  // within the converter's range
  EXPECT_EQ(far.run(as_asked), ZeroStage::refused) << "another sensor, more likely than this one";
}

TEST(Zero, TakesItsTimeAndCanBeGivenUp) {
  Glove glove;
  EXPECT_EQ(glove.run(as_asked, 2.9), ZeroStage::open);
  glove.zero.press();
  EXPECT_EQ(glove.zero.stage(), ZeroStage::idle);
  EXPECT_EQ(glove.run(as_asked, 5.9), ZeroStage::fist);
}

}  // namespace
}  // namespace flexor::sensor
