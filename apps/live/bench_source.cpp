#include "apps/live/bench_source.hpp"

#include <utility>

namespace flexor::live {
namespace {

constexpr unsigned kBaud = 9600;  // of the boards' line, as deployed

template <class T>
void take(std::optional<T>& to, const std::optional<T>& from) {
  if (from) to = from;
}

}  // namespace

BenchSource::BenchSource(const std::filesystem::path& program, study::BenchOptions options,
                         const study::BenchChange& begin, bool readings)
    : bench_(program, options), next_(begin) {
  view_ = bench_.advance(std::exchange(next_, {}));
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  listen::ListenerOptions listening;
  listening.port = bench_.port();
  listening.baud = kBaud;
  listening.format = listen::Format::frames;
  listening.readings = readings;
  listener_ = std::make_unique<listen::Listener>(std::move(listening), [](const std::string&) {});
}

BenchSource::~BenchSource() {
  thread_.request_stop();
  thread_.join();
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

std::vector<double> BenchSource::score(const std::vector<int>& gestures, const io::JobProgress& progress) {
  advance();
  return bench_.score(gestures, progress);
}

void BenchSource::run(const std::stop_token& stop) {
  try {
    while (!stop.stop_requested()) advance();
  } catch (...) {
    const std::lock_guard lock(mutex_);
    fault_ = std::current_exception();
  }
}

void BenchSource::change(const study::BenchChange& c) {
  const std::lock_guard lock(mutex_);
  take(next_.slip_deg, c.slip_deg);
  take(next_.drift_deg_per_min, c.drift_deg_per_min);
  take(next_.noise_counts, c.noise_counts);
  take(next_.loss, c.loss);
  take(next_.motion, c.motion);
  take(next_.unplugged, c.unplugged);
  next_.restart = next_.restart || c.restart;
}

study::BenchView BenchSource::view() const {
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
