// Both simulated boards in real time (host/study/bench.hpp) and a listener on the glove's port.
#pragma once

#include <exception>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "apps/live/worn_glove.hpp"
#include "host/io/io.hpp"
#include "host/listen/listener.hpp"

namespace flexor::live {

class BenchSource : public WornGlove {
 public:
  // In ordinary motion; takes as long as a Listener. `readings` as of listen::ListenerOptions. Throws as study::Bench and
  // listen::Listener.
  BenchSource(const std::filesystem::path& program, const study::BenchOptions& options, bool readings);

  // Throws what went wrong with the boards meanwhile.
  listen::Event wait(double timeout_s, std::vector<listen::Sample>& out) override;
  const std::vector<std::string>& columns() const override { return listener_->columns(); }
  const listen::Tally& tally() const override { return listener_->tally(); }
  double now_s() const override { return listener_->now_s(); }
  std::string description() const override { return "simulated boards: " + listener_->description(); }
  int descriptor() const override { return listener_->descriptor(); }
  bool takes_models() const override { return listener_->takes_models(); }
  void let_go() override { listener_->let_go(); }

  // Before the next 20 ms; from any thread.
  void set(const WornChange& change) override;
  void play(const std::string& motion, double pace) override;
  // As it was at most 20 ms ago, or before a score.
  study::BenchView now() const override;
  std::optional<double> begun_s() const override { return 0; }
  void load(const model::Model&) override { throw io::InputError("the boards take models at their port"); }
  Score score() override;  // study::Bench::score, of the boards with all that was sent to them before
  const study::Bench& bench() const { return bench_; }

 private:
  void advance();
  void run(const std::stop_token& stop);

  study::Bench bench_;
  std::mutex turn_;
  mutable std::mutex mutex_;
  study::BenchChange next_ = {.motion = "ordinary"};
  study::BenchView view_;
  std::exception_ptr fault_;
  std::unique_ptr<listen::Listener> listener_;
  std::jthread thread_;  // last, so that it ends first
};

}  // namespace flexor::live
