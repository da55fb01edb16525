#include "host/export/angles.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "host/io/io.hpp"
#include "host/recording/unit.hpp"

namespace flexor::exports {
namespace {

using io::InputError;
using recording::unit_of;

constexpr double kLost = 3;  // a camera's quality
constexpr double kMaxGap_s = 0.3;
constexpr double kLongestPause_s = 3600;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Says no unit, and is nothing that `flexor` itself writes beside angles.
bool may_be_an_angle(const std::string& column) {
  constexpr std::array kOther = {"host_s", "_status", "_quality", "_se"};
  return unit_of(column).empty() &&
         std::ranges::none_of(kOther, [&](const char* end) { return column.ends_with(end); });
}

}  // namespace

Angles::Angles(const std::filesystem::path& path, const AngleOptions& options)
    : source_(path == "-" ? "standard input" : path.string()),
      reader_(path, recording::TableOptions{options.columns, options.time, recording::Holes::all}),
      stream_(reader_, recording::Resets::follow),
      period_s_(options.rate_hz > 0 ? 1 / options.rate_hz : 0),
      whole_rows_(options.whole_rows) {
  if (options.columns.empty()) choose();
  find_joints();
  if (!options.ends_deg.empty()) turn(options.ends_deg);
  rename(options.names);
  if (period_s_ > 0) {
    resampler_.emplace(std::vector<recording::Range>(joints_.size()), period_s_,
                       std::max(kMaxGap_s, 5 * period_s_));
  }
}

void Angles::choose() {
  std::vector<std::string> angles;
  std::vector<std::string> left;
  for (std::size_t i = 0; i < reader_.columns().size(); ++i) {
    const std::string& column = reader_.columns()[i];
    const std::string& unit = reader_.units()[i];
    if ((unit == "deg" || unit == "rad") && !recording::without_unit(column).ends_with("_se"))
      angles.push_back(column);
    if (unit.empty() && may_be_an_angle(column)) left.push_back(column);
  }
  if (angles.empty()) {
    throw InputError(
        fmt::format("{}: no column is called NAME_deg or NAME_rad: name angles with --columns; there are {}",
                    source_, recording::listed(reader_.columns())));
  }
  if (!left.empty()) {
    notes_.push_back(fmt::format("{}: left out, as no unit is stated: {}; --columns names them", source_,
                                 recording::listed(left)));
  }
  reader_.choose(angles);
}

void Angles::find_joints() {
  std::vector<std::string> read = reader_.columns();
  for (std::size_t i = 0; i < reader_.columns().size(); ++i) {
    const std::string& column = reader_.columns()[i];
    const std::string& unit = reader_.units()[i];
    const std::string other = unit.empty() ? recording::unknown_angle_unit(column) : unit;
    if (!other.empty() && other != "deg" && other != "rad")
      throw InputError(fmt::format("{}: column \"{}\" is in {}: an angle in deg or rad is needed", source_,
                                   column, other));
    if (other.empty())
      notes_.push_back(
          fmt::format("{}: column \"{}\" states no unit and is taken as degrees", source_, column));
    joints_.push_back(recording::without_unit(column));
    places_.push_back({i, unit == "rad" ? 180 / std::numbers::pi : 1, {}});
    const std::string quality = joints_.back() + "_quality";
    if (!reader_.has(quality)) continue;
    places_.back().quality = read.size();
    read.push_back(quality);
  }
  reader_.choose(read);
}

void Angles::turn(const std::map<std::string, std::pair<double, double>>& ends_deg) {
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const auto ends = ends_deg.find(joints_[i]);
    if (ends == ends_deg.end())
      throw InputError(
          fmt::format("{}: --model has no joint {}: choose its joints with --columns", source_, joints_[i]));
    const auto [open_deg, fist_deg] = ends->second;
    places_[i].sign = fist_deg > open_deg ? 1 : -1;
    places_[i].zero_deg = places_[i].sign * open_deg;
  }
}

