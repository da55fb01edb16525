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
    throw io::InputError(fmt::format("--speed {}: must lie between {} and {}", speed, kSlowest, kFastest));
  recording::CsvReader reader(file, {{}, time, recording::Holes::all});
  recording::Recording recording = recording::read(reader, recording::Resets::follow);
  for (recording::Column& column : recording.columns) {
    if (column.name == "host_s") continue;
    columns_.push_back(std::move(column.name));
    value_.push_back(std::move(column.value));
  }
  if (columns_.empty()) throw io::InputError(name_ + ": has no column beside its times");
  t_s_ = std::move(recording.t_s);
  const double first_s = t_s_.empty() ? 0 : t_s_.front();
  for (double& t : t_s_) t -= first_s;
  warnings_ = std::move(recording.warnings);
  start_ = std::chrono::steady_clock::now();  // what reading the file took is no part of it
}

double ReplaySource::now_s() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

std::string ReplaySource::says() const {
  return fmt::format("{}: {} rows in {:.1f} s", name_, t_s_.size(), duration_s());
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
  next_ = static_cast<std::size_t>(std::ranges::lower_bound(t_s_, from_s_) - t_s_.begin());
}

void ReplaySource::pause(bool on) {
  if (on == paused_) return;
  go_on_from(position_s());
  paused_ = on;
}

// Rows that are due.
bool ReplaySource::take(std::vector<Sample>& out) {
  const double here_s = position_s();
  const std::size_t before = next_;
  for (; next_ < t_s_.size() && t_s_[next_] <= here_s; ++next_) {
    Sample& sample = out.emplace_back();
    sample.host_s = from_now_s_ + (t_s_[next_] - from_s_) / speed_;
    sample.board_s = t_s_[next_];
    for (const std::vector<double>& column : value_) sample.value.push_back(column[next_]);
  }
  tally_.samples += next_ - before;
  return next_ > before;
}

Event ReplaySource::wait(double timeout_s, std::vector<Sample>& out) {
  if (!paused_) {
    if (take(out)) return Event::samples;
    if (next_ == t_s_.size()) return Event::ended;
    timeout_s = std::min(timeout_s, (t_s_[next_] - position_s()) / speed_);
  }
  std::this_thread::sleep_for(std::chrono::duration<double>(std::max(0.0, timeout_s)));
  return !paused_ && take(out) ? Event::samples : Event::quiet;
}

}  // namespace flexor::listen
