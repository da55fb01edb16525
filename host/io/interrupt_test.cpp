#include "host/io/interrupt.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <random>
#include <thread>

#include "host/io/output.hpp"
#include "host/io/process.hpp"

namespace flexor::io {
namespace {
namespace fs = std::filesystem;

class Interrupt : public testing::Test {
 protected:
  Interrupt() { fs::create_directory(folder_ / "tmp"); }

  // A process that does `work` as a command does, its TMPDIR in the test's folder; once `ready` is there.
  pid_t start(const std::function<void()>& work) const {
    const pid_t child = ::fork();
    if (child != 0) wait_for(ready_);
    if (child != 0) return child;
    ::setenv("TMPDIR", (folder_ / "tmp").c_str(), 1);
    if (std::freopen((folder_ / "stderr").c_str(), "w", stderr) == nullptr) ::_exit(98);
    stop_on_signals(true);
    try {
      work();
    } catch (const Cancelled& stopped) {
      (void)std::fprintf(stderr, "flexor: %s\n", stopped.what());
      (void)std::fflush(stderr);
      end_by_signal();
    }
    ::_exit(99);
  }

  static int signal_that_ended(pid_t child) {
    int status = 0;
    ::waitpid(child, &status, 0);
    return WIFSIGNALED(status) ? WTERMSIG(status) : -WEXITSTATUS(status);
  }

  std::string errors() const { return read_file(folder_ / "stderr"); }

  void wait_for(const fs::path& path) const {
    for (int i = 0; i < 60000 && !fs::exists(path); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    ASSERT_TRUE(fs::exists(path)) << path;
  }

  std::ptrdiff_t temporaries() const { return std::distance(fs::directory_iterator(folder_ / "tmp"), {}); }

  void be_ready() const { std::ofstream(ready_) << "x"; }

  const TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path();
  const fs::path ready_ = folder_ / "ready";
};

TEST_F(Interrupt, WhoLooksCleansUpReportsItAndDiesOfTheSignal) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    const pid_t child = start([&] {
      set_interruption_note("results so far are in x");
      const TemporaryFolder temporary;
      make_folder(temporary.path() / "a/b");
      write_file(temporary.path() / "a/b/c", "x");
      Output output(folder_ / "out");
      output.write(std::string(1 << 20, 'x'));
      be_ready();
      for (;;) go_on();
    });
    ::kill(child, signal);
    EXPECT_EQ(signal_that_ended(child), signal);
    EXPECT_EQ(errors(), "flexor: results so far are in x\n");
    EXPECT_EQ(temporaries(), 0);
    fs::remove(ready_);
    EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 2) << "tmp and stderr";
  }
}

TEST_F(Interrupt, WhoDoesNotLookIsEndedSoon) {
  const pid_t child = start([&] {
    be_ready();
    for (;;) ::pause();
  });
  ::kill(child, SIGHUP);
  EXPECT_EQ(signal_that_ended(child), SIGHUP);
  EXPECT_EQ(errors(), "flexor: interrupted\n");
}

TEST_F(Interrupt, WhoHeedsTheFirstSignalIsEndedByTheSecond) {
  const fs::path heeded = folder_ / "heeded";
  const pid_t child = start([&] {
    const StopOnSignal stop;
    be_ready();
    while (!*stop.flag()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    go_on();
    std::ofstream(heeded) << "x";
    for (;;) ::pause();
  });
  ::kill(child, SIGINT);
  wait_for(heeded);
  ::kill(child, SIGTERM);
  EXPECT_EQ(signal_that_ended(child), SIGINT);
}

TEST_F(Interrupt, ASignalThatWasIgnoredStaysIgnored) {
  std::signal(SIGHUP, SIG_IGN);
  const pid_t child = start([&] {
    be_ready();
    for (;;) ::pause();
  });
  std::signal(SIGHUP, SIG_DFL);
  ::kill(child, SIGHUP);
  ::kill(child, SIGTERM);
  EXPECT_EQ(signal_that_ended(child), SIGTERM);
}

TEST_F(Interrupt, AtAnyInstantNothingIsLeftBehind) {
  std::mt19937 random(1);
  for (int round = 0; round < 30; ++round) {
    const fs::path file = ready_;
    const pid_t child = start([&] {
      for (;;) {
        const TemporaryFolder temporary;
        Output output(temporary.path() / "inner");
        write_file(file, std::string(100000, 'a'));
      }
    });
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 5000));
    ::kill(child, SIGINT);
    EXPECT_EQ(signal_that_ended(child), SIGINT);
    EXPECT_EQ(errors(), "flexor: interrupted\n");
    EXPECT_EQ(temporaries(), 0);
    EXPECT_EQ(fs::file_size(file), 100000u);
    fs::remove(file);
    ASSERT_EQ(std::distance(fs::directory_iterator(folder_), {}), 2) << "tmp and stderr";
  }
}

TEST_F(Interrupt, AProgramThatRunsIsEndedToo) {
  const pid_t parent = start([&] {
    const Process sleeps("/bin/sleep", {"sleep", "1000"}, {});
    pid_t child = 0;
    std::ifstream("/proc/thread-self/children") >> child;
    write_file(ready_, std::to_string(child));
    for (;;) go_on();
  });
  const pid_t grandchild = std::stoi(read_file(ready_));
  ::kill(parent, SIGINT);
  EXPECT_EQ(signal_that_ended(parent), SIGINT);
  EXPECT_NE(::kill(-grandchild, 0), 0) << "it still runs";
}

}  // namespace
}  // namespace flexor::io