void Angles::rename(const std::vector<std::string>& names) {
  const std::vector<std::string> before = joints_;
  for (const std::string& pair : names) {
    const std::size_t at = pair.find('=');
    if (at == std::string::npos || at == 0 || at + 1 == pair.size())
      throw InputError(fmt::format("--names {}: OLD=NEW is needed, such as index_mcp=finger_flexion", pair));
    const auto joint = std::ranges::find(before, pair.substr(0, at));
    if (joint == before.end())
      throw InputError(fmt::format("--names {}: {} has no joint {}; there are {}", pair, source_,
                                   pair.substr(0, at), recording::listed(before)));
    joints_[static_cast<std::size_t>(joint - before.begin())] = pair.substr(at + 1);
  }
  for (auto joint = joints_.begin(); joint != joints_.end(); ++joint) {
    if (std::find(joints_.begin(), joint, *joint) == joint) continue;
    throw InputError(fmt::format(
        "{}: two columns are the joint {}: choose with --columns, or call one otherwise with --names",
        source_, *joint));
  }
}

bool Angles::read(AngleRow& row) {
  recording::Row from;
  do {
    if (!stream_.next(from)) return false;
  } while (read_s_ && from.t_s <= *read_s_ && ++bursts_ > 0);
  read_s_ = row.t_s = from.t_s;
  row.angle_deg.clear();
  for (const Joint& joint : places_) {
    const bool lost = joint.quality && from.value[*joint.quality] >= kLost;
    lost_ += lost ? 1 : 0;
    const double angle_deg = from.value[joint.column] * joint.to_deg;
    row.angle_deg.push_back(lost ? kNaN : joint.sign * angle_deg - joint.zero_deg);
  }
  return true;
}

// The resampler begins anew after a long pause: the grid's points that it passed over are not known.
void Angles::resample(const AngleRow& row) {
  resampler_->push(row.t_s, row.angle_deg, [&](const recording::Sample& s) {
    if (points_ == 0) grid_s_ = s.t_s;
    const auto due_s = [&] { return grid_s_ + static_cast<double>(points_) * period_s_; };
    const double passed_s = s.t_s - due_s();
    if (passed_s > kLongestPause_s) {
      throw InputError(fmt::format("{}: nothing for {:.0f} s after {:.1f} s: export the parts one by one",
                                   source_, passed_s, due_s()));
    }
    for (auto passed = std::llround(passed_s / period_s_); passed >= 0; --passed, ++points_) {
      ready_.push_back({due_s(), {s.value.begin(), s.value.end()}});
      if (passed == 0 && !s.pause) continue;
      std::ranges::fill(ready_.back().angle_deg, kNaN);
      ++paused_;
    }
  });
}

bool Angles::sample(AngleRow& row) {
  while (ready_.empty()) {
    AngleRow raw;
    if (!read(raw)) return false;
    resample(raw);
  }
  row = std::move(ready_.front());
  ready_.pop_front();
  return true;
}

bool Angles::next(AngleRow& row) {
  const auto is_known = [](double angle_deg) { return !std::isnan(angle_deg); };
  do {
    if (!(resampler_ ? sample(row) : read(row))) {
      if (rows_ > 0) return false;
      throw InputError(
          fmt::format("{}: no row with {}", source_, whole_rows_ ? "all its angles" : "an angle"));
    }
  } while (whole_rows_ && !std::ranges::all_of(row.angle_deg, is_known) && ++unknown_ > 0);
  if (rows_++ == 0) first_s_ = row.t_s;
  last_s_ = row.t_s;
  return true;
}

std::vector<std::string> Angles::notes() const {
  std::vector<std::string> out = stream_.notes();
  out.insert(out.end(), notes_.begin(), notes_.end());
  const auto say = [&](std::size_t count, const char* what) {
    if (count > 0) out.push_back(fmt::format("{}: {} {}", source_, count, what));
  };
  say(bursts_, "row(s) have the time of the row before and are left out");
  say(lost_, "angle(s) were lost by the camera: they are written as not known");
  say(paused_, "row(s) lie in pauses of the log: their angles are written as not known");
  say(unknown_,
      "row(s) with an angle that is not known are left out: OpenSim reads no further than such a row");
  return out;
}

Written Angles::written(std::vector<std::string> files) const {
  return {std::move(files), joints_, rows_, last_s_ - first_s_, 0, notes()};
}

}  // namespace flexor::exports
