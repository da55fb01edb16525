#include "host/io/worker.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <bit>
#include <cmath>
#include <fstream>
#include <limits>
#include <random>
#include <thread>

#include "host/io/interrupt.hpp"
#include "host/io/refusal_test.hpp"

namespace flexor::io {
namespace {
namespace fs = std::filesystem;

constexpr const char* kProgram = FLEXOR_TEST_WORKER;

std::string job_error(Worker& worker, const std::string& job, const Json& arguments) {
  return refusal_of<JobError>([&] { worker.run(job, arguments); });
}

TEST(Worker, ArgumentsAndResultsKeepTheirBits) {
  Worker worker(kProgram);
  std::mt19937_64 random(1);
  Json numbers = Json::array();
  for (int i = 0; i < 20000; ++i) {
    const double x = std::bit_cast<double>(random());
    if (std::isfinite(x)) numbers.push_back(x);
  }
  using Limits = std::numeric_limits<double>;
  for (const double x : {0.0, -0.0, 5.0, Limits::denorm_min(), Limits::max()}) numbers.push_back(x);
  numbers.push_back(UINT64_MAX);
  const Json back = worker.run("echo", {{"numbers", numbers}, {"text", "Größe\n\"x\""}});
  ASSERT_EQ(back.at("numbers").size(), numbers.size());
  for (std::size_t i = 0; i + 1 < numbers.size(); ++i)
    ASSERT_EQ(std::bit_cast<std::uint64_t>(back.at("numbers")[i].get<double>()),
              std::bit_cast<std::uint64_t>(numbers[i].get<double>()));
  EXPECT_EQ(back.at("numbers").back().get<std::uint64_t>(), UINT64_MAX);
  EXPECT_EQ(back.at("text"), "Größe\n\"x\"");
  const std::string name = "caf\xe9\n\xff.mp4";
  EXPECT_EQ(bytes_from_json(worker.run("echo", {{"x", bytes_to_json(name)}}).at("x")), name);
  EXPECT_EQ(bytes_to_json("Größe"), "Größe");
}

TEST(Worker, ErrorsAreTheSameHereAsThere) {
  Worker worker(kProgram);
  const auto fails = [&](const char* kind, const std::string& message) {
    return [&worker, kind, message] {
      worker.run("fail", {{"kind", kind}, {"message", bytes_to_json(message)}});
    };
  };
  EXPECT_EQ(refusal_of<InputError>(fails("input", "\xff.csv: no such file")), "\xff.csv: no such file");
  EXPECT_EQ(refusal_of<JobError>(fails("job", "the disk is full")), "the disk is full");
  EXPECT_EQ(refusal_of<Cancelled>(fails("cancelled", "stopped")), "stopped");
  EXPECT_EQ(refusal_of<JobError>(fails("memory", "")).substr(0, 14), "out of memory:");
  const Json far = answer([]() -> Json { return std::filesystem::exists(std::string(300, 'x')); });
  EXPECT_EQ(far.at("error").at("kind"), "input") << far;
  EXPECT_EQ(refusal_of<JobError>(fails("other", "odd")), "odd: this is a defect of Flexor, please report it");
  EXPECT_THROW(worker.run("no such job", Json::object()), InputError);
  EXPECT_THROW(worker.run("fail", Json::object()), InputError) << "an argument is missing";
  EXPECT_EQ(worker.run("echo", 1), 1) << "it goes on after all that";
}

TEST(Worker, ProgressComesAndCancellingKeepsWhatThereIs) {
  Worker worker(kProgram);
  std::size_t last = 0;
  int calls = 0;
  const Json stopped = worker.run("count", {{"of", 1000000}, {"pause_ms", 1}}, [&](const Progress& p) {
    EXPECT_EQ(p.of, 1000000U);
    EXPECT_TRUE(calls == 0 || p.done > last);
    last = p.done;
    return ++calls < 3;
  });
  EXPECT_EQ(stopped.at("stopped"), true);
  EXPECT_GE(stopped.at("counted").get<std::size_t>(), last);
  EXPECT_EQ(calls, 3) << "it is asked once";
  EXPECT_EQ(worker.run("count", {{"of", 10}}).at("stopped"), false) << "the next job knows nothing of it";
}

TEST(Worker, OneThatDiesIsAJobErrorOfOneLine) {
  Worker killed(kProgram);
  EXPECT_EQ(job_error(killed, "die", {{"signal", SIGKILL}}),
            "test_worker was ended by signal 9 in the middle of die");
  EXPECT_FALSE(killed.is_usable());
  EXPECT_EQ(job_error(killed, "echo", 1), "test_worker runs no more: it cannot do echo");
  Worker left(kProgram);
  EXPECT_EQ(job_error(left, "die", {{"signal", 0}, {"status", 3}}),
            "test_worker ended with status 3 in the middle of die");
}

TEST(Worker, NonsenseIsAJobErrorOfOneLine) {
  for (const std::string& text :
       std::vector<std::string>{"not JSON", "{}", "[1, 2]", R"({"result": 1)", R"({"progress": 3})",
                                R"({"error": {"kind": 1}})", R"({"surprise": 1})", std::string(100, '[')}) {
    Worker worker(kProgram);
    const std::string message = job_error(worker, "babble", {{"text", text}});
    EXPECT_TRUE(message.starts_with("test_worker does not answer babble as it should: ")) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    EXPECT_FALSE(worker.is_usable());
  }
}

TEST(Worker, AMissingProgramIsNamed) {
  const std::string why = refusal_of<InputError>([] { Worker("/nowhere/flexor-camera"); });
  EXPECT_TRUE(why.starts_with("/nowhere/flexor-camera is missing")) << why;
}

class WorkerFolder : public testing::Test {
 protected:
  Json half() const { return {{"out", (folder_ / "out").string()}, {"ready", (folder_ / "ready").string()}}; }

