#include "runtime/sensor/tracker.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace flexor::sensor {
namespace {

using Real = RealTracking<double>;

// A sensor that reads 30 to 113 as the model knows it, 40 to 123 where it has moved by 10; N 1.3, 2 a second.
constexpr double kMiddle = 71.5;
constexpr double kHalf = 41.5;
constexpr TrackerSettings<FixedTracking> kFixed = {37 * 256, 1669, 1100};
constexpr TrackerSettings<Real> kReal = {37, 6.52, 1100.0 / (65536 * 256.0) * 256};
constexpr TrackedSensor<FixedTracking> kFixedSensor = {2288, 1328, 42, 6, 1579};
constexpr TrackedSensor<Real> kRealSensor = {kMiddle, kHalf, 1.3, 0.2, 1 / kHalf};

std::int16_t to_q5(double reading) {
  return static_cast<std::int16_t>(std::lround(32 * std::clamp(reading, -1023.0, 1023.0)));
}

// Where a finger is, 0 open to 1 closed, tick by tick.
using Bends = std::vector<double>;

void go(Bends& bends, double to, int ticks, int hold) {
  const double from = bends.empty() ? 0 : bends.back();
  for (int k = 1; k <= ticks; ++k) bends.push_back(from + (to - from) * k / ticks);
  for (int k = 0; k < hold; ++k) bends.push_back(to);
}

Bends cycles(int count, double open, double closed) {
  Bends out;
  go(out, open, 1, 10);
  for (int n = 0; n < count; ++n) {
    go(out, closed, 10, 25);
    go(out, open, 10, 35);
  }
  return out;
}

// A sensor that no longer reads what the model's did.
struct Worn {
  double offset = 0;
  double gain = 1;
  double drift_per_min = 0;
  double noise = 0;
  std::mt19937 random{1};

  double read(double share, std::size_t tick) {
    const double model = kMiddle + kHalf * (2 * share - 1);
    return kMiddle + gain * (model - kMiddle) + offset + drift_per_min * static_cast<double>(tick) / 600 +
           noise * std::normal_distribution<>()(random);
  }
};

struct Followed {
  Tracker<FixedTracking> fixed;
  Tracker<Real> real;
  std::size_t tick = 0;
  double worst =
      0;  // |corrected - what the model's sensor would read|, without noise, since it was last cleared

