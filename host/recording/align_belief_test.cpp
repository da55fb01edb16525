// When an alignment may be believed: short recordings, recordings of different motions, impossible clocks.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <optional>
#include <random>

#include "host/io/io.hpp"
#include "host/recording/align.hpp"
#include "host/recording/csv.hpp"

namespace flexor::recording {
namespace {

constexpr double kBelieved = 0.1;  // below, a warning says why not

// A finger that bends to random angles, quickly or slowly, and rests there for a while.
class SlowMotion {
 public:
  SlowMotion(unsigned seed, double duration_s, double slowest_move_s = 1.2) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform;
    while (at_.back() < duration_s) {
      at_.push_back(at_.back() + 0.3 + slowest_move_s * uniform(random));
      angle_.push_back(angle_.back() > 55 ? 10 + 40 * uniform(random) : 60 + 40 * uniform(random));
      at_.push_back(at_.back() + 0.6 * uniform(random));
      angle_.push_back(angle_.back());
    }
  }
  double operator()(double t) const {
    const auto i = static_cast<std::size_t>(std::upper_bound(at_.begin(), at_.end(), t) - at_.begin());
    if (i == 0) return angle_.front();
    if (i == at_.size()) return angle_.back();
    const double s = (t - at_[i - 1]) / (at_[i] - at_[i - 1]);
    return angle_[i - 1] + (angle_[i] - angle_[i - 1]) * s * s * (3 - 2 * s);
  }

 private:
  std::vector<double> at_{0};
  std::vector<double> angle_{40};
};

struct Signal {
  std::vector<double> t_s, value;
  Series series() const { return {t_s, value}; }
};

// A glove's sensor: bent, falling, noisy, in whole counts.
Signal glove(const SlowMotion& motion, double begin_s, double end_s, double rate_hz, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise;
  Signal s;
  for (double t = begin_s; t < end_s; t += 1 / rate_hz) {
    s.t_s.push_back(t);
    s.value.push_back(std::round(900 - 500 * std::pow(motion(t) / 100, 1.6) + 2 * noise(random)));
  }
  return s;
}

Signal camera(const SlowMotion& motion, double begin_s, double end_s, double offset_s, unsigned seed,
              double drift = 0) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise;
  Signal s;
  for (double t = begin_s; t < end_s; t += 1.0 / 30) {
    s.t_s.push_back(t * (1 + drift) + offset_s);
    s.value.push_back(motion(t) + 0.5 * noise(random));
  }
  return s;
}

TEST(AlignShort, FiveToNineSecondsAt250HzFindTheirOffset) {
  int believed = 0;
  for (const double duration_s : {5.0, 7.0, 9.0}) {
    for (unsigned seed = 0; seed < 10; ++seed) {
      const SlowMotion motion(seed, 20);
      const Signal sensor = glove(motion, 3, 3 + duration_s, 250, seed);
      const Signal reference = camera(motion, 2.2, 4 + duration_s, 12.34, seed + 100);
      const Alignment a = align(sensor.series(), reference.series());
      EXPECT_NEAR(a.clock_offset_s, 12.34, 0.06) << duration_s << " s, seed " << seed;
      believed += a.confidence >= kBelieved;
      EXPECT_EQ(a.confidence < kBelieved, !a.warnings.empty());
      EXPECT_FALSE(a.drift_ppm) << "seconds say nothing about a clock's rate";
    }
  }
  EXPECT_GE(believed, 10) << "of 30";
}

TEST(AlignShort, OneSingleMovementIsNotBelieved) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    Signal sensor;
    Signal reference;
    std::mt19937 random(seed);
    std::normal_distribution<double> noise;
    for (double t = 0; t < 8; t += 0.004) {
      sensor.t_s.push_back(t);
      sensor.value.push_back(500 + 100 * std::tanh(4 * (t - 3)) + noise(random));
    }
    for (double t = 0; t < 8; t += 1.0 / 30) {
      reference.t_s.push_back(t);
      reference.value.push_back(50 + 30 * std::tanh(4 * (t - 4.5)) + 0.5 * noise(random));
    }
    const Alignment a = align(sensor.series(), reference.series());
    EXPECT_LT(a.confidence, kBelieved);
    ASSERT_FALSE(a.warnings.empty());
    EXPECT_NE(a.warnings.back().find("too little motion"), std::string::npos) << a.warnings.back();
  }
}

