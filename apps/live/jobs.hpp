// What takes long: a command of `flexor` in a process of its own (command.hpp), or work on a thread. One at a time; what comes
// of it comes back to the server's thread.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "apps/live/command.hpp"

namespace flexor::live {

class Jobs {
 public:
  // Runs it on the server's thread.
  using Post = std::function<void(std::function<void()>)>;
  // Says how far work is; it is wanted no longer when it gets false.
  using Goes = std::function<bool(double share)>;

  Jobs(std::filesystem::path program, Post post) : program_(std::move(program)), post_(std::move(post)) {}
  ~Jobs();  // ends what runs
  Jobs(const Jobs&) = delete;
  Jobs& operator=(const Jobs&) = delete;

  bool is_running() const { return job_ != nullptr; }
  bool is_running(const std::string& name) const { return job_ && job_->name == name; }
  const std::string& name() const { return job_->name; }       // of what runs
  const Progress& progress() const { return job_->progress; }  // likewise

  void require_none() const;  // throws io::InputError
  // `done` is called when nothing runs any more. Throws io::InputError where something does, io::JobError where a process cannot
  // be started.
  void run_command(const std::string& name, std::vector<std::string> arguments,
                   std::function<void(const CommandResult&)> done);
  // `work` runs on a thread of its own; `done` gets why it failed, or nothing.
  void run(const std::string& name, const std::string& stage, std::function<void(const Goes&)> work,
           std::function<void(const std::string& trouble)> done);
  void cancel();  // throws io::InputError where nothing runs

 private:
  struct Job {
    std::string name;
    Progress progress;
    std::atomic<bool> is_cancelled = false;
    std::unique_ptr<Command> command;
    std::thread thread;
  };

  std::shared_ptr<Job> begin(const std::string& name, const std::string& stage);
  void end();

  std::filesystem::path program_;
  Post post_;
  std::shared_ptr<Job> job_;
};

}  // namespace flexor::live
