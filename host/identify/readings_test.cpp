#include "host/identify/readings.hpp"

#include <gtest/gtest.h>

#include "host/identify/recalibrate.hpp"
#include "host/io/io.hpp"

namespace flexor::identify {
namespace {

const std::vector<model::Spread> kMade = {{{0.05, 0.95}, {300, 600}}};

TEST(Held, AreNotEndedByALooseContactNorByATremorAndAHandAtEaseAroundThemIsNone) {
  std::vector<double> reading;
  for (std::size_t k = 0; k < 200; ++k) {
    const double tremor = k % 5 == 0 ? 30 : -8;  // of a span of 300: an eighth of it
    const double spike = k % 25 == 12 || k % 25 == 13 ? 200 : 0;
    reading.push_back(std::array{450, 300, 600, 450}[k / 50] + tremor + spike);
  }
  const Held held = poses_in({reading}, 0.05, kMade, "log");
  ASSERT_FALSE(held.fist.empty());
  EXPECT_NEAR(held.open[0].reading[0], 292, 5);
  EXPECT_NEAR(held.fist[0].reading[0], 592, 5);
}

TEST(Prior, IsReadAndWhatIsNoneIsRefused) {
  const std::string start =
      R"({"schema": "flexor-donning-prior", "schema_version": 1, "sessions": 9, "shift_sd": 0.2,)"
      R"( "log_gain_sd": 0.1, "motion_sd": 0.01, "reach_sd": 0.05, "density_sd": 0.08)";
  const Prior prior = prior_from_json(start + ", \"alike\": 0.5}", "it");
  EXPECT_EQ(prior.sessions, 9);
  EXPECT_EQ(prior.shift_sd, 0.2);
  EXPECT_EQ(prior.density_sd, 0.08);
  EXPECT_EQ(prior.alike, 0.5);
  EXPECT_EQ(prior_from_json(start + "}", "it").alike, shipped_prior().alike);
  EXPECT_THROW((void)prior_from_json("{\"schema\": \"flexor-model\"}", "it"), io::InputError);
}

TEST(Prior, OfAModelOfSeveralRecordingsLeansTowardsWhatTheySay) {
  model::Input input;
  input.readings = model::Spread{{0.02, 0.98}, {300, 600}};
  const Prior general = shipped_prior();
  EXPECT_EQ(prior_of(input, general).shift_sd, general.shift_sd);
  input.donnings = model::DonningSpread{9, 6, 0.02};  // a glove that hardly moves
  const Prior own = prior_of(input, general);
  const double of_new2 = (1 + 1. / 9) * 0.02 * 0.02;  // about the mean of nine, and the general one
  EXPECT_NEAR(std::pow(own.shift_sd, 2), (4 * std::pow(general.shift_sd, 2) + 8 * of_new2) / 12, 1e-12);
}

TEST(Turns, CountOnlyWhatGoesFarEnoughBothWays) {
  const Turns turns = turns_of(std::vector<double>{1, 5, 10, 6, 2, 0, 4, 9}, 5);
  EXPECT_EQ(turns.count, 2);
  EXPECT_EQ(turns.low_ends, (std::vector<double>{1, 0}));
  EXPECT_EQ(turns.high_ends, (std::vector<double>{10, 9}));
  EXPECT_EQ(turns.high, std::vector<double>{10});
  EXPECT_EQ(turns.there_and_back, 9);
  EXPECT_EQ(turns_of(std::vector<double>{1, 5, 10, 6, 2}, 11).count, 0);
  EXPECT_EQ(turns_of(std::vector<double>{0, 10}, 5).count, 0) << "it went one way only";
}

TEST(Spread, LiesStraightBetweenReadings) {
  const std::vector<double> shares = {0, 0.625, 1};
  EXPECT_EQ(spread_of({40, 10, 20, 30, 0}, shares).reading, (std::vector<double>{0, 25, 40}));
}

// A sensor that falls from 700 to 300 while the angle goes from 10 to 90 degrees and back.
Session bends(double spike = 0) {
  Session s;
  constexpr Eigen::Index kSamples = 400;
  s.angle_deg.resize(kSamples);
  s.input.resize(kSamples, 2);
  s.use.assign(kSamples, 1);
  for (Eigen::Index k = 0; k < kSamples; ++k) {
    const double closed = 0.5 - 0.5 * std::cos(0.1 * static_cast<double>(k));
    s.angle_deg(k) = 10 + 80 * closed;
    s.input(k, 0) = 700 - 400 * closed;
    s.input(k, 1) = 500;
  }
  s.input(5, 0) += spike;
  return s;
}

TEST(Poses, AreTheReadingsAtTheEndsOfTheAnglesWhateverASpikeSays) {
  for (const double spike : {0.0, 5000.0}) {
    const auto poses = poses_of({bends(spike)}, 0);
    ASSERT_TRUE(poses);
    EXPECT_NEAR(poses->open, 692, 8);
    EXPECT_NEAR(poses->fist, 308, 8);
  }
}

TEST(Poses, AreNoneWhereTheSensorSaysNothingOrAPoseIsMissing) {
  EXPECT_FALSE(poses_of({bends()}, 1));
  Session few = bends();
  for (std::size_t k = 8; k < few.use.size(); ++k) few.use[k] = 0;
  EXPECT_FALSE(poses_of({few}, 0));
  EXPECT_FALSE(poses_of({}, 0));
}

TEST(Readings, SpreadAsTheSensorReadAndSayHowDonningsDiffer) {
  const auto spread = [](const std::vector<Session>& sessions, Eigen::Index sensor) {
    model::Input out;
    add_spread(sessions, sensor, out);
    return out;
  };
  const model::Input one = spread({bends(5000)}, 0);  // whatever a spike says
  ASSERT_TRUE(one.readings);
  EXPECT_FALSE(one.donnings);
  EXPECT_NEAR(one.readings->reading.front(), 300, 5);
  EXPECT_NEAR(one.readings->reading.back(), 700, 5);
  EXPECT_NEAR(one.readings->reading[2], 500, 20);
  EXPECT_FALSE(spread({bends()}, 1).readings) << "it never moved";
  Session shifted = bends();
  shifted.input.array() += 40;
  const model::Input two = spread({bends(), shifted}, 0);
  ASSERT_TRUE(two.donnings);
  EXPECT_EQ(two.donnings->recordings, 2);
  EXPECT_NEAR(two.donnings->shift_sd, 40 / std::sqrt(2.0), 1e-9);
  EXPECT_NEAR(two.donnings->log_gain_sd, 0, 1e-9);
}

}  // namespace
}  // namespace flexor::identify
