#include "host/recording/align.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <numbers>
#include <ostream>
#include <random>

#include "host/io/refusal_test.hpp"
#include "host/recording/csv.hpp"

namespace flexor::recording {
namespace {

struct Signal {
  std::vector<double> t_s, value;
  operator Series() const { return {t_s, value}; }
};

struct TwoLogs {
  Signal sensor, reference;
  Alignment align() const { return recording::align(sensor, reference); }
};

struct Moves {
  std::vector<double> at{0};
  std::vector<double> angle{40};
  double operator()(double t) const {
    const auto i = static_cast<std::size_t>(std::upper_bound(at.begin(), at.end(), t) - at.begin());
    if (i == 0) return angle.front();
    if (i == at.size()) return angle.back();
    const double s = (t - at[i - 1]) / (at[i] - at[i - 1]);
    return angle[i - 1] + (angle[i] - angle[i - 1]) * s * s * (3 - 2 * s);
  }
};

// A finger that bends to random angles, quickly or slowly, and rests there for a while.
struct SlowMotion : Moves {
  SlowMotion(unsigned seed, double duration_s, double slowest_move_s = 1.2) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform;
    while (at.back() < duration_s) {
      at.push_back(at.back() + 0.3 + slowest_move_s * uniform(random));
      angle.push_back(angle.back() > 55 ? 10 + 40 * uniform(random) : 60 + 40 * uniform(random));
      at.push_back(at.back() + 0.6 * uniform(random));
      angle.push_back(angle.back());
    }
  }
  // Bends and straightens with this period instead, which varies by `share`.
  void repeat(double period_s, double share, double duration_s, std::mt19937& random) {
    std::normal_distribution<double> normal;
    for (at = {0}, angle = {10}; at.back() < duration_s;) {
      at.push_back(at.back() + period_s / 2 * std::max(0.1, 1 + share * normal(random)));
      angle.push_back(angle.back() > 45 ? 10 : 80);
    }
  }
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

TwoLogs make(double offset_s, double drift = 0) {
  const SlowMotion motion(3, 130, 3);
  TwoLogs out{glove(motion, 5, 110, 9, 5), camera(motion, 0, 118, offset_s, 5, drift, 1)};
  for (std::vector<double>* v : {&out.sensor.t_s, &out.sensor.value})
    v->erase(v->begin() + 405, v->begin() + 423);  // a pause
  return out;
}

TEST(Align, FindsTheOffsetThroughSignScaleCurveAndGap) {
  for (const double offset : {-300.0, -7.3, 0.0, 12.34, 300.0}) {
    TwoLogs p = make(offset);
    for (double& y : p.reference.value) y *= offset < 0 ? -1 : 1;
    const Alignment a = p.align();
    EXPECT_NEAR(a.clock_offset_s, offset, 0.05);
    EXPECT_GT(a.confidence, 0.5);
    EXPECT_LE(a.confidence, 1);
    EXPECT_TRUE(a.warnings.empty());
  }
}

TEST(Align, ADriftIsMeasuredWithItsError) {
  for (const double ppm : {-5000.0, 0.0, 1000.0, 10000.0}) {
    const Alignment a = make(0, 1e-6 * ppm).align();
    ASSERT_TRUE(a.drift_se_ppm.has_value());
    EXPECT_NEAR(*a.drift_ppm, ppm, 3 * *a.drift_se_ppm);
    EXPECT_LT(*a.drift_se_ppm, 500);
  }
}

TEST(Align, AClockThatJumpsIsNoDrift) {
  EXPECT_FALSE(make(4, 3e-3).align().jump);
  for (const bool by_sensor : {true, false}) {
    TwoLogs p = make(4);
    for (double& t : by_sensor ? p.sensor.t_s : p.reference.t_s) t += t > 62 ? 0.5 : 0;
    EXPECT_NE(p.align().jump.value_or("").find(by_sensor ? "by -0." : "by +0."), std::string::npos);
    for (double& t : by_sensor ? p.sensor.t_s : p.reference.t_s) t += t > 85 ? 0.5 : 0;
    EXPECT_NE(p.align().jump.value_or("").find(by_sensor ? " s, -0." : " s, +0."), std::string::npos);
  }
}

// The sensor's log begins somewhere within the camera's: every period, and every half, is another answer.
TEST(Align, AMotionThatRepeatsItselfExactlyIsCalledAmbiguous) {
  for (const double speed : {1.0, 2.0, 2 * std::numbers::pi, 15.0}) {
    TwoLogs p;
    std::mt19937 random(2);
    std::normal_distribution<double> noise;
    for (double t = 0; t < 60; t += 0.02) {
      p.sensor.t_s.push_back(t);
      p.sensor.value.push_back(500 + 200 * std::sin(speed * t));
      p.reference.t_s.push_back(t - 0.3);
      p.reference.value.push_back(50 + 20 * std::sin(speed * (t - 0.3)) + noise(random));
    }
    const Alignment a = p.align();
    EXPECT_LT(a.confidence, kUnsure) << speed;
    EXPECT_NE(a.warnings.at(0).find("ambiguous"), std::string::npos) << a.warnings[0];
  }
}

TEST(Align, RefusesUnrelatedAndShortRecordings) {
  const auto refusal = [](const TwoLogs& p) {
    return io::refusal_of<io::JobError>([&] { (void)p.align(); });
  };
  TwoLogs p = make(0);
  std::mt19937 random(1);
  for (double& y : p.reference.value) y = static_cast<double>(random() % 100);
  EXPECT_NE(refusal(p).find("do not correlate"), std::string::npos);
  TwoLogs brief = make(0);
  brief.reference.t_s.resize(45);
  brief.reference.value.resize(45);
  EXPECT_NE(refusal(brief).find("overlap too short"), std::string::npos);
  TwoLogs cut = make(0);
  cut.sensor.t_s.resize(15);
  cut.sensor.value.resize(15);
  EXPECT_NE(refusal(cut).find("overlap too short"), std::string::npos);
}

TEST(Align, AUsersOffsetIsCheckedAgainstTheSignals) {
  const Alignment a = make(4).align();
  EXPECT_FALSE(disagreement(4.1, a).has_value());
  EXPECT_TRUE(disagreement(4.3, a).has_value());
  const auto warning = disagreement(6.5, a);
  ASSERT_TRUE(warning.has_value());
  EXPECT_NE(warning->find("by +2."), std::string::npos) << *warning;
}

TEST(Align, ASensorThatTurnsBackOverPartOfTheRangeStillAligns) {
  TwoLogs p = make(2.5);
  const SlowMotion motion(3, 130, 3);
  for (std::size_t k = 0; k < p.sensor.value.size(); ++k)
    p.sensor.value[k] = 500 - 0.2 * std::pow(motion(p.sensor.t_s[k]) - 35, 2);
  EXPECT_NEAR(p.align().clock_offset_s, 2.5, 0.1);
}

// And nine to thirteen with a minute's pause of both in the middle.
TEST(AlignShort, FiveToNineSecondsAt250HzFindTheirOffset) {
  int believed = 0;
  for (int k = 0; k < 60; ++k) {
    const double duration_s = 5 + k % 3 * 2 + k % 2 * 4;
    const auto seed = static_cast<unsigned>(k) / 6;
    const SlowMotion motion(seed, 20);
    Signal sensor = glove(motion, 3, 3 + duration_s, 250, seed);
    Signal reference = camera(motion, 2.2, 4 + duration_s, 12.34, seed + 100);
    const auto pause = [&](double& t, double at_s) { t += k % 2 == 1 && t > at_s ? 60 : 0; };
    for (double& t : sensor.t_s) pause(t, 3 + duration_s / 2);
    for (double& t : reference.t_s) pause(t, 15.34 + duration_s / 2);
    const Alignment a = align(sensor, reference);
    EXPECT_NEAR(a.clock_offset_s, 12.34, 0.06) << duration_s << " s, seed " << seed;
    believed += a.confidence >= kUnsure;
    EXPECT_TRUE(a.confidence >= kUnsure || !a.warnings.empty());
    EXPECT_FALSE(a.drift_ppm) << "seconds say nothing about a clock's rate";
  }
  EXPECT_GE(believed, 20) << "of 60";
}

// Of what says p, p is right to 0.15 s: of stretches of 5 to 100 s, of which the camera saw all or lost up to a third of
// either end, always of motions that repeat themselves: there the ends must not tell. Other seeds than those of the fit.
TEST(AlignBelief, ConfidenceIsTheShareOfOffsetsThatAreRight) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform;
  struct Group {
    double confidence = 0, right = 0, count = 0;
  };
  std::array<Group, 2> groups;  // below 0.85, and from there on
  for (unsigned seed = 1000; seed < 1400; ++seed) {
    const double length_s = 5 * std::pow(20, uniform(random));
    SlowMotion motion(seed, length_s + 20);
    if (seed % 3 == 0) motion.repeat(1 + 5 * uniform(random), 0.03 * uniform(random), length_s + 20, random);
    const double cut_s = seed % 2 == 0 && seed % 3 != 0 ? 0 : 0.33 * length_s;
    const Signal sensor = glove(motion, 3, 3 + length_s, 50, seed);
    const Signal reference = camera(motion, 2 + cut_s * uniform(random),
                                    4 + length_s - cut_s * uniform(random), 12.34, seed, 0, 8);
    try {
      const Alignment a = align(sensor, reference);
      Group& of = groups[a.confidence < 0.85 ? 0 : 1];
      of.confidence += a.confidence;
      of.right += std::abs(a.clock_offset_s - 12.34) <= 0.15;
      ++of.count;
    } catch (const io::JobError&) {
    }
  }
  for (const Group& of : groups) {
    EXPECT_GT(of.count, 40);
    EXPECT_LT(of.confidence, of.right + 0.1 * of.count);
    EXPECT_GT(of.confidence, of.right - 0.2 * of.count) << "of many alike it doubts more than it must";
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
      const auto c =
          confidence(glove(one, 0, duration_s, 100, seed), camera(other, 0, duration_s + 3, 5, seed + 100));
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
    const std::string what = io::refusal_of<io::JobError>([&] { (void)align(sensor, reference); });
    EXPECT_NE(what.find("do not belong together"), std::string::npos) << what;
  }
  // What an RC oscillator may have is still measured.
  const Alignment good = align(sensor, camera(motion, 0, 122, 0, 2, 0.005));
  ASSERT_TRUE(good.drift_ppm);
  EXPECT_NEAR(*good.drift_ppm, 5000, 1500);
  EXPECT_GT(good.confidence, kUnsure);
}

// The real glove's logs beside cameras of other takes, all of one motion by motors: as alike as unrelated recordings can be.
TEST(AlignUnrelated, RealLogsBesideOtherTakesCamerasAreHardlyBelieved) {
  const std::filesystem::path folder = std::filesystem::path(FLEXOR_SOURCE_DIR) / "../shared/data/glove";
  if (!std::filesystem::exists(folder))
    GTEST_SKIP() << "needs the recordings in ../shared/data/glove, which are not part of the repository";
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

// The recordings of a real glove. The offset is that of the independent re-alignment beside them (realigned_20hz.csv): where its zero
// lies on the camera's clock less where it lies on the sensor's, each by least squares over its first 100 s.
struct RealCase {
  const char* folder;
  const char* sensor;
  const char* angle;
  double offset_s;

  friend std::ostream& operator<<(std::ostream& out, const RealCase& c) {
    return out << c.folder << '/' << c.angle;
  }
};

class RealRecordings : public testing::TestWithParam<RealCase> {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(folder()))
      GTEST_SKIP() << "needs the recordings in ../shared/data/glove, which are not part of the repository";
    sensor_ = read_csv(folder() / "sensor_log.csv", {GetParam().sensor});
    camera_ = read_csv(folder() / "camera_angles.csv", {GetParam().angle});
  }

