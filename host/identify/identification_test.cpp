#include "host/identify/identification.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <ostream>
#include <random>

#include "host/identify/estimator.hpp"
#include "host/io/io.hpp"

namespace flexor::identify {
namespace {

struct Log {
  double rate_hz;
  double noise;  // counts
  bool pauses;
  bool bursts;  // three readings in ten milliseconds
  friend std::ostream& operator<<(std::ostream& out, const Log& l) {
    return out << l.rate_hz << " Hz" << (l.pauses ? ", pauses" : "") << (l.bursts ? ", bursts" : "");
  }
};

// A finger that moves smoothly between random angles, seen by a lagging, curved sensor and by a camera with a
// clock that runs 3.7 s ahead.
recording::Pair simulated(const Log& log, double seconds = 120) {
  std::mt19937 random(7);
  const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
  recording::Pair pair{{"glove.csv", {}, {{"index_adc", {}, "count"}}, {}, ""},
                       "index_adc",
                       {"camera.csv", {}, {{"index_deg", {}, "deg"}}, {}, ""},
                       "index_deg"};
  constexpr double kStep_s = 0.002;
  std::normal_distribution<double> noise;
  double from = 20;
  double to = 60;
  double begin_s = 0;
  double move_s = 1;
  double felt = from;
  double next_reading_s = 0;
  double next_frame_s = 0;
  for (double t = 0; t < seconds; t += kStep_s) {
    if (t > begin_s + move_s) {
      from = to;
      to = 5 + 80 * uniform();
      begin_s = t + 0.4 * uniform();
      move_s = 0.5 + 1.5 * uniform();
    }
    const double s = std::clamp((t - begin_s) / move_s, 0.0, 1.0);
    const double angle = from + (to - from) * s * s * (3 - 2 * s);
    felt += (angle - felt) * kStep_s / 0.08;
    if (t >= next_reading_s) {
      for (int i = 0; i < (log.bursts ? 3 : 1); ++i) {
        pair.sensor.t_s.push_back(100 + std::round((t + 0.005 * i) * 1000) / 1000);
        pair.sensor.columns[0].value.push_back(
            std::round(200 + 500 * std::pow(std::max(felt, 0.0) / 90, 1.3) + log.noise * noise(random)));
      }
      const bool pause = log.pauses && uniform() < 0.1 / log.rate_hz;  // every ten seconds
      next_reading_s = t + 1 / log.rate_hz + (pause ? 0.5 + 3 * uniform() : 0) - 1e-9;
      if (log.pauses && t > 50 && t < 50.6) next_reading_s = t + 14;  // longer than the grid goes on
    }
    if (t >= next_frame_s) {
      pair.reference.t_s.push_back(103.7 + t);
      pair.reference.columns[0].value.push_back(angle + 0.2 * noise(random));
      next_frame_s += 1 / 30.0;
    }
  }
  return pair;
}

Request with_structure(const char* structure) {
  Request r;
  r.structure = structure;
  return r;
}

// Of the fitted part: what is held out must not reach the model.
TEST(IdentifyPoses, AModelOfOneJointKnowsItsOpenHandAndItsFist) {
  const recording::Pair pair = simulated({50, 1, false, false});
  for (const char* structure : {"line", "hw"}) {
    const Identification r = identify(pair, with_structure(structure), {});
    const auto poses = r.model.inputs.front().poses;
    ASSERT_TRUE(poses) << structure;
    // 5 to 15 degrees and 75 to 85 of the sensor's curve, about.
    EXPECT_GT(poses->open, 200) << structure;
    EXPECT_LT(poses->open, 270) << structure;
    EXPECT_GT(poses->fist, 550) << structure;
    EXPECT_LT(poses->fist, 690) << structure;
    EXPECT_EQ(model::from_json(model::to_json(r.model), "m").inputs.front().poses->open, poses->open);
  }
}

class AppliedIsScored : public testing::TestWithParam<Log> {};

TEST_P(AppliedIsScored, ReadingByReadingTheAnglesAreThoseThatWereScored) {
  const recording::Pair pair = simulated(GetParam());
  for (const char* structure : {"hw", "hw-hysteresis"}) {
    const Identification r = identify(pair, with_structure(structure), {});
    Estimator<model::DoubleArithmetic> estimator(model::from_json(model::to_json(r.model), "m"));
    std::size_t k = 0;
    std::size_t pauses = 0;
    for (std::size_t i = 0; i < pair.sensor.t_s.size(); ++i) {
      const double reading = pair.sensor.columns[0].value[i];
      estimator.push(pair.sensor.t_s[i], {&reading, 1}, [&](const Estimate& e) {
        if (k < r.aligned.size()) {
          ASSERT_EQ(e.t_s, r.aligned.t_s[k]);
          ASSERT_EQ(e.angle_deg[0], r.estimated_deg[k]) << structure << " sample " << k;
          pauses += e.status[0] == kPause;
        }
        ++k;
      });
    }
    EXPECT_GE(k, r.aligned.size());
    EXPECT_EQ(pauses > 0, GetParam().pauses);
    EXPECT_LT(r.holdout_without_gaps->rmse_deg, r.baseline.rmse_deg);
  }
}

INSTANTIATE_TEST_SUITE_P(Logs, AppliedIsScored,
                         testing::Values(Log{2, 0, false, false}, Log{2, 0, true, false},
                                         Log{20, 2, false, false}, Log{20, 2, true, false},
                                         Log{100, 20, false, false}, Log{100, 20, true, false},
                                         Log{9, 2, true, true}));

TEST(Identification, TheHeldOutPartMovesNeitherModelNorRangeOfReadings) {
  const recording::Pair pair = simulated({20, 2, false, false});
  Request request = with_structure("hw");
  request.clock_offset_s = 3.7;
  const Identification before = identify(pair, request, {});
  recording::Pair spoilt = pair;
  for (std::size_t i = 0; i < spoilt.sensor.t_s.size(); ++i) {
    if (spoilt.sensor.t_s[i] > before.aligned.t_s[before.holdout_begin])
      spoilt.sensor.columns[0].value[i] += 4000;
  }
  const Identification after = identify(spoilt, request, {});
  EXPECT_EQ(before.model.blocks, after.model.blocks);
  EXPECT_GT(after.holdout.rmse_deg, 2 * before.holdout.rmse_deg);
}

TEST(Identification, VoltsAreNeverTakenForCounts) {
  recording::Pair pair = simulated({20, 2, false, false});
  for (double& v : pair.sensor.columns[0].value) v *= 5.0 / 1023;
  pair.sensor.columns[0].unit = "V";
  const Identification volts = identify(pair, with_structure("hw"), {});
  EXPECT_EQ(volts.model.inputs[0].unit, "V");
  const Identification counts = identify(simulated({20, 2, false, false}), with_structure("hw"), {});
  EXPECT_EQ(counts.model.inputs[0].unit, "count");
  EXPECT_EQ(counts.model.inputs[0].valid_max, 1022);
  EXPECT_NEAR(volts.holdout.rmse_deg, counts.holdout.rmse_deg, 0.02);
  pair.sensor.columns[0].unit = "";
  EXPECT_EQ(identify(pair, with_structure("linear"), {}).model.inputs[0].unit, "");
  Request said = with_structure("linear");
  said.input_unit = "volts";
  EXPECT_EQ(identify(pair, said, {}).model.inputs[0].unit, "V");
  pair.sensor.columns[0].unit = "count";
  EXPECT_THROW((void)identify(pair, said, {}), io::InputError);
  said.input_unit = "furlong";
  EXPECT_THROW((void)identify(pair, said, {}), io::InputError);
}

TEST(Identification, AGivenOffsetNeedsNoAlignment) {
  // Too short to find an offset in, long enough for a line that lags.
  const recording::Pair pair = simulated({250, 2, false, false}, 1.9);
  Request request = with_structure("linear-dynamic");
  request.rate_hz = 50;
  try {
    (void)identify(pair, request, {});
    ADD_FAILURE() << "an offset was found";
  } catch (const io::JobError& error) {
    EXPECT_NE(std::string(error.what()).find("overlap too short"), std::string::npos) << error.what();
  }
  request.clock_offset_s = 3.7;
  const Identification r = identify(pair, request, {});
  EXPECT_FALSE(r.aligned.alignment);
  EXPECT_DOUBLE_EQ(r.aligned.clock_offset_s, 3.7);
  EXPECT_GT(r.holdout.samples, 20u);
  EXPECT_LT(r.fit.rmse_deg, 1.5);
  EXPECT_TRUE(std::ranges::any_of(r.warnings, [](const std::string& w) {
    return w.find("do not confirm the clock offset") != std::string::npos;
  }));
}

TEST(Identification, AGivenOffsetHoldsForSignalsThatDoNotTellIt) {
  // Another take's camera, as far as the signals tell.
  recording::Pair pair = simulated({100, 2, false, false}, 30);
  std::mt19937 random(11);
  for (double& v : pair.reference.columns[0].value) v = static_cast<double>(random() % 80);
  Request request = with_structure("linear");
  EXPECT_THROW((void)identify(pair, request, {}), io::JobError);
  request.clock_offset_s = 3.7;
  const Identification r = identify(pair, request, {});
  EXPECT_FALSE(r.aligned.alignment);
  EXPECT_DOUBLE_EQ(r.aligned.clock_offset_s, 3.7);
}

TEST(Identification, AStoppedSearchGivesTheBestSoFarAndSaysSo) {
  for (const char* structure : {"auto", "hw"}) {
    Request request;
    request.structure = structure;
    std::size_t calls = 0;
    const auto until_third = [&](std::size_t, std::size_t, const std::string&) { return ++calls < 3; };
    const Identification r = identify(simulated({20, 0, false, false}), request, until_third);
    EXPECT_LE(calls, 5u) << structure;
    EXPECT_LT(r.holdout.rmse_deg, r.baseline.rmse_deg) << structure;
    const bool said =
        std::ranges::any_of(r.warnings, [](const std::string& w) { return w.starts_with("stopped before"); });
    EXPECT_EQ(said, request.structure == "auto") << "of hw only the table is shorter";
  }
}

TEST(Identification, StoppedBeforeAnythingWasFittedItIsCancelled) {
  Request request;
  request.structure = "hw";
  const auto never = [](std::size_t, std::size_t, const std::string&) { return false; };
  EXPECT_THROW((void)identify(simulated({20, 0, false, false}), request, never), io::Cancelled);
}

TEST(Identification, AChannelThatNobodyNamedIsSaid) {
  recording::Pair pair = simulated({20, 2, false, false});
  pair.sensor.columns[0].name = pair.input = "SensorA2";
  pair.reference.columns[0].name = pair.output = "angle";
  const auto said = [](const Identification& r) {
    return std::ranges::any_of(r.warnings,
                               [](const std::string& w) { return w.find("--channel") != std::string::npos; });
  };
  EXPECT_TRUE(said(identify(pair, with_structure("linear"), {})));
  Request named = with_structure("linear");
  named.channel = "middle";
  const Identification r = identify(pair, named, {});
  EXPECT_FALSE(said(r));
  EXPECT_EQ(r.model.joints[0].name, "middle");
}

TEST(Identification, ReadingsOnARailCostNothingButThemselves) {
  const recording::Pair clean = simulated({100, 0, false, false});
  recording::Pair flickering = clean;
  for (std::size_t i = 3; i < flickering.sensor.t_s.size(); i += 5) {
    flickering.sensor.columns[0].value[i] = i % 2 == 0 ? 0 : 1023;
  }
  const Identification a = identify(clean, with_structure("hw"), {});
  const Identification b = identify(flickering, with_structure("hw"), {});
  EXPECT_LT(b.holdout.rmse_deg, 1.3 * a.holdout.rmse_deg);
}

TEST(Identification, AHeldOutPartOfNothingButPausesKeepsTheFit) {
  recording::Pair pair = simulated({20, 0, false, false});
  recording::Recording sparse = pair.reference;
  sparse.t_s.clear();
  sparse.columns[0].value.clear();
  for (std::size_t i = 0; i < pair.reference.t_s.size(); ++i) {
    if (2 * i > pair.reference.t_s.size() && i % 60 != 0) continue;
    sparse.t_s.push_back(pair.reference.t_s[i]);
    sparse.columns[0].value.push_back(pair.reference.columns[0].value[i]);
  }
  pair.reference = sparse;
  Request request = with_structure("linear");
  request.split = 0.6;
  const Identification r = identify(pair, request, {});
  EXPECT_FALSE(r.holdout_without_gaps.has_value());
  EXPECT_FALSE(r.warnings.empty());
}

// What was read in volts bounds what a reading may be; the held-out part must not widen it.
TEST(Identification, TheRangeOfReadingsInVoltsIsThatOfTheFittedPart) {
  recording::Pair pair = simulated({20, 0, false, false});
  pair.sensor.columns[0].unit = "V";
  for (double& v : pair.sensor.columns[0].value) v *= 5.0 / 1024;
  Request request = with_structure("linear");
  request.clock_offset_s = 3.7;
  const model::Channel before = *model::channel(identify(pair, request, {}).model, 0);
  std::vector<double>& volts = pair.sensor.columns[0].value;
  const auto half = volts.begin() + std::ssize(volts) / 2;
  const auto [low, high] = std::minmax_element(volts.begin(), half);
  EXPECT_NEAR(before.valid_min, *low - (*high - *low) / 4, 0.05);
  EXPECT_NEAR(before.valid_max, *high + (*high - *low) / 4, 0.05);
  for (std::size_t i = volts.size() * 3 / 4; i < volts.size(); ++i) volts[i] *= 10;
  const model::Channel after = *model::channel(identify(pair, request, {}).model, 0);
  EXPECT_EQ(after.valid_min, before.valid_min);
  EXPECT_EQ(after.valid_max, before.valid_max);
}

TEST(Identification, OptionsThatTheStructureDoesNotHaveAreRefused) {
  Request linear = with_structure("linear");
  linear.order = 0;
  EXPECT_THROW(check(linear), io::InputError);
  Request dynamic = with_structure("linear-dynamic");
  dynamic.knots = 8;
  EXPECT_THROW(check(dynamic), io::InputError);
  Request hw = with_structure("hw");
  hw.plays = 2;
  EXPECT_THROW(check(hw), io::InputError);
}

TEST(Pair, RadiansAreConvertedOnceAndOtherUnitsRefused) {
  recording::Recording r{"c.csv", {0, 1}, {{"angle_rad", {0, 3.14159265358979}, "rad"}}, {}, ""};
  recording::to_degrees(r, "angle_rad", "");
  EXPECT_NEAR(r.columns[0].value[1], 180, 1e-9);
  EXPECT_EQ(r.warnings.size(), 1u);
  recording::to_degrees(r, "angle_rad", "");
  EXPECT_NEAR(r.columns[0].value[1], 180, 1e-9);
  recording::Recording volts{"c.csv", {0, 1}, {{"angle_V", {0, 1}, "V"}}, {}, ""};
  EXPECT_THROW(recording::to_degrees(volts, "angle_V", ""), io::InputError);
  recording::Recording bare{"c.csv", {0, 1}, {{"angle", {0, 1}, ""}}, {}, ""};
  recording::to_degrees(bare, "angle", "rad");
  EXPECT_NEAR(bare.columns[0].value[1], 57.29577951308232, 1e-9);
}

}  // namespace
}  // namespace flexor::identify
