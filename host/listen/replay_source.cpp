#include "host/listen/replay_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <thread>

#include "host/io/io.hpp"
#include "host/recording/csv.hpp"

namespace flexor::listen {

ReplaySource::ReplaySource(const std::filesystem::path& file, double speed,
                           const recording::TimeOptions& time)
    : name_(file.string()), speed_(speed) {
  constexpr double kSlowest = 0.01;
  constexpr double kFastest = 1000;
  if (!(speed >= kSlowest && speed <= kFastest))
    throw io::InputError("--speed {}: must lie between {} and {}", speed, kSlowest, kFastest);
  recording::CsvReader reader(file, {{}, time, recording::Holes::all});
  recording_ = recording::read(reader, recording::Resets::follow);
  std::erase_if(recording_.columns, [](const auto& column) { return column.name == recording::kHostClock; });
  for (const recording::Column& column : recording_.columns) columns_.push_back(column.name);
  if (columns_.empty()) throw io::InputError(name_ + ": has no column beside its times");
  const double first_s = recording_.t_s.front();
  for (double& t : recording_.t_s) t -= first_s;
  start_ = std::chrono::steady_clock::now();  // what reading the file took is no part of it
}

std::string ReplaySource::description() const {
  return fmt::format("{}: {} rows in {:.1f} s", name_, recording_.t_s.size(), duration_s());
}

double ReplaySource::position_s() const {
  if (paused_) return from_s_;
  return std::min(from_s_ + (now_s() - from_now_s_) * speed_, duration_s());
}

void ReplaySource::go_on_from(double t_s) {
  from_s_ = t_s;
  from_now_s_ = now_s();
}

void ReplaySource::seek(double t_s) {
  go_on_from(std::clamp(t_s, 0.0, duration_s()));
  next_ =
      static_cast<std::size_t>(std::ranges::lower_bound(recording_.t_s, from_s_) - recording_.t_s.begin());
}

void ReplaySource::pause(bool on) {
  if (on == paused_) return;
  go_on_from(position_s());
  paused_ = on;
}

bool ReplaySource::take(std::vector<Sample>& out) {
  const double here_s = position_s();
  const std::size_t before = next_;
  const std::vector<double>& t_s = recording_.t_s;
  for (; next_ < t_s.size() && t_s[next_] <= here_s; ++next_) {
    Sample& sample = out.emplace_back();
    sample.host_s = from_now_s_ + (t_s[next_] - from_s_) / speed_;
    sample.board_s = t_s[next_];
    for (const recording::Column& column : recording_.columns) sample.value.push_back(column.value[next_]);
  }
  tally_.samples += next_ - before;
  return next_ > before;
}

Event ReplaySource::wait(double timeout_s, std::vector<Sample>& out) {
  if (!paused_) {
    if (take(out)) return Event::samples;
    if (next_ == recording_.t_s.size()) return Event::ended;
    timeout_s = std::min(timeout_s, (recording_.t_s[next_] - position_s()) / speed_);
  }
  std::this_thread::sleep_for(std::chrono::duration<double>(std::max(0.0, timeout_s)));
  return !paused_ && take(out) ? Event::samples : Event::quiet;
}

}  // namespace flexor::listen
