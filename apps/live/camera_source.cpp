#include "apps/live/camera_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <utility>

namespace flexor::live {
namespace {

constexpr double kLeastStep_s = 1e-4;
constexpr std::array kRemarks = {"", "doubtful", "hidden", "lost"};

}  // namespace

CameraSource::CameraSource(std::string device, const std::string& joints, const std::string& lens,
                           const std::filesystem::path& program, std::function<double()> clock)
    : device_(std::move(device)), camera_(program), clock_(std::move(clock)) {
  camera_.open(joints, lens);
  for (const std::string& name : camera_.angles()) columns_.push_back(name + "_deg");
  for (const std::string& name : camera_.angles()) columns_.push_back(name + "_quality");
  last_deg_.resize(camera_.angles().size());
  const Grabbed first = camera_.grab(device_);
  says_ = fmt::format("{}: {} x {} pixels", device_, first.width, first.height);
  take(first);
  thread_ = std::jthread([this](const std::stop_token& stop) { watch(stop); });
}

void CameraSource::watch(const std::stop_token& stop) {
  try {
    bool ended = false;
    while (!stop.stop_requested() && !ended) {
      const Grabbed grabbed = camera_.grab(device_);
      ended = grabbed.ended;
      take(grabbed);
    }
    if (!ended) return;
    give(camera_.close());
    const std::lock_guard lock(mutex_);
    ended_ = true;
  } catch (...) {
    const std::lock_guard lock(mutex_);
    fault_ = std::current_exception();
  }
  came_.notify_all();
}

void CameraSource::take(const Grabbed& grabbed) {
  if (!grabbed.ended) {
    const double behind_s = now_s() - grabbed.t_s;
    behind_s_ = has_clock_ ? std::min(behind_s_, behind_s) : behind_s;
    has_clock_ = true;
  }
  give(grabbed.rows);
}

void CameraSource::give(const std::vector<SeenRow>& rows) {
  if (rows.empty()) return;
  const std::lock_guard lock(mutex_);
  const std::size_t n = last_deg_.size();
  for (const SeenRow& row : rows) {
    listen::Sample& sample = waiting_.emplace_back();
    sample.host_s = last_host_s_ = std::max(behind_s_ + row.t_s, last_host_s_ + kLeastStep_s);
    sample.board_s = row.t_s;
    sample.remark.resize(2 * n);
    for (std::size_t k = 0; k < n; ++k) {
      if (row.quality[k] != kLost) last_deg_[k] = row.deg[k];
      sample.remark[k] = kRemarks.at(static_cast<std::size_t>(row.quality[k]));
    }
    sample.value = last_deg_;
    sample.value.insert(sample.value.end(), row.quality.begin(), row.quality.end());
  }
  came_.notify_all();
}

double CameraSource::now_s() const {
  if (clock_) return clock_();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

listen::Event CameraSource::wait(double timeout_s, std::vector<listen::Sample>& out) {
  std::unique_lock lock(mutex_);
  came_.wait_for(lock, std::chrono::duration<double>(timeout_s),
                 [this] { return !waiting_.empty() || fault_ || ended_; });
  if (!waiting_.empty()) {
    tally_.samples += waiting_.size();
    std::ranges::move(waiting_, std::back_inserter(out));
    waiting_.clear();
    return listen::Event::samples;
  }
  if (fault_) std::rethrow_exception(fault_);
  return ended_ ? listen::Event::ended : listen::Event::quiet;
}

}  // namespace flexor::live
