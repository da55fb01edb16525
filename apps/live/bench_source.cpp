#include "apps/live/bench_source.hpp"

#include <utility>

namespace flexor::live {

BenchSource::BenchSource(const std::filesystem::path& program, const study::BenchOptions& options,
                         bool readings)
    : bench_(program, options), view_(bench_.advance(next_)) {
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
    change = next_;
    next_.restart = false;
  }
  study::BenchView view = bench_.advance(change);
  const std::lock_guard lock(mutex_);
  view_ = view;
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
  next_.worn = change;
}

void BenchSource::play(const std::string& motion, double) {
  (void)study::bench_motion(motion);  // whether there is one
  const std::lock_guard lock(mutex_);
  next_.motion = motion;
  next_.restart = true;
}

study::BenchView BenchSource::now() const {
  const std::lock_guard lock(mutex_);
  return view_;
}

listen::Event BenchSource::wait(double timeout_s, std::vector<listen::Sample>& out) {
  {
    const std::lock_guard lock(mutex_);
    if (fault_) std::rethrow_exception(fault_);
  }
  return listener_->wait(timeout_s, out);
}

}  // namespace flexor::live