  static std::filesystem::path folder() {
    return std::filesystem::path(FLEXOR_SOURCE_DIR) / "../shared/data/glove" / GetParam().folder;
  }

  Series sensed() const { return sensor_.series(GetParam().sensor); }
  Series seen() const { return camera_.series(GetParam().angle); }

  // From and to these times of its own clock.
  static Series between(const Series& s, double from_s, double to_s) {
    const auto from = static_cast<std::size_t>(std::ranges::lower_bound(s.t_s, from_s) - s.t_s.begin());
    const auto to = static_cast<std::size_t>(std::ranges::upper_bound(s.t_s, to_s) - s.t_s.begin());
    return {s.t_s.subspan(from, to - from), s.value.subspan(from, to - from)};
  }

  Recording sensor_;
  Recording camera_;
};

constexpr double kTolerance_s = 0.15;

TEST_P(RealRecordings, OffsetIsThatOfTheIndependentRealignment) {
  const Alignment a = align(sensed(), seen());
  EXPECT_NEAR(a.clock_offset_s, GetParam().offset_s, kTolerance_s);
  EXPECT_FALSE(a.tapped);
}

TEST_P(RealRecordings, CuttingThirtySecondsOffEitherEndChangesLittle) {
  for (const double begin_s : {0, 30}) {
    const auto cut = [&](const Series& s) {
      return between(s, s.t_s.front() + begin_s, s.t_s.back() - 30 + begin_s);
    };
    EXPECT_NEAR(align(cut(sensed()), seen()).clock_offset_s, GetParam().offset_s, kTolerance_s);
    EXPECT_NEAR(align(sensed(), cut(seen())).clock_offset_s, GetParam().offset_s, kTolerance_s);
  }
}