  fs::path temporary() const {
    for (int i = 0; i < 60000 && !fs::exists(folder_ / "ready"); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return read_file(folder_ / "ready");
  }

  void expect_nothing_half_written(const fs::path& temporary) const {
    const auto files = [&] { return std::distance(fs::directory_iterator(folder_), {}); };
    for (int i = 0; i < 5000 && (fs::exists(temporary) || files() > 1); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    EXPECT_FALSE(fs::exists(temporary));
    EXPECT_EQ(files(), 1) << "only the file that was finished";
  }

  // A process that has a worker in the middle of a job.
  pid_t start() const {
    const pid_t child = ::fork();
    if (child != 0) return child;
    if (std::freopen("/dev/null", "w", stderr) == nullptr) ::_exit(98);
    stop_on_signals(true);
    try {
      Worker worker(kProgram);
      worker.run("half", half());
    } catch (const Cancelled&) {
      end_by_signal();
    }
    ::_exit(99);
  }

  const TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path();
};

TEST_F(WorkerFolder, WhatIsHalfWrittenGoesWithWhoeverAsked) {
  for (const int signal : {SIGINT, SIGTERM, SIGKILL}) {
    const pid_t asker = start();
    const fs::path half_done = temporary();
    ASSERT_TRUE(fs::exists(half_done));
    ::kill(asker, signal);
    int status = 0;
    ::waitpid(asker, &status, 0);
    EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == signal);
    expect_nothing_half_written(half_done);
    fs::remove(folder_ / "ready");
  }
}

TEST(Worker, OfAnAskerThatThrowsIsUsedNoMore) {
  struct Enough {};
  Worker worker(kProgram);
  EXPECT_THROW(worker.run("count", {{"of", 1000000}, {"pause_ms", 1}},
                          [](const Progress&) -> bool { throw Enough(); }),
               Enough);
  EXPECT_FALSE(worker.is_usable());
}

TEST_F(WorkerFolder, AllJobsOfAFileAreDone) {
  std::ofstream(folder_ / "jobs") << R"({"job": "count", "arguments": {"of": 5, "pause_ms": 20}})" << '\n'
                                  << R"({"job": "echo", "arguments": 1})" << '\n'
                                  << R"({"job": "echo", "arguments": 2})";
  const int jobs = ::open((folder_ / "jobs").c_str(), O_RDONLY | O_CLOEXEC);
  const int replies = ::open((folder_ / "replies").c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
  Process worker(kProgram, {kProgram}, {{jobs, STDIN_FILENO}, {replies, STDOUT_FILENO}});
  EXPECT_EQ(worker.wait(), 0);
  ::close(jobs);
  ::close(replies);
  const std::string written = read_file(folder_ / "replies");
  EXPECT_TRUE(
      written.ends_with("{\"result\":{\"counted\":5,\"stopped\":false}}\n{\"result\":1}\n{\"result\":2}\n"))
      << written;
}

TEST_F(WorkerFolder, TheUsersStreamsAreTheJobs) {
  std::ofstream(folder_ / "in") << "three\nlines\nhere\n";
  const pid_t child = ::fork();
  if (child == 0) {
    if (std::freopen((folder_ / "in").c_str(), "r", stdin) == nullptr) ::_exit(98);
    if (std::freopen((folder_ / "out").c_str(), "w", stdout) == nullptr) ::_exit(98);
    Worker worker(kProgram);
    ::_exit(worker.run("copy", Json::object()) == 17 ? 0 : 1);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(read_file(folder_ / "out"), "three\nlines\nhere\n");
}

TEST(WorkerPool, ManyThreadsGetTheirOwnAnswers) {
  WorkerPool pool(kProgram);
  std::vector<std::jthread> threads;
  std::atomic<int> wrong = 0;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (int i = 0; i < 50; ++i) {
        try {
          if (i % 10 == 9) pool.run("die", {{"signal", SIGKILL}});
          if (pool.run("echo", 1000 * t + i) != 1000 * t + i) ++wrong;
        } catch (const JobError&) {
          if (i % 10 != 9) ++wrong;
        }
      }
    });
  }
  threads.clear();
  EXPECT_EQ(wrong, 0);
}

TEST(WorkerByHand, PrintsInOneLineWhatItIs) {
  const ProcessResult help = run_process({kProgram, "--help"});
  EXPECT_EQ(help.status, 0);
  EXPECT_EQ(help.out, "test_worker: a worker for tests; flexor starts it and speaks to it through pipes\n");
  const ProcessResult wrong = run_process({kProgram, "track", "video.mp4"});
  EXPECT_EQ(wrong.status, 2);
  EXPECT_EQ(wrong.err, help.out);
}

}  // namespace
}  // namespace flexor::io