  Followed() {
    fixed.reset(kFixed);
    real.reset(kReal);
  }
  void wear(Worn& worn, const Bends& bends) {
    for (const double share : bends) {
      const double x = worn.read(share, tick++);
      fixed.observe(kFixed, kFixedSensor, to_q5(x));
      real.observe(kReal, kRealSensor, x);
      const double off = fixed.corrected(kFixedSensor, to_q5(x)) / 32.0 - (kMiddle + kHalf * (2 * share - 1));
      worst = std::max(worst, std::abs(off) - 4 * worn.noise);
    }
  }
};

TEST(Tracker, FindsOffsetAndGainOfAnotherDonningFromWholeBends) {
  for (const double offset : {-16.0, -8.0, 0.0, 8.0, 16.0}) {
    for (const double gain : {0.88, 1.0, 1.12}) {
      Worn worn{offset, gain};
      Followed f;
      f.wear(worn, cycles(25, 0, 1));
      f.worst = 0;
      f.wear(worn, cycles(3, 0, 1));
      EXPECT_LT(f.worst, gain == 0.88 ? 2.0 : 0.8) << offset << " " << gain;
      EXPECT_FALSE(f.fixed.alarm());
    }
  }
}

TEST(Tracker, LeavesAGloveThatIsAsItWas) {
  Worn worn;
  worn.noise = 1;
  Followed f;
  f.wear(worn, cycles(100, 0, 1));
  EXPECT_LT(f.worst, 1.5);
}

// A hand's own bends lie off by as much from one minute to the next.
TEST(Tracker, LeavesWhatIsNoMoreThanAHandsOwnBends) {
  Worn worn{1.0};
  worn.noise = 0.3;
  Followed f;
  f.wear(worn, cycles(100, 0, 1));
  EXPECT_EQ(f.fixed.shift(), 0);
  EXPECT_EQ(f.fixed.stretch(), 0);
  Worn more{2.6, 1};
  f.wear(more, cycles(20, 0, 1));
  EXPECT_NEAR(f.fixed.shift() / 32.0, -2.6, 0.5);
}

// It turns before the level has come up to it.
TEST(Tracker, QuickBendsThatDoNotRestStretchNothing) {
  for (const int ticks : {8, 12, 16, 20, 30}) {
    Worn worn;
    Bends bends;
    for (int k = 0; k < 100 * ticks; ++k)
      bends.push_back(0.5 - 0.5 * std::cos(2 * std::numbers::pi * k / ticks));
    Followed f;
    f.wear(worn, bends);
    EXPECT_EQ(f.fixed.stretch(), 0) << ticks;
    EXPECT_EQ(f.fixed.shift(), 0) << ticks;
  }
}

// A fist that closes less tightly than it did moves the middle of a bend, and no sensor; for ever, it is taken for a gain.
TEST(Tracker, HalfBendsAndFistsThatAreLessTightChangeNothing) {
  for (const double closed : {0.4, 0.5, 0.7, 0.9, 0.95, 0.97}) {
    const bool half = closed < 0.8;
    Worn worn;
    worn.noise = half ? 0.5 : 0.3;
    Followed f;
    f.wear(worn, half ? cycles(50, 0.1, closed) : cycles(4, 0, closed));
    EXPECT_EQ(f.fixed.shift(), 0) << closed;
    if (!half) continue;
    EXPECT_EQ(f.fixed.stretch(), 0);
    EXPECT_EQ(f.fixed.shift_variance(), kFixed.shift) << "nor does it become surer";
  }
}

TEST(Tracker, AFingerThatRestsTenMinutesForgetsNothing) {
  for (const double at : {0.0, 0.3, 1.0}) {
    Worn worn{10, 1.06};
    Followed f;
    f.wear(worn, cycles(20, 0, 1));
    const auto shift = f.fixed.shift();
    const auto stretch = f.fixed.stretch();
    f.wear(worn, Bends(6000, at));
    EXPECT_EQ(f.fixed.shift(), shift);
    EXPECT_EQ(f.fixed.stretch(), stretch);
    f.worst = 0;
    f.wear(worn, cycles(3, 0, 1));
    EXPECT_LT(f.worst, 0.8) << at;
  }
}

TEST(Tracker, FollowsTenDegreesAMinuteForTenMinutesEitherWay) {
  for (const double drift : {-10.0, 10.0}) {
    Worn worn;
    worn.drift_per_min = drift;
    worn.noise = 0.5;
    Followed f;
    f.wear(worn, cycles(75, 0, 1));
    EXPECT_NEAR(f.fixed.shift() / 32.0, -drift * 10, 4);
    EXPECT_LT(f.worst, 4.5);
    EXPECT_FALSE(f.fixed.alarm());
  }
}

TEST(Tracker, ReportsASensorThatDriftsMoreQuicklyThanItIsFollowed) {
  Worn worn;
  Followed f;
  f.wear(worn, cycles(20, 0, 1));
  EXPECT_FALSE(f.fixed.alarm());
  worn.drift_per_min = 90;
  f.wear(worn, cycles(5, 0, 1));
  EXPECT_TRUE(f.fixed.alarm());
}

TEST(Tracker, ASingleSpikeMovesNothing) {
  Worn worn;
  Followed f;
  f.wear(worn, cycles(10, 0, 1));
  const auto shift = f.fixed.shift();
  for (const double spike : {-0.5, 1.5}) {
    Bends bends = cycles(2, 0, 1);
    bends.insert(bends.begin() + (spike > 0 ? 30 : 60), 2, spike);
    f.wear(worn, bends);
    EXPECT_NEAR(f.fixed.shift(), shift, 16) << spike;
  }
}

TEST(Tracker, ASensorThatFallsWithTheBendIsTheSame) {
  Worn worn{9};
  Followed up;
  Followed down;
  up.wear(worn, cycles(20, 0, 1));
  Bends bends = cycles(20, 0, 1);
  for (double& share : bends) share = 1 - share;
  down.wear(worn, bends);
  EXPECT_NEAR(up.fixed.shift() / 32.0, -9, 0.3);
  EXPECT_NEAR(down.fixed.shift(), up.fixed.shift(), 8);
}

TEST(Tracker, FixedPointAndFloatFindTheSame) {
  std::mt19937 random(3);
  std::uniform_real_distribution<> share(0, 1);
  for (int n = 0; n < 20; ++n) {
    Worn worn{20 * share(random) - 10, 0.9 + 0.2 * share(random), 4 * share(random) - 2};
    Followed f;
    f.wear(worn, cycles(30, 0, 1));
    // What lies at the edge of the band may be taken by one alone.
    if (f.fixed.shift() != 0 || std::abs(f.real.shift()) > 2.25) {
      EXPECT_NEAR(f.fixed.shift() / 32.0, f.real.shift(), 0.3) << n;
    }
    if (f.fixed.stretch() != 0 || std::abs(f.real.stretch()) > 0.045) {
      EXPECT_NEAR(f.fixed.stretch() / 16384.0, f.real.stretch(), 0.005) << n;
    }
  }
}

TEST(Tracker, IsSmall) { EXPECT_LE(sizeof(Tracker<FixedTracking>), 24U); }

RC_GTEST_PROP(Tracker, NeverJumpsAndNeverLeavesItsBoundsWhateverIsRead, ()) {
  const auto half = *rc::gen::inRange<std::int16_t>(33, 16384);
  const TrackedSensor<FixedTracking> sensor = {
      *rc::gen::arbitrary<std::int16_t>(), half, *rc::gen::inRange<std::int16_t>(1, 512),
      *rc::gen::inRange<std::int16_t>(1, 32767), static_cast<std::uint16_t>(std::lround(2097152.0 / half))};
  const TrackerSettings<FixedTracking> settings = {*rc::gen::inRange<std::uint16_t>(0, 64000),
                                                   *rc::gen::inRange<std::uint16_t>(0, 64000),
                                                   *rc::gen::arbitrary<std::uint16_t>()};
  Tracker<FixedTracking> tracker;
  tracker.reset(settings);
  for (int k = 0; k < 400; ++k) {
    const auto x =
        *rc::gen::weightedOneOf<std::int16_t>({{1, rc::gen::arbitrary<std::int16_t>()},
                                               {3, rc::gen::element<std::int16_t>(-32768, 32767, 0, 4000)}});
    const int shift = tracker.shift();
    const int stretch = tracker.stretch();
    tracker.observe(settings, sensor, x);
    RC_ASSERT(std::abs(tracker.shift() - shift) <= sensor.max_step);
    RC_ASSERT(std::abs(tracker.stretch() - stretch) <= FixedTracking::kStretchStep);
    RC_ASSERT(std::abs(tracker.stretch()) <= FixedTracking::kMostStretch);
    RC_ASSERT(tracker.shift_variance() <= 64000);
    tracker.corrected(sensor, x);
  }
}

RC_GTEST_PROP(Tracker, GoesTheWayTheSensorWentAndNoFarther, ()) {
  const double offset = *rc::gen::inRange(-15, 16);
  Worn worn{offset};
  Followed f;
  const Bends bend = cycles(1, 0, 1);
  for (int n = 0; n < 12; ++n) {
    const double before = f.fixed.shift() / 32.0;
    f.wear(worn, bend);
    const double after = f.fixed.shift() / 32.0;
    if (offset > 0) RC_ASSERT(after <= before + 0.1);
    if (offset < 0) RC_ASSERT(after >= before - 0.1);
    RC_ASSERT(std::abs(after) <= std::abs(offset) + 0.3);
  }
}

}  // namespace
}  // namespace flexor::sensor