// The motion repeats itself every 30 s, and the longer overlap is a whole cycle wrong.
TEST_P(RealRecordings, AnOverlapOfHalfPassesNoWrongCycleOffUnwarned) {
  const double truth = GetParam().offset_s;
  const double first = std::max(sensed().t_s.front(), seen().t_s.front() - truth);
  const double last = std::min(sensed().t_s.back(), seen().t_s.back() - truth);
  for (const double length : {60.0, 70.0, 90.0, 110.0}) {
    for (double begin = first; begin + 1.5 * length < last; begin += 7) {
      const double later = begin + length / 2 + truth;
      const Alignment a =
          align(between(sensed(), begin, begin + length), between(seen(), later, later + length));
      EXPECT_TRUE(std::abs(a.clock_offset_s - truth) < 1 || !a.warnings.empty())
          << length << " s from " << begin << ": off by " << a.clock_offset_s - truth << " s, confidence "
          << a.confidence;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Glove, RealRecordings,
                         testing::Values(RealCase{"index_ind2", "SensorA1", "∠ABC_smooth", -2.501},
                                         RealCase{"index_ind2", "SensorA1", "∠BCD_smooth", -2.501},
                                         RealCase{"middle_mid1", "SensorA2", "∠ABC_smooth", -12.04},
                                         RealCase{"middle_mid1", "SensorA2", "∠BCD_smooth", -12.04}));

// From rest: three bends `apart_s` from one another from 4 s on, then the same slow move again and again.
double tapped_motion(double t, double apart_s) {
  const double in_bend = (t - 4) / apart_s;
  if (in_bend >= 0 && in_bend < 3) return 30 + 50 * std::pow(std::sin(M_PI * in_bend), 2);
  return t < 4 + 3 * apart_s + 3 ? 30 : 60 - 30 * std::cos(2 * M_PI * (t - 4 - 3 * apart_s - 3) / 6);
}

Signal saw(const std::function<double(double)>& angle, double from_s, double to_s, double rate_hz,
           double offset_s, unsigned seed, double gain = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 0.5);
  Signal out;
  for (double t = from_s; t < to_s; t += 1 / rate_hz) {
    out.t_s.push_back(t + offset_s);
    out.value.push_back(gain * (angle(t) + noise(random)));
  }
  return out;
}

TEST(Taps, AreFoundWhereTheyAreWhicheverWayTheSensorReads) {
  for (const double apart_s : {0.4, 0.8, 1.3}) {
    for (const double gain : {1.0, -4.0}) {
      const auto found =
          taps(saw([&](double t) { return tapped_motion(t, apart_s); }, 0, 60, 30, 100, 1, gain));
      ASSERT_TRUE(found) << apart_s << ' ' << gain;
      for (int k = 0; k < 3; ++k)
        EXPECT_NEAR((*found)[static_cast<std::size_t>(k)], 104 + (k + 0.5) * apart_s, 0.1)
            << apart_s << ' ' << gain;
    }
  }
}

TEST(Taps, AreNotFoundWhereNobodyTapped) {
  const auto found = [](const std::function<double(double)>& angle) {
    return taps(saw(angle, 0, 60, 30, 0, 2)).has_value();
  };
  EXPECT_FALSE(found([](double t) { return 60 - 30 * std::cos(2 * M_PI * t / 6); }));
  EXPECT_FALSE(found([](double t) { return 60 - 30 * std::cos(2 * M_PI * t); })) << "quick all the time";
  EXPECT_FALSE(found([](double) { return 30.0; }));
  EXPECT_FALSE(found([](double t) { return tapped_motion(t < 30 ? t : t - 30, 0.5); })) << "tapped twice";
  EXPECT_FALSE(found([](double t) {
    return t < 4 ? 30 + 12 * std::sin(3 * (t - 4)) : tapped_motion(t, 0.5);
  })) << "no rest before";
}

// A script that repeats every six seconds: the signals alone cannot tell which repetition is which.
TEST(Taps, TellWhichRepetitionIsWhich) {
  int right = 0;
  int right_without = 0;
  constexpr int kPairs = 20;
  for (unsigned seed = 0; seed < kPairs; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> cut(0, 2);
    const double offset_s = std::uniform_real_distribution<double>(-20, 20)(random);
    const auto angle = [](double t) { return tapped_motion(t, 0.6); };
    const auto untapped = [](double t) { return tapped_motion(t < 5.8 ? 0 : t, 0.6); };
    const double begin = cut(random);
    // The reference ends early, so that a wrong repetition has as much overlap.
    const Alignment tapped =
        align(saw(angle, begin, 70, 20, 0, seed, 3), saw(angle, 0, 60, 30, offset_s, seed + 100));
    EXPECT_TRUE(tapped.tapped) << seed;
    right += std::abs(tapped.clock_offset_s - offset_s) < 0.05 && tapped.confidence > 0.5;
    const Alignment plain =
        align(saw(untapped, begin + 12, 70, 20, 0, seed, 3), saw(untapped, 12, 60, 30, offset_s, seed + 100));
    EXPECT_FALSE(plain.tapped) << seed;
    right_without += std::abs(plain.clock_offset_s - offset_s) < 0.05 && plain.confidence > 0.5;
  }
  EXPECT_EQ(right, kPairs);
  EXPECT_EQ(right_without, 0);
}

}  // namespace
}  // namespace flexor::recording
