#include "apps/live/jobs.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <deque>

#include "host/io/io.hpp"

namespace flexor::live {
namespace jobs_test {

// This thread is the server's.
class JobsTest : public testing::Test {
 protected:
  JobResult run(const std::string& name, const nlohmann::ordered_json& request, bool cancel = false) {
    std::optional<JobResult> out;
    jobs_.run_command(name, request, [&](const JobResult& result) { out = result; });
    if (cancel) jobs_.cancel();
    while (!out) {
      std::unique_lock lock(mutex_);
      posted_.wait(lock, [&] { return !works_.empty(); });
      const std::function<void()> work = std::move(works_.front());
      works_.pop_front();
      lock.unlock();
      work();
    }
    return *out;
  }

  io::TemporaryFolder folder_;
  std::mutex mutex_;
  std::condition_variable posted_;
  std::deque<std::function<void()>> works_;
  Jobs jobs_{FLEXOR_PROGRAM, [this](std::function<void()> work) {
               const std::lock_guard lock(mutex_);
               works_.push_back(std::move(work));
               posted_.notify_all();
             }};
};

TEST_F(JobsTest, AFailureIsItsErrorsText) {
  const JobResult r = run("show", {{"model", "/none/there.json"}});
  EXPECT_FALSE(r.ok);
  EXPECT_TRUE(r.text.starts_with("/none/there.json")) << r.text;
}

TEST_F(JobsTest, WhatItWarnsOfIsKept) {
  std::string text = "t_s,index_count,middle_count\n";
  for (int k = 0; k < 320; ++k)
    text += fmt::format("{:.2f},{},{}\n", 0.05 * k, k / 80 % 2 == 0 ? 300 : 500, 360 + k % 3);
  io::write_file(folder_.path() / "a, log.csv", text);
  const JobResult r = run("identify", {{"poses", (folder_.path() / "a, log.csv").string()},
                                       {"rate", 20},
                                       {"model", (folder_.path() / "model.json").string()}});
  ASSERT_TRUE(r.ok) << r.text;
  ASSERT_EQ(r.warnings().size(), 1U);
  EXPECT_NE(r.warnings()[0].find("middle_count hardly moves"), std::string::npos) << r.warnings()[0];
}

TEST_F(JobsTest, IsEndedAtOnce) {
  const JobResult r = run("experiment", {{"trials", 10000}}, true);
  EXPECT_FALSE(r.ok);
  EXPECT_EQ(r.text, "ended before its time");
}

}  // namespace jobs_test
}  // namespace flexor::live
