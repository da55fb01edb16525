// Jobs that a page starts, what came of scores and experiments, and whose a board's port is while one runs.
#pragma once

#include "apps/live/jobs.hpp"
#include "apps/live/worn.hpp"

namespace flexor::live {

class JobRunner : public Jobs {
 public:
  JobRunner(Context& context, GlovePort& glove, Worn& worn);  // adds its words

  // A command of `flexor`. How it ended is reported; `done` goes on from there.
  void start(const std::string& name, const Json& request, Done done);
  bool has_port() const { return is_running("send") || is_running("flash"); }
  void send(const std::function<void()>& sent);  // the model into the glove
  void write(Json& state) const;

 private:
  Done ending(const std::string& name, Done done);
  void start_without_glove(const std::string& name, const Json& request, Done done);
  void flash(io::JsonReader& parts);
  void run_experiment(int trials);
  void run_score(const std::string& label);

  Context& context_;
  GlovePort& glove_;
  Worn& worn_;
  Json scores_ = Json::array();
  Json experiment_ = nullptr;
};

}  // namespace flexor::live
