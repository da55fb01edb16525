#include "host/io/interrupt.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <ctime>
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
  Interrupt() : folder_(fs::path(testing::TempDir()) / ("flexor_interrupt_" + std::to_string(::getpid()))) {
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "tmp");
  }
  ~Interrupt() override { fs::remove_all(folder_); }

  // A process that does `work` with the cleaning installed, its TMPDIR in the test's folder.
  pid_t start(const std::function<void()>& work) const {
    const pid_t child = ::fork();
    if (child != 0) return child;
    ::setenv("TMPDIR", (folder_ / "tmp").c_str(), 1);
    if (std::freopen((folder_ / "stderr").c_str(), "w", stderr) == nullptr) ::_exit(98);
    end_cleanly_on_signals();
    work();
    ::_exit(99);
  }

  static int signal_that_ended(pid_t child) {
    int status = 0;
    ::waitpid(child, &status, 0);
    return WIFSIGNALED(status) ? WTERMSIG(status) : -WEXITSTATUS(status);
  }

  std::string said() const {
    std::ifstream stream(folder_ / "stderr");
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  void wait_for(const fs::path& path) const {
    for (int i = 0; i < 60000 && !fs::exists(path); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    ASSERT_TRUE(fs::exists(path)) << path;
  }

  std::ptrdiff_t temporaries() const { return std::distance(fs::directory_iterator(folder_ / "tmp"), {}); }

  fs::path folder_;
};

TEST_F(Interrupt, RemovesTemporariesSaysSoAndDiesOfTheSignal) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    const fs::path ready = folder_ / ("ready" + std::to_string(signal));
    const pid_t child = start([&] {
      set_interruption_note("results so far are in x");
      const TemporaryFolder temporary;
      make_folder(temporary.path() / "a/b");
      write_file(temporary.path() / "a/b/c", "x");
      Output output(folder_ / "out");
      output.write(std::string(1 << 20, 'x'));
      std::ofstream(ready) << "x";
      for (;;) ::pause();
    });
    wait_for(ready);
    ::kill(child, signal);
    EXPECT_EQ(signal_that_ended(child), signal);
    EXPECT_EQ(said(), "flexor: results so far are in x\n");
    EXPECT_EQ(temporaries(), 0);
    fs::remove(ready);
    EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 2) << "tmp and stderr";
  }
}

TEST_F(Interrupt, WhoHeedsTheFirstSignalIsEndedByTheSecond) {
  const fs::path ready = folder_ / "ready";
  const fs::path heeded = folder_ / "heeded";
  const pid_t child = start([&] {
    const TemporaryFolder temporary;
    const StopOnSignal stop;
    std::ofstream(ready) << "x";
    while (!*stop.flag()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    std::ofstream(heeded) << "x";
    for (;;) ::pause();
  });
  wait_for(ready);
  ::kill(child, SIGINT);
  wait_for(heeded);
  EXPECT_EQ(temporaries(), 1);
  ::kill(child, SIGTERM);
  EXPECT_EQ(signal_that_ended(child), SIGTERM);
  EXPECT_EQ(temporaries(), 0);
}

TEST_F(Interrupt, ASignalThatWasIgnoredStaysIgnored) {
  const fs::path ready = folder_ / "ready";
  std::signal(SIGHUP, SIG_IGN);
  const pid_t child = start([&] {
    std::ofstream(ready) << "x";
    for (;;) ::pause();
  });
  std::signal(SIGHUP, SIG_DFL);
  wait_for(ready);
  ::kill(child, SIGHUP);
  ::kill(child, SIGTERM);
  EXPECT_EQ(signal_that_ended(child), SIGTERM);
}

// Two threads make, fill and replace files and folders without a pause; a signal at any instant leaves none
// behind, and the file that both write is always a whole one.
TEST_F(Interrupt, AtAnyInstantNothingIsLeftBehind) {
  std::mt19937 random(1);
  for (int round = 0; round < 60; ++round) {
    const fs::path file = folder_ / "out";
    const pid_t child = start([&] {
      const auto write = [&](char letter) {
        try {
          for (;;) {
            const TemporaryFolder temporary;
            Output output(temporary.path() / "inner");
            write_file(file, std::string(100000, letter));
          }
        } catch (const std::exception&) {  // as programs do before they report a fault
          wait_if_ending();
          throw;
        }
      };
      std::thread other(write, 'a');
      write('b');
    });
    wait_for(file);
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 5000));
    ::kill(child, round % 2 == 0 ? SIGINT : SIGTERM);
    if (round % 3 == 0) ::kill(child, SIGHUP);  // waits meanwhile
    const int ended = signal_that_ended(child);
    ASSERT_TRUE(ended == (round % 2 == 0 ? SIGINT : SIGTERM) || (round % 3 == 0 && ended == SIGHUP))
        << said();
    // Before it a sanitizer may say that it saw a thread at its birth.
    EXPECT_TRUE(said().ends_with("flexor: interrupted\n")) << said();
    EXPECT_EQ(temporaries(), 0);
    EXPECT_EQ(fs::file_size(file), 100000u);
    fs::remove(file);
    ASSERT_EQ(std::distance(fs::directory_iterator(folder_), {}), 2) << "tmp and stderr";
  }
}

TEST_F(Interrupt, AProgramThatRunsIsEndedToo) {
  const fs::path ready = folder_ / "ready";
  const pid_t parent = start([&] {
    const Process sleeps("/bin/sleep", {"sleep", "1000"}, {});
    pid_t child = 0;
    std::ifstream("/proc/thread-self/children") >> child;
    write_file(ready, std::to_string(child));
    for (;;) ::pause();
  });
  wait_for(ready);
  const pid_t grandchild = std::stoi(read_file(ready));
  ::kill(parent, SIGINT);
  EXPECT_EQ(signal_that_ended(parent), SIGINT);
  EXPECT_NE(::kill(-grandchild, 0), 0) << "it still runs";
}

}  // namespace
}  // namespace flexor::io
