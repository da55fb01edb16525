#include "apps/live/jobs.hpp"

#include <utility>

#include "apps/live/words.hpp"
#include "host/io/io.hpp"

namespace flexor::live {

std::vector<std::string> JobResult::warnings() const {
  const auto found = json.find("warnings");
  return found == json.end() ? std::vector<std::string>() : found->get<std::vector<std::string>>();
}

void Jobs::require_none() const {
  if (job_) throw Refusal("job_runs", {{"job", job_->name}});
}

void Jobs::run_command(const std::string& name, const nlohmann::ordered_json& request, Done done) {
  const auto worker = std::make_shared<io::Worker>(program_, std::vector<std::string>{"job"});
  run(
      name, name, [=](const Goes& goes) { return worker->run(name, request, goes); }, std::move(done));
  job_->worker = worker;
}

void Jobs::run(const std::string& name, const std::string& stage,
               std::function<nlohmann::ordered_json(const Goes&)> work, Done done) {
  require_none();
  job_ = std::make_shared<Job>();
  job_->name = name;
  job_->progress.stage = stage;
  const Goes goes = [this, job = job_.get()](const io::Progress& progress) {
    post_([this, progress] {
      if (job_) job_->progress = progress;
    });
    return !job->is_cancelled;
  };
  job_->thread = std::jthread([this, job = job_.get(), goes, work = std::move(work), done = std::move(done)] {
    JobResult result;
    try {
      result.json = work(goes);
      result.ok = !job->is_cancelled;
    } catch (const std::exception& error) {
      result.text = io::one_line(error.what());
    }
    if (job->is_cancelled) result.text = "ended before its time";
    post_([this, done, result] {
      job_.reset();
      done(result);
    });
  });
}

void Jobs::cancel() {
  if (!job_) return;
  job_->is_cancelled = true;
  if (job_->worker) job_->worker->end();
}

}  // namespace flexor::live
