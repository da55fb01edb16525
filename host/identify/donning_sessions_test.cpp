#include "host/identify/donning_sessions.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <filesystem>

#include "host/identify/test_glove.hpp"
#include "host/io/refusal_test.hpp"

namespace flexor::identify {
namespace {

Log log_of(const std::string& name, const model::Correction& moved, unsigned seed) {
  std::mt19937 random(seed);
  Log out{name, {}, {test_moved(test_cycles(12, 0.01, random), moved)}};
  for (std::size_t k = 0; k < out.reading[0].size(); ++k)
    out.t_s.push_back(kTestPeriod_s * static_cast<double>(k));
  return out;
}

std::vector<Log> three(const model::Correction& a, const model::Correction& b, const model::Correction& c) {
  return {log_of("a", a, 1), log_of("b", b, 2), log_of("c", c, 3)};
}

std::string refusal(const std::vector<Log>& logs) {
  return io::refusal_of([&] { (void)compare(logs, {"index"}, 1); });
}

TEST(Sessions, SayWhereASensorLiesAndReachesInEach) {
  const Sessions all = compare(three({1, 0}, {1, 60}, {1 / 1.2, 75}), {"index"}, 1);
  const auto& b = all.sessions[1].sensors[0];
  const auto& a = all.sessions[0].sensors[0];
  EXPECT_NEAR(a.shift.value - b.shift.value, 0.2 * 300 / 320, 0.02);
  EXPECT_NEAR(all.sessions[2].sensors[0].log_gain.value - a.log_gain.value, std::log(1.2), 0.02);
  EXPECT_LT(a.shift.low, a.shift.value);
  EXPECT_GT(a.shift.high, a.shift.value);
  EXPECT_LT(a.shape, 0.02);
  EXPECT_NEAR(a.noise, 1 / 320.0, 0.002);
  EXPECT_NEAR(all.prior.shift_sd, 0.11, 0.04);
}

// Together, against each other, and each on its own: two sessions' worth of evidence beside the shipped prior.
TEST(Sessions, SayHowAlikeTheShiftsOfTheSensorsAre) {
  const auto alike = [](std::array<double, 3> other) {
    const std::array<double, 3> one = {-60, 0, 60};
    std::vector<Log> logs;
    for (unsigned i = 0; i < 3; ++i) {
      Log log = log_of("it", {1, one[i]}, 1 + i);
      log.reading.push_back(log_of("it", {1, other[i]}, 11 + i).reading[0]);
      logs.push_back(std::move(log));
    }
    return compare(logs, {"index", "middle"}, 1).prior.alike;
  };
  const double general = shipped_prior().alike;
  EXPECT_NEAR(alike({-60, 0, 60}), (4 * general + 2 * kMostAlike) / 6, 0.01);
  EXPECT_NEAR(alike({60, 0, -60}), 4 * general / 6, 0.01);
  EXPECT_NEAR(alike({60, -120, 60}), 4 * general / 6, 0.02);
  EXPECT_EQ(compare(three({1, 0}, {1, 60}, {1, 75}), {"index"}, 1).prior.alike, general);
}

TEST(Sessions, FewOrStillOrInAnotherUnitAreRefused) {
  EXPECT_TRUE(refusal({log_of("a", {}, 1), log_of("b", {}, 2)}).starts_with("2 session(s): at least"));
  auto logs = three({}, {1, 60}, {1, 75});
  EXPECT_EQ(refusal(logs), "accepted");
  for (double& u : logs[2].reading[0]) u *= 5.0 / 1023;
  EXPECT_TRUE(refusal(logs).starts_with("c: index spans")) << refusal(logs);
  std::ranges::fill(logs[2].reading[0], 5.0);
  EXPECT_TRUE(refusal(logs).starts_with("c: index stands still")) << refusal(logs);
}

// Sessions that are the same: nothing says how alike the shifts are.
TEST(Sessions, ThatNeverMovedHaveThePriorOfOthers) {
  Log log = log_of("it", {}, 1);
  log.reading.push_back(log.reading[0]);
  const Prior prior = compare({log, log, log}, {"index", "middle"}, 1).prior;
  EXPECT_EQ(prior.alike, shipped_prior().alike);
  EXPECT_GT(prior.shift_sd, 0);
  EXPECT_EQ(prior_from_json(to_json(prior), "it").alike, prior.alike);
}

class SessionFiles : public testing::Test {
 protected:
  std::filesystem::path write(const std::string& name, std::size_t rows, double add,
                              const std::string& middle = "") {
    std::mt19937 random(static_cast<unsigned>(rows));
    const std::vector<double> readings = test_cycles(12, 0.01, random);
    std::string text = "t_s,index,middle\n";
    for (std::size_t k = 0; k < std::min(rows, readings.size()); ++k) {
      text += fmt::format("{},{},{}\n", kTestPeriod_s * static_cast<double>(k), readings[k] + add,
                          middle.empty() ? fmt::format("{}", readings[k]) : middle);
    }
    io::write_file(folder_.path() / name, text);
    return folder_.path() / name;
  }

  io::TemporaryFolder folder_;
};

TEST_F(SessionFiles, OfFewRowsAreRefusedByName) {
  const auto a = write("a.csv", 900, 0);
  const auto b = write("b.csv", 900, 20);
  for (const std::size_t rows : {2U, 3U, 5U, 10U, 20U}) {
    const auto c = write("short.csv", rows, 0);
    const std::string said = io::refusal_of([&] { (void)compare_files({a, b, c}, {}, ""); });
    EXPECT_NE(said.find("short.csv"), std::string::npos) << rows << ": " << said;
  }
}

TEST_F(SessionFiles, OneSensorThatWasNotReadLeavesTheOthers) {
  const auto a = write("a.csv", 900, 0);
  const auto b = write("b.csv", 900, 20);
  const auto c = write("c.csv", 900, 40);
  const Sessions whole = compare_files({a, b, c}, {"index"}, "");
  for (const std::string hole : {"nan", " "}) {
    const Sessions all = compare_files({a, b, write("d.csv", 900, 40, hole), c}, {}, "");
    ASSERT_EQ(all.sessions[2].sensors.size(), 1U);
    EXPECT_EQ(all.sessions[2].sensors[0].sensor, "index");
    EXPECT_EQ(all.sessions[0].sensors.size(), 2U);
    EXPECT_NEAR(all.prior.shift_sd, whole.prior.shift_sd, 0.03);
  }
}

// Only where the recordings are.
TEST(Sessions, OfARealGloveOverMonths) {
  const std::filesystem::path folder = std::filesystem::path(FLEXOR_SOURCE_DIR) / "../shared/data/donning";
  if (!std::filesystem::exists(folder))
    GTEST_SKIP() << "needs ../shared/data/donning, which is not part of the repository";
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().filename().string().starts_with("P6_")) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  const Sessions all = compare_files(files, {}, "");
  EXPECT_NEAR(all.prior.shift_sd, 0.2, 0.1);
  EXPECT_NEAR(all.prior.log_gain_sd, 0.1, 0.06);
}

}  // namespace
}  // namespace flexor::identify
