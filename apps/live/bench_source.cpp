#include "apps/live/bench_source.hpp"

#include <utility>

namespace flexor::live {

BenchSource::BenchSource(const std::filesystem::path& program, study::BenchOptions options,
                         const study::BenchChange& begin, bool readings)
    : bench_(program, options), next_(begin) {
  view_ = bench_.advance(std::exchange(next_, {}));
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  listen::ListenerOptions listening;
  listening.port = bench_.port();
  listening.baud = 9600;  // of the boards' line, as deployed
  listening.format = listen::Format::frames;
  listening.readings = readings;
  listener_ = std::make_unique<listen::Listener>(std::move(listening), [](const std::string&) {});
}

void BenchSource::advance() {
  const std::lock_guard turn(turn_);  // what one thread has taken is done before another goes on
  study::BenchChange change;
  {
    const std::lock_guard lock(mutex_);
    change = std::exchange(next_, {});
  }
  study::BenchView view = bench_.advance(change);
  const std::lock_guard lock(mutex_);
  view_ = std::move(view);
}

WornGlove::Score BenchSource::score() {
  return [this](const Jobs::Goes& goes) {
    advance();
    return bench_.score({1, 2, 3, 4, 5, 6}, [&](std::size_t done, std::size_t of) {
      return goes({"six gestures", done, of});
    });
  };
}

void BenchSource::run(const std::stop_token& stop) {
  try {
    while (!stop.stop_requested()) advance();
  } catch (...) {
    const std::lock_guard lock(mutex_);
    fault_ = std::current_exception();
  }
}

void BenchSource::set(const WornChange& change) {
  const std::lock_guard lock(mutex_);
  next_.slip_deg = change.slip_deg;
  next_.drift_deg_per_min = change.drift_deg_per_min;
  next_.noise_counts = change.noise_counts;
  next_.loss = change.loss;
}

void BenchSource::play(const std::string& motion, double) {
  (void)study::bench_motion(motion);  // whether there is one
  const std::lock_guard lock(mutex_);
  next_.motion = motion;
  next_.restart = true;
}

WornNow BenchSource::now() const {
  const std::lock_guard lock(mutex_);
  WornNow out;
  for (std::size_t f = 0; f < twin::kFingers; ++f) {
    out.finger_deg[f] = view_.finger_deg[f];
    out.joint_deg[f] = view_.joint_deg[f];
    if (view_.fault[f] != 0) out.fault[f] = "fault " + std::to_string(view_.fault[f]);
  }
  return out;
}

listen::Event BenchSource::wait(double timeout_s, std::vector<listen::Sample>& out) {
  {
    const std::lock_guard lock(mutex_);
    if (fault_) std::rethrow_exception(fault_);
  }
  return listener_->wait(timeout_s, out);
}

}  // namespace flexor::live
