#include "apps/live/jobs.hpp"

#include <fmt/format.h>

#include <utility>

#include "host/io/io.hpp"

namespace flexor::live {

Jobs::~Jobs() {
  if (!job_) return;
  job_->is_cancelled = true;
  end();
}

void Jobs::require_none() const {
  if (job_) throw io::InputError(fmt::format("{} runs: wait for it, or cancel it", job_->name));
}

std::shared_ptr<Jobs::Job> Jobs::begin(const std::string& name, const std::string& stage) {
  require_none();
  job_ = std::make_shared<Job>();
  job_->name = name;
  job_->progress.stage = stage;
  return job_;
}

void Jobs::end() {
  const std::shared_ptr<Job> job = std::exchange(job_, nullptr);
  job->command.reset();
  if (job->thread.joinable()) job->thread.join();
}

void Jobs::run_command(const std::string& name, std::vector<std::string> arguments,
                       std::function<void(const CommandResult&)> done) {
  const std::shared_ptr<Job> job = begin(name, name);
  try {
    job->command = std::make_unique<Command>(
        program_, std::move(arguments),
        [this](const Progress& progress) {
          post_([this, progress] {
            if (job_) job_->progress = progress;
          });
        },
        [this, done = std::move(done)](CommandResult result) {
          post_([this, done, result = std::move(result)] {
            end();
            done(result);
          });
        });
  } catch (...) {
    job_.reset();
    throw;
  }
}

void Jobs::run(const std::string& name, const std::string& stage, std::function<void(const Goes&)> work,
               std::function<void(const std::string& trouble)> done) {
  const std::shared_ptr<Job> job = begin(name, stage);
  const Goes goes = [this, stage, job = job.get()](double share) {
    post_([this, stage, share] {
      if (job_) job_->progress = {stage, share, {}};
    });
    return !job->is_cancelled;
  };
  job->thread = std::thread([this, goes, work = std::move(work), done = std::move(done)] {
    std::string trouble;
    try {
      work(goes);
    } catch (const std::exception& error) {
      trouble = io::one_line(error.what());
    }
    post_([this, done, trouble] {
      end();
      done(trouble);
    });
  });
}

void Jobs::cancel() {
  if (!job_) throw io::InputError("nothing runs");
  job_->is_cancelled = true;
  if (job_->command) job_->command->cancel();
}

}  // namespace flexor::live
