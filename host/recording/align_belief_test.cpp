// When an alignment may be believed: short recordings, recordings of different motions, impossible clocks.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <optional>
#include <random>

#include "host/io/io.hpp"
#include "host/recording/align.hpp"
#include "host/recording/csv.hpp"

namespace flexor::recording {
namespace {

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
  // Bends and straightens with this period instead, which varies by `share`.
  void repeat(double period_s, double share, double duration_s, std::mt19937& random) {
    std::normal_distribution<double> normal;
    for (at_ = {0}, angle_ = {10}; at_.back() < duration_s;) {
      at_.push_back(at_.back() + period_s / 2 * std::max(0.1, 1 + share * normal(random)));
      angle_.push_back(angle_.back() > 45 ? 10 : 80);
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
              double drift = 0, double noise_deg = 0.5) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise;
  Signal s;
  for (double t = begin_s; t < end_s; t += 1.0 / 30) {
    s.t_s.push_back(t * (1 + drift) + offset_s);
    s.value.push_back(motion(t) + noise_deg * noise(random));
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
      believed += a.confidence >= kUnsure;
      EXPECT_TRUE(a.confidence >= kUnsure || !a.warnings.empty());
      EXPECT_FALSE(a.drift_ppm) << "seconds say nothing about a clock's rate";
    }
  }
  EXPECT_GE(believed, 10) << "of 30";
}

// Of what says p, p is right to 0.15 s: of stretches of 5 to 100 s, some of motions that repeat themselves, of which the
// camera saw all or lost up to a third of either end. Other seeds than those of the fit.
TEST(AlignBelief, ConfidenceIsTheShareOfOffsetsThatAreRight) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform;
  struct Said {
    double confidence = 0, right = 0, count = 0;
  };
  std::array<Said, 2> said;  // below 0.85, and from there on
  for (unsigned seed = 1000; seed < 1400; ++seed) {
    const double length_s = 5 * std::pow(20, uniform(random));
    SlowMotion motion(seed, length_s + 20);
    if (seed % 3 == 0) motion.repeat(1 + 5 * uniform(random), 0.03 * uniform(random), length_s + 20, random);
    const double cut_s = seed % 2 == 0 ? 0 : 0.33 * length_s;
    const Signal sensor = glove(motion, 3, 3 + length_s, 50, seed);
    const Signal reference = camera(motion, 2 + cut_s * uniform(random),
                                    4 + length_s - cut_s * uniform(random), 12.34, seed, 0, 8);
    try {
      const Alignment a = align(sensor.series(), reference.series());
      Said& of = said[a.confidence < 0.85 ? 0 : 1];
      of.confidence += a.confidence;
      of.right += std::abs(a.clock_offset_s - 12.34) <= 0.15;
      ++of.count;
    } catch (const io::JobError&) {
    }
  }
  for (const Said& of : said) {
    EXPECT_GT(of.count, 40);
    EXPECT_NEAR(of.confidence / of.count, of.right / of.count, 0.1);
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

TEST(AlignUnrelated, MotionsOfDifferentTakesAreHardlyBelieved) {
  int believed = 0;  // of seconds that hold two or three movements
  for (const double duration_s : {7.0, 12.0, 30.0, 100.0, 200.0}) {
    for (unsigned seed = 0; seed < 30; ++seed) {
      const SlowMotion one(seed, 2 * duration_s, 3);
      const SlowMotion other(seed + 1000, 2 * duration_s, 3);
      const auto c = confidence(glove(one, 0, duration_s, 100, seed).series(),
                                camera(other, 0, duration_s + 3, 5, seed + 100).series());
      if (duration_s < 30) {
        believed += c.value_or(0) >= kUnsure;
      } else {
        EXPECT_LT(c.value_or(0), 0.3) << duration_s << " s, seed " << seed;
      }
    }
  }
  EXPECT_LE(believed, 8) << "of 60";
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
  EXPECT_GT(good.confidence, kUnsure);
}

// The real glove's logs beside cameras of other takes, all of one motion by motors: as alike as unrelated recordings can be.
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
          EXPECT_LT(c, 0.6) << take << " " << log << " " << sensor << " " << angle;
          believed += c >= kUnsure;
          ++tried;
        }
      }
    }
  }
  EXPECT_EQ(tried, 84);
  EXPECT_LE(believed, 4);
}

}  // namespace
}  // namespace flexor::recording
