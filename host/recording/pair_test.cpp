#include "host/recording/pair.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/io/refusal_test.hpp"
#include "host/recording/unit.hpp"

namespace flexor::recording {
namespace {

// Two minutes of uneven motion: counts, and an angle on a clock 3 s ahead.
Pair simulated(double glove_step_s = 0.05) {
  Pair pair{{"glove.csv", {}, {{"flex_adc", {}, "count"}}, {}, ""},
            "flex_adc",
            {"camera.csv", {}, {{"index_deg", {}, "deg"}}, {}, ""},
            "index_deg"};
  const auto angle = [](double t) { return 45 + 25 * std::sin(t) + 15 * std::sin(0.37 * t * t / 20); };
  for (double t = 0; t < 120; t += glove_step_s) {
    pair.sensor.t_s.push_back(t);
    pair.sensor.columns[0].value.push_back(std::round(300 + 4 * angle(t)));
  }
  for (double t = 0; t < 120; t += 0.04) {
    pair.reference.t_s.push_back(t + 3);
    pair.reference.columns[0].value.push_back(angle(t));
  }
  return pair;
}

// Written, read and written again, as often as somebody likes.
TEST(Pair, AColumnIsConvertedOnceAndSaysDegreesOnce) {
  for (const std::string name :
       {"index_deg", "angle (deg)", "Angle[Degrees]", "angle_degrees", "angle \u00b0", "angle_DEG",
        "\u2220ABC_smooth", "angle_rad", "Angle(rad)", "angle [radians]", "angle_radians"}) {
    const std::string written = unit_of(name) == "deg" ? name : without_unit(name) + "_deg";
    Pair pair = simulated();
    const std::vector<double> angle_deg = to_recording(align_pair(pair, 20, 3.0), pair).columns[1].value;
    pair.output = pair.reference.columns[0].name = name;
    pair.reference.columns[0].unit = unit_of(name);
    if (unit_of(name) == "rad")
      for (double& value : pair.reference.columns[0].value) value *= std::numbers::pi / 180;
    for (int again = 0; again < 3; ++again) {
      to_degrees(pair.reference, pair.output, "");
      const Recording read =
          parse_csv(to_csv(to_recording(align_pair(pair, 20, 3.0), pair)), "aligned.csv", {});
      pair.output = pair.reference.columns[0].name = read.columns[1].name;
      pair.reference.columns[0].unit = read.columns[1].unit;
      EXPECT_EQ(pair.output, written) << name;
      for (std::size_t k = 0; k < angle_deg.size(); ++k)
        ASSERT_NEAR(read.columns[1].value[k], angle_deg[k], 1e-9) << name;
    }
  }
}

TEST(Pair, OneConverterReadsAllCountsOfALog) {
  Pair pair = simulated();
  pair.sensor.columns.push_back({"thumb_adc", std::vector<double>(pair.sensor.t_s.size(), 3000), "count"});
  EXPECT_EQ(align_pair(pair, 20, 3.0).valid.max, 4094);
}

TEST(Pair, AConvertersEndIsAReadingWhereOrdinaryStepsLeadToIt) {
  std::vector<double> scaled, loose;  // by the glove itself; a contact
  for (int k = 0; k < 400; ++k) {
    scaled.push_back(std::clamp(std::round(512 + 600 * std::sin(k / 10.0)), 0.0, 1023.0));
    loose.push_back(k % 40 == 7 ? 1023 * (k % 80 / 40) : std::round(512 + 300 * std::sin(k / 10.0)));
  }
  for (const auto& [readings, least] : {std::pair(scaled, 0), {loose, 1}}) {
    EXPECT_EQ(counts_that_tell(readings, 1023).min, least);
    EXPECT_EQ(counts_that_tell(readings, 1023).max, 1023 - least);
  }
}

TEST(Pair, DatesInBothFilesAreOneClockWhereTheSignalsDoNotContradict) {
  constexpr double kDate_s = 1.7e9;
  for (const double apart_s : {0.0, 0.1, 0.3}) {
    Pair pair = simulated();
    for (double& t : pair.sensor.t_s) t += kDate_s;
    for (double& t : pair.reference.t_s) t += kDate_s - 3 + apart_s;
    const double found_s = align_pair(pair, 20, {}).clock_offset_s;
    EXPECT_EQ(found_s == 0, apart_s == 0);
    EXPECT_NEAR(found_s, apart_s, 0.05);
  }
}

TEST(Pair, AnAngleInAUnitThatNobodyKnowsIsRefusedByName) {
  const auto refusal = [](const char* name) {
    Recording r{"c.csv", {0, 1}, {{name, {0, 1}, ""}}, {}, ""};
    return io::refusal_of([&] { to_degrees(r, name, ""); });
  };
  for (const char* name : {"angle_grad", "angle (grad)", "angle_mrad", "angle [gon]", "angle (%)",
                           "angle_percent", "angle turn", "qx", "quat_w"})
    EXPECT_NE(refusal(name).find("deg or rad"), std::string::npos) << name;
  for (const char* name : {"angle", "index_deg", "angle (deg)", "SensorA1", "turn_deg", "grad"})
    EXPECT_EQ(refusal(name), "accepted") << name;
  EXPECT_NE(refusal("Winkel_Grad").find("rename the column to end in _deg"), std::string::npos);
}

TEST(Pair, AUnitIsTakenFromWhoStatesIt) {
  Recording r{"c.csv", {0, 1}, {{"Winkel_Grad", {0, 90}, ""}}, {}, ""};
  to_degrees(r, "Winkel_Grad", "deg");
  EXPECT_EQ(r.columns[0].value.back(), 90);
  Recording named{"c.csv", {0, 1}, {{"angle", {0, 3.14159265358979}, ""}}, {}, ""};
  to_degrees(named, "angle", "rad");
  EXPECT_NEAR(named.columns[0].value.back(), 180, 1e-9);
}

TEST(Pair, AnAngleThatWrapsGoesOn) {
  const std::vector<double> about_zero = simulated().reference.columns[0].value;
  for (const double seam_deg : {180, 360}) {
    Recording r = simulated().reference;
    for (double& v : r.columns[0].value) {
      v += seam_deg - 30;
      if (v > seam_deg) v -= 360;
    }
    to_degrees(r, "index_deg", "");
    for (std::size_t k = 0; k < about_zero.size(); ++k)
      ASSERT_NEAR(r.columns[0].value[k], about_zero[k] - 30 + (seam_deg == 180 ? 180 : 0), 1e-9) << seam_deg;
    EXPECT_NE(r.warnings.at(0).find("jumps by a turn"), std::string::npos);
  }
  Recording wide{"c.csv", {0, 1, 2}, {{"turn_deg", {-170, 40, 185}, "deg"}}, {}, ""};
  to_degrees(wide, "turn_deg", "");
  EXPECT_TRUE(wide.warnings.empty()) << "wide, and no jump";
}

TEST(Pair, WhatIsHeldOutDecidesNeitherWhatAPauseIsNorWhatAReadingIs) {
  const Pair slow = simulated(0.5);
  Pair pair = slow;
  const Pair fast = simulated(0.05);
  for (std::vector<double>* v : {&pair.sensor.t_s, &pair.sensor.columns[0].value}) v->resize(160);  // 80 s
  for (std::size_t i = 1600; fast.sensor.t_s[i] < slow.sensor.t_s.back() + 0.01; ++i) {
    pair.sensor.t_s.push_back(fast.sensor.t_s[i]);
    pair.sensor.columns[0].value.push_back(3000);  // an ADC of twelve bits, all of a sudden
  }
  Aligned before;
  sample_pair(slow, 20, 3.0, 0, 0.5, before);
  Aligned after;
  sample_pair(pair, 20, 3.0, 0, 0.5, after);
  EXPECT_EQ(after.max_gap_s, 2.5);
  EXPECT_EQ(after.max_gap_s, before.max_gap_s);
  EXPECT_EQ(after.valid.max, 1022);
  ASSERT_EQ(after.holdout_begin, before.holdout_begin);
  for (std::size_t k = 0; k < before.holdout_begin; ++k) {
    ASSERT_EQ(after.gap[k], before.gap[k]) << k;
    ASSERT_EQ(after.input[k], before.input[k]) << k;
  }
}

TEST(Pair, RowsThatATrackerLostAreLeftOut) {
  Recording r{
      "c.csv", {0, 1, 2, 3}, {{"a_deg", {1, 2, 3, 4}, "deg"}, {"a_quality", {0, 3, 1, 3}, ""}}, {}, ""};
  leave_out_lost(r, "a_deg");
  EXPECT_EQ(r.t_s, (std::vector<double>{0, 2}));
  ASSERT_EQ(r.columns.size(), 1u);
  EXPECT_EQ(r.columns[0].value, (std::vector<double>{1, 3}));
  EXPECT_EQ(r.warnings.size(), 1u);
  r = {"a.csv", {0, 1, 2, 3}, {{"a_deg", {1, 2, 3, 4}, "deg"}, {"a_status", {0, 1, 4, 0}, ""}}, {}, ""};
  leave_out_lost(r, "a_deg");
  EXPECT_EQ(r.t_s, (std::vector<double>{0, 3}));
  EXPECT_EQ(r.warnings.at(0), "a.csv: 2 of 4 rows of a_deg are held by the model and left out");
  Recording lost{"c.csv", {0, 1}, {{"a_deg", {1, 2}, "deg"}, {"a_quality", {3, 3}, ""}}, {}, ""};
  EXPECT_THROW(leave_out_lost(lost, "a_deg"), io::JobError);
}

TEST(Pair, AnAngleOfZeroWhereTheMarksAreLostIsLeftOutAndAFingerAtRestIsNot) {
  Pair pair = simulated();
  std::vector<double>& angle = pair.reference.columns[0].value;
  for (std::size_t k = 750; k < 1000; ++k) angle[k] = 0;
  for (std::size_t k = 2000; k < 2250; ++k)
    angle[k] = 85;  // as does the finger, before both begin to move again
  for (std::size_t k = 1600; k < 1800; ++k) pair.sensor.columns[0].value[k] = 640;
  std::vector<std::string> warnings;
  EXPECT_TRUE(leave_out_frozen(pair.reference, "index_deg", pair.sensor.series("flex_adc"), 3, warnings));
  EXPECT_EQ(pair.reference.t_s.size(), 3000U - 250U);
  EXPECT_GT(*std::ranges::min_element(angle), 0);
  EXPECT_EQ(warnings.size(), 1U);
}

TEST(Pair, ReadingsThatTheFittedPartsDidNotReachAreCounted) {
  const std::vector<double> low = {1, 2, 3};
  const std::vector<double> high = {7, 8, 9};
  const std::vector<double> held = {2, 5, 8, 12};
  EXPECT_NE(beyond_fitted({{low, held}})->find("75 %"), std::string::npos);
  EXPECT_NE(beyond_fitted({{low, held}, {high, held}})->find("25 %"), std::string::npos) << "of all together";
  EXPECT_FALSE(beyond_fitted({{low, low}, {high, high}}));
}

}  // namespace
}  // namespace flexor::recording