// Confidence of two recordings, none when they are refused.
std::optional<double> confidence(const Series& sensor, const Series& reference) {
  try {
    return align(sensor, reference).confidence;
  } catch (const io::JobError&) {
    return std::nullopt;
  }
}

TEST(AlignUnrelated, MotionsOfDifferentTakesAreNotBelieved) {
  int believed = 0;
  int tried = 0;
  for (const double duration_s : {7.0, 12.0, 30.0, 100.0, 200.0}) {
    for (unsigned seed = 0; seed < 30; ++seed) {
      const SlowMotion one(seed, 2 * duration_s, 3);
      const SlowMotion other(seed + 1000, 2 * duration_s, 3);
      const auto c = confidence(glove(one, 0, duration_s, 100, seed).series(),
                                camera(other, 0, duration_s + 3, 5, seed + 100).series());
      believed += c.value_or(0) >= kBelieved;
      ++tried;
    }
  }
  EXPECT_LE(believed, 3) << "of " << tried;
}

TEST(AlignUnrelated, AClockThatNoCrystalHasIsAMismatchAndNoDrift) {
  const SlowMotion motion(3, 130, 12);  // slow enough for the wrong clock to look like the same motion
  const Signal sensor = glove(motion, 5, 115, 20, 1);
  for (const double drift : {-0.018, 0.018}) {
    const Signal reference = camera(motion, 0, 122, 0, 2, drift);
    try {
      const Alignment a = align(sensor.series(), reference.series());
      FAIL() << a.drift_ppm.value_or(0) << " ppm, confidence " << a.confidence;
    } catch (const io::JobError& error) {
      EXPECT_NE(std::string(error.what()).find("do not belong together"), std::string::npos) << error.what();
    }
  }
  // What an RC oscillator may have is still measured.
  const Alignment good = align(sensor.series(), camera(motion, 0, 122, 0, 2, 0.005).series());
  ASSERT_TRUE(good.drift_ppm);
  EXPECT_NEAR(*good.drift_ppm, 5000, 1500);
  EXPECT_GT(good.confidence, kBelieved);
}

// Logs and cameras of the real glove that were not recorded together, all of one motor-driven motion: as
// alike as unrelated recordings can be.
TEST(AlignUnrelated, RealLogsBesideOtherTakesCamerasAreHardlyBelieved) {
  const std::filesystem::path folder = std::filesystem::path(FLEXOR_SOURCE_DIR) / "../shared/data/glove";
  if (!std::filesystem::exists(folder)) {
    GTEST_SKIP() << "needs the recordings in ../shared/data/glove, which are not part of the repository";
  }
  const std::vector<std::string> sensors = {"SensorA0", "SensorA1", "SensorA2"};
  const std::vector<std::string> angles = {"∠ABC_smooth", "∠BCD_smooth"};
  int believed = 0;
  int tried = 0;
  for (const char* take : {"index_ind2", "middle_mid1"}) {
    const Recording seen = read_csv(folder / take / "camera_angles.csv", angles);
    for (const char* log : {"index_ind2/sensor_log.csv", "middle_mid1/sensor_log.csv", "runs/aug9_205112.csv",
                            "runs/aug9_205605.csv", "runs/aug9_210522.csv", "runs/ind0.csv", "runs/ind1.csv",
                            "runs/thu1.csv"}) {
      if (std::string(log).starts_with(take)) continue;
      const Recording sensed = read_csv(folder / log, sensors);
      for (const std::string& sensor : sensors) {
        for (const std::string& angle : angles) {
          const double c = confidence(sensed.series(sensor), seen.series(angle)).value_or(0);
          EXPECT_LT(c, 0.25) << take << " " << log << " " << sensor << " " << angle;
          believed += c >= kBelieved;
          ++tried;
        }
      }
    }
  }
  EXPECT_EQ(tried, 84);
  EXPECT_LE(believed, 2);
}

}  // namespace
}  // namespace flexor::recording
