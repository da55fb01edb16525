// What takes long: a command of `flexor` in a process of its own (host/io/worker.hpp), so that a crash there does not end the
// glove's recording; or work on a thread. One at a time; what comes of it comes back to the server's thread.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "host/io/worker.hpp"

namespace flexor::live {

struct JobResult {
  bool ok = false;
  nlohmann::ordered_json json;  // what the command prints with --json
  std::string text;             // why it failed
  std::vector<std::string> warnings() const;
};

class Jobs {
 public:
  // Runs it on the server's thread.
  using Post = std::function<void(std::function<void()>)>;
  // Reports how far work is; it is wanted no longer when it gets false.
  using Goes = std::function<bool(const io::Progress&)>;
  // Is called when nothing runs any more.
  using Done = std::function<void(const JobResult&)>;

  Jobs(std::filesystem::path program, Post post) : program_(std::move(program)), post_(std::move(post)) {}
  ~Jobs() { cancel(); }  // ends what runs
  Jobs(const Jobs&) = delete;
  Jobs& operator=(const Jobs&) = delete;

  bool is_running() const { return job_ != nullptr; }
  bool is_running(const std::string& name) const { return job_ && job_->name == name; }
  const std::string& name() const { return job_->name; }           // of what runs
  const io::Progress& progress() const { return job_->progress; }  // likewise

  void require_none() const;  // throws Refusal
  // `flexor job NAME`. Throws Refusal where something runs, io::JobError where a process cannot be started.
  void run_command(const std::string& name, const nlohmann::ordered_json& request, Done done);
  // `work` runs on a thread of its own.
  void run(const std::string& name, const std::string& stage,
           std::function<nlohmann::ordered_json(const Goes&)> work, Done done);
  void cancel();

 private:
  struct Job {
    std::string name;
    io::Progress progress;
    std::atomic<bool> is_cancelled = false;
    std::shared_ptr<io::Worker> worker;  // none: it runs on the thread
    std::jthread thread;                 // last, so that it ends first
  };

  std::filesystem::path program_;
  Post post_;
  std::shared_ptr<Job> job_;
};

}  // namespace flexor::live
