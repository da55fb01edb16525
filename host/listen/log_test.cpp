#include "host/listen/log.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <csignal>

#include "host/io/io.hpp"
#include "host/listen/replay_source.hpp"
#include "host/recording/csv.hpp"

namespace flexor::listen {
namespace {

namespace fs = std::filesystem;

Sample at(double host_s, std::optional<double> board_s, double value) {
  return {host_s, board_s, {value}, {}};
}

TEST(Span, EndsByTheSourcesClockWhetherSamplesComeOrNot) {
  Span span(4);
  EXPECT_FALSE(span.is_over(100)) << "nothing came yet";
  span.add_sample(100);
  span.add_sample(101);
  EXPECT_FALSE(span.is_over(103.9));
  EXPECT_EQ(span.silent_s(103), 2);
  EXPECT_EQ(span.left_s(103), 1);
  EXPECT_TRUE(span.is_over(104));
  EXPECT_FALSE(Span(0).is_over(1e9));
}

TEST(Log, HasTheBoardsClockBesideTheHosts) {
  const io::TemporaryFolder folder;
  const fs::path file = folder.path() / "log.csv";
  {
    Log log(file, {"index_count"});
    log.add(at(100.0, 7.00, 1));
    log.add(at(100.5, 7.51, 2));
    log.add(at(101.0, 0.02, 3));  // the board was reset
    log.add(at(101.5, 0.53, 4));
    log.add(at(166.5, 65.52, 5));
    log.add(at(167.0, 0.484, 6));  // milliseconds in 16 bits
    EXPECT_EQ(log.restarts(), 1U);
  }
  const recording::Recording r = recording::read_csv(file, {});
  EXPECT_EQ(io::read_file(file).substr(0, 23), "t_s,host_s,index_count\n");
  ASSERT_EQ(r.t_s.size(), 6U);
  EXPECT_NEAR(r.t_s[5] - r.t_s[4], 0.5, 1e-9);
  EXPECT_NEAR(r.t_s[1], 0.51, 1e-9);
  EXPECT_NEAR(r.t_s[2], 1.01, 1e-9);
  EXPECT_NEAR(r.t_s[3], 1.52, 1e-9);
}

TEST(Log, RisesStrictlyInBursts) {
  const io::TemporaryFolder folder;
  const fs::path file = folder.path() / "log.csv";
  {
    Log log(file, {"a"});
    for (int i = 0; i < 100; ++i) log.add(at(5 + i / 5 * 0.05, {}, i));
  }
  const recording::Recording r = recording::read_csv(file, {});
  for (std::size_t i = 1; i < r.t_s.size(); ++i) EXPECT_GT(r.t_s[i], r.t_s[i - 1]);
  EXPECT_EQ(r.t_s.size(), 100U);
}

TEST(Log, IsOnTheDiskEachSecondAndNeverWrittenOver) {
  const io::TemporaryFolder folder;
  const fs::path file = folder.path() / "log.csv";
  Log log(file, {"a"});
  for (int i = 0; i <= 250; ++i) log.add(at(i * 0.01, {}, i));
  const std::string text = io::read_file(file);
  EXPECT_GE(std::count(text.begin(), text.end(), '\n'), 150);
  EXPECT_EQ(text.back(), '\n');
  EXPECT_THROW(Log(file, {"a"}), io::InputError);
}

TEST(Log, WithMissingReadingsIsReadWhereTheyAreNotAskedForAndIsPlayedAgain) {
  const io::TemporaryFolder folder;
  const fs::path file = folder.path() / "log.csv";
  {
    Log log(file, {"thumb", "index"});
    for (int i = 0; i < 40; ++i) log.add({i * 0.01, {}, {std::nan(""), 100.0 + i}, {}});
  }
  EXPECT_EQ(recording::read_csv(file, {"index"}).t_s.size(), 40U);
  ReplaySource source(file, 1000);
  EXPECT_EQ(source.columns(), (std::vector<std::string>{"thumb", "index"}));
  std::vector<Sample> samples;
  while (source.wait(0.1, samples) != Event::ended) {
  }
  ASSERT_EQ(samples.size(), 40U);
  EXPECT_TRUE(std::isnan(samples[9].value[0]));
  EXPECT_EQ(samples[9].value[1], 109);
}

// A limit on the size of files stands for a disk that is full.
TEST(Log, ThatHasNoRoomForItsHeaderLeavesNoFile) {
  const io::TemporaryFolder folder;
  const fs::path file = folder.path() / "log.csv";
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit none{0, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &none);
  EXPECT_THROW(Log(file, {"a"}), io::JobError);
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_FALSE(fs::exists(file));
  EXPECT_NO_THROW(Log(file, {"a"})) << "the same name, once there is room";
}

}  // namespace
}  // namespace flexor::listen
