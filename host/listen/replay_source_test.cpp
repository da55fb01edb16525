#include "host/listen/replay_source.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <thread>

#include "host/io/io.hpp"

namespace flexor::listen {
namespace {

namespace fs = std::filesystem;

// Uneven rows of about 100 Hz.
class Replay : public testing::Test {
 protected:
  static constexpr int kRows = 61;

  Replay() {
    std::ofstream file(path());
    file.precision(12);
    file << "t_s,host_s,index_count,middle_deg\n";
    for (int k = 0; k < kRows; ++k)
      file << 1000 + time_s(k) << ',' << k << ',' << 500 + k << ',' << 0.25 * k << '\n';
  }
  static double time_s(int k) { return k * 0.01 + (k % 3) * 0.002; }
  fs::path path() const { return folder_.path() / "log.csv"; }

  static std::vector<Sample> all(ReplaySource& source) {
    std::vector<Sample> out;
    while (source.wait(0.1, out) != Event::ended) {
    }
    return out;
  }

  io::TemporaryFolder folder_;
};

TEST_F(Replay, GivesEveryRowWhenItIsDue) {
  ReplaySource source(path());
  ASSERT_EQ(source.columns(), (std::vector<std::string>{"index_count", "middle_deg"}));
  EXPECT_NEAR(source.duration_s(), time_s(kRows - 1), 1e-9);
  std::vector<Sample> samples;
  double worst_late_s = 0;
  for (std::size_t given = 0; source.wait(0.1, samples) != Event::ended; given = samples.size()) {
    for (std::size_t i = given; i < samples.size(); ++i) {
      EXPECT_LE(samples[i].host_s, source.now_s());  // never early
      if (i == given) worst_late_s = std::max(worst_late_s, source.now_s() - samples[i].host_s);
    }
  }
  EXPECT_LT(worst_late_s, 0.3);
  EXPECT_GT(source.now_s(), 0.6);
  ASSERT_EQ(samples.size(), static_cast<std::size_t>(kRows));
  EXPECT_EQ(source.tally().samples, static_cast<std::uint64_t>(kRows));
  for (int k = 0; k < kRows; ++k) {
    const Sample& s = samples[static_cast<std::size_t>(k)];
    EXPECT_EQ(s.value, (std::vector<double>{500.0 + k, 0.25 * k}));
    EXPECT_NEAR(*s.board_s, time_s(k), 1e-9);
    EXPECT_NEAR(s.host_s - samples[0].host_s, time_s(k), 1e-9);
  }
  EXPECT_EQ(source.wait(10, samples), Event::ended);  // at once
}

TEST_F(Replay, FasterIsSoMuchShorter) {
  ReplaySource source(path(), 10);
  const std::vector<Sample> samples = all(source);
  EXPECT_GE(source.now_s(),
            time_s(kRows - 1) / 10);  // its clock begins with it, whenever this thread goes on
  EXPECT_NEAR(samples.back().host_s - samples.front().host_s, time_s(kRows - 1) / 10, 1e-9);
}

TEST_F(Replay, StandsStillWhilePaused) {
  ReplaySource source(path());
  std::vector<Sample> samples;
  while (samples.size() < 10) source.wait(0.1, samples);
  EXPECT_TRUE(source.is_playing());
  source.pause(true);
  EXPECT_FALSE(source.is_playing());
  const double there_s = source.position_s();
  const std::size_t given = samples.size();
  EXPECT_EQ(source.wait(0.05, samples), Event::quiet);
  std::this_thread::sleep_for(std::chrono::milliseconds(700));
  EXPECT_EQ(source.wait(0, samples), Event::quiet);
  EXPECT_EQ(samples.size(), given);
  EXPECT_EQ(source.position_s(), there_s);
  source.pause(false);
  while (source.wait(0.1, samples) != Event::ended) {
  }
  EXPECT_FALSE(source.is_playing());
  ASSERT_EQ(samples.size(), static_cast<std::size_t>(kRows));
  EXPECT_GT(samples[given].host_s - samples[given - 1].host_s, 0.7);
}

TEST_F(Replay, SeeksBothWays) {
  ReplaySource source(path());
  source.pause(true);
  source.seek(0.5);
  EXPECT_EQ(source.position_s(), 0.5);
  source.pause(false);
  std::vector<Sample> samples = all(source);
  ASSERT_EQ(samples.size(), 11U);
  EXPECT_EQ(samples.front().value[0], 550);
  source.seek(0.55);  // after the end
  EXPECT_EQ(all(source).size(), 6U);
  source.seek(-3);
  EXPECT_EQ(all(source).size(), static_cast<std::size_t>(kRows));
  source.pause(true);
  source.seek(0.3);
  EXPECT_EQ(source.position_s(), 0.3);
  samples.clear();
  EXPECT_EQ(source.wait(0, samples), Event::quiet);
  EXPECT_TRUE(samples.empty());
}

TEST_F(Replay, RefusesWhatItCannotPlay) {
  EXPECT_THROW(ReplaySource("no_such_file.csv"), io::InputError);
  EXPECT_THROW(ReplaySource(path(), 0), io::InputError);
  EXPECT_THROW(ReplaySource(path(), std::nan("")), io::InputError);
  io::write_file(folder_.path() / "timeless.csv", "index,middle\n1,2\n2,3\n");
  EXPECT_THROW(ReplaySource(folder_.path() / "timeless.csv"), io::InputError);
  io::write_file(folder_.path() / "empty.csv", "t_s,host_s\n1,2\n2,3\n");
  EXPECT_THROW(ReplaySource(folder_.path() / "empty.csv"), io::InputError);
}

}  // namespace
}  // namespace flexor::listen
