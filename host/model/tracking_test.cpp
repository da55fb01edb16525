#include "host/model/tracking.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "host/model/sensor_model_test.hpp"

namespace flexor::model {
namespace {

constexpr double kRate_hz = 50;

// Whole bends of four seconds each, shifted by what the sensor has moved.
double bend(double t_s, double shift) {
  const double phase = std::fmod(t_s, 8);
  const double closed = phase < 1 ? phase : phase < 4 ? 1 : phase < 5 ? 5 - phase : 0;
  return 300 + 400 * closed + shift;
}

TEST(Trackers, KnowTheirRangesFromPosesAndLimits) {
  const auto ranges = tracked_ranges(sensor_model(Poses{300, 700}));
  ASSERT_TRUE(ranges[0].has_value());
  EXPECT_EQ(ranges[0]->range_deg, 85);
  EXPECT_FALSE(tracked_ranges(sensor_model({}))[0].has_value());
  EXPECT_FALSE(tracked_ranges(sensor_model(Poses{300, 301}))[0].has_value())
      << "too near to each other for Q5";
  EXPECT_FALSE(Trackers<FixedArithmetic>(sensor_model({}), {}).any());
}

TEST(Trackers, KnowWhereWholeBendsTurnFromTheRecordingThatTheModelWasMadeWith) {
  std::vector<double> readings;
  for (int k = 0; k < 80 * kRate_hz; ++k) readings.push_back(bend(k / kRate_hz, 0));
  // Poses are medians of the outer tenths: nearer to each other.
  const auto turns = turns_of({readings}, 1 / kRate_hz, {330, 670});
  ASSERT_TRUE(turns.has_value());
  EXPECT_NEAR(turns->open, 300, 3);
  EXPECT_NEAR(turns->fist, 700, 3);
  const auto falling = turns_of({readings}, 1 / kRate_hz, {670, 330});
  EXPECT_NEAR(falling->open, 700, 3);
  EXPECT_FALSE(turns_of({{readings.begin(), readings.begin() + 400}}, 1 / kRate_hz, {330, 670}).has_value())
      << "one bend is none to go by";
  Model m = sensor_model(Poses{330, 670});
  m.inputs[0].turns = turns;
  EXPECT_EQ(from_json(to_json(m), "m"), m);
  EXPECT_EQ(tracked_ranges(m)[0]->poses, *turns);
}

template <class Arithmetic>
Followed followed_after(double shift, Poses poses, double seconds = 120) {
  Trackers<Arithmetic> trackers(sensor_model(poses), {});
  for (int k = 0; k < seconds * kRate_hz; ++k) {
    const double reading = bend(k / kRate_hz, shift);
    trackers.step({&reading, 1}, false);
  }
  return trackers.followed().front();
}

TEST(Trackers, ReportDegreesOfTheJointWhicheverWayTheSensorReads) {
  constexpr double kDegPerUnit = 85.0 / 400;
  for (const double shift : {-50.0, 30.0}) {
    const Followed rising = followed_after<FixedArithmetic>(shift, {300, 700});
    EXPECT_NEAR(rising.shift_deg, -shift * kDegPerUnit, 0.4);
    EXPECT_NEAR(rising.stretch, 0, 0.01);
    EXPECT_LT(rising.standard_error_deg, 1.5);
    EXPECT_FALSE(rising.alarmed);
    EXPECT_NEAR(followed_after<FixedArithmetic>(shift, {700, 300}).shift_deg, shift * kDegPerUnit, 0.4);
    EXPECT_NEAR(followed_after<DoubleArithmetic>(shift, {300, 700}).shift_deg, rising.shift_deg, 0.2);
    EXPECT_NEAR(followed_after<FloatArithmetic>(shift, {300, 700}).shift_deg, rising.shift_deg, 0.2);
  }
}

TEST(Trackers, LearnNothingFromFaultsAndPauses) {
  for (const double fault : {1023.0, 0.0, std::nan("")}) {
    Trackers<FixedArithmetic> trackers(sensor_model(Poses{300, 700}), {});
    for (int k = 0; k < 6000; ++k) {
      const double reading = k / 100 % 2 == 0 ? 500 : fault;
      const auto corrected = trackers.step({&reading, 1}, false);
      if (std::isfinite(fault)) {
        EXPECT_NEAR(corrected[0], reading, 0.02);
      }
    }
    EXPECT_EQ(trackers.followed()[0].shift_deg, 0) << fault;
  }
  Trackers<FixedArithmetic> trackers(sensor_model(Poses{300, 700}), {});
  for (int k = 0; k < 6000; ++k) {
    const double reading = bend(k / kRate_hz, 40);
    trackers.step({&reading, 1}, true);
  }
  EXPECT_EQ(trackers.followed()[0].shift_deg, 0);
}

}  // namespace
}  // namespace flexor::model
