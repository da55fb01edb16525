#include "apps/live/camera_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
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
  const auto [first, came_s] = next();
  description_ = fmt::format("{}: {} x {} pixels", device_, first.width, first.height);
  behind_s_ = came_s - first.t_s;
  coming_ = std::async(std::launch::async, &CameraSource::next, this);
}

CameraSource::Came CameraSource::next() {
  Grabbed picture = camera_.grab(device_);
  return {picture, picture.ended ? 0 : now_s()};
}

listen::Sample CameraSource::sample_of(const SeenRow& row) {
  last_host_s_ = std::max(behind_s_ + row.t_s, last_host_s_ + kLeastStep_s);
  listen::Sample out{last_host_s_, row.t_s, {}, {}};
  out.remark.resize(2 * last_deg_.size());
  for (std::size_t k = 0; k < last_deg_.size(); ++k) {
    if (row.quality[k] != kLost) last_deg_[k] = row.deg[k];
    out.remark[k] = kRemarks.at(static_cast<std::size_t>(row.quality[k]));
  }
  out.value = last_deg_;
  out.value.insert(out.value.end(), row.quality.begin(), row.quality.end());
  return out;
}

listen::Event CameraSource::wait(double timeout_s, std::vector<listen::Sample>& out) {
  if (!coming_.valid()) return listen::Event::ended;
  const std::chrono::duration<double> wait(timeout_s);
  if (coming_.wait_for(wait) != std::future_status::ready) return listen::Event::quiet;
  Came came = coming_.get();
  std::vector<SeenRow>& rows = came.picture.rows;
  if (came.picture.ended) {
    rows = camera_.close();
  } else {
    behind_s_ = std::min(behind_s_, came.at_s - came.picture.t_s);
    coming_ = std::async(std::launch::async, &CameraSource::next, this);
  }
  for (const SeenRow& row : rows) out.push_back(sample_of(row));
  tally_.samples += rows.size();
  return rows.empty() ? listen::Event::quiet : listen::Event::samples;
}

}  // namespace flexor::live
