#include "host/export/angles.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <limits>
#include <numbers>
#include <set>

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

// "index_mcp_deg", "index_mcp (deg)" -> index_mcp.
std::string joint_of(const std::string& column) {
  std::string name(recording::trimmed(column));
  const std::string unit = recording::cut_name(name).unit;
  if (unit.empty() || unit_of(name).empty()) return name;
  const std::size_t at = name.rfind(unit);
  name.resize(name.find_last_not_of(" _([", at - 1) + 1);
  return name.empty() ? std::string(recording::trimmed(column)) : name;
}

bool is_angle(const std::string& column) {
  const std::string unit = unit_of(column);
  return (unit == "deg" || unit == "rad") && !joint_of(column).ends_with("_se");
}

// Says no unit, and is nothing that `flexor` itself writes beside angles.
bool may_be_an_angle(const std::string& column) {
  constexpr std::array kOther = {"host_s", "_status", "_quality", "_se"};
  return unit_of(column).empty() &&
         std::ranges::none_of(kOther, [&](const char* end) { return column.ends_with(end); });
}

std::string list_of(const std::vector<std::string>& names) {
  std::string out;
  for (const std::string& name : names) out += (out.empty() ? "" : ", ") + name;
  return out;
}

}  // namespace

Angles::Angles(const std::filesystem::path& path, const AngleOptions& options)
    : source_(path == "-" ? "standard input" : path.string()),
      period_s_(options.rate_hz > 0 ? 1 / options.rate_hz : 0) {
  recording::CsvOptions csv{{}, options.time_unit};
  if (path == "-") {
    reader_ = std::make_unique<recording::CsvReader>(std::cin, source_, csv);
    choose(reader_->columns(), options);
  } else {
    const std::vector<std::string> there = recording::columns_of(path, options.time_unit);
    choose(there, options);
    csv.columns = chosen_;
    for (const std::string& column : chosen_) {
      const std::string quality = joint_of(column) + "_quality";
      if (std::ranges::find(there, quality) != there.end()) csv.columns.push_back(quality);
    }
    file_.open(path, std::ios::binary);
    reader_ = std::make_unique<recording::CsvReader>(file_, source_, csv);
  }
  stream_ = std::make_unique<recording::Stream>(*reader_, recording::Resets::follow);
  find_joints();
  rename(options.names);
  require_different();
  if (period_s_ > 0) {
    resampler_.emplace(std::vector<recording::Range>(joints_.size()), period_s_,
                       std::max(kMaxGap_s, 5 * period_s_));
  }
}

void Angles::choose(const std::vector<std::string>& there, const AngleOptions& options) {
  chosen_ = options.columns;
  if (!chosen_.empty()) return;
  std::ranges::copy_if(there, std::back_inserter(chosen_), is_angle);
  std::vector<std::string> left;
  std::ranges::copy_if(there, std::back_inserter(left), may_be_an_angle);
  if (!chosen_.empty() && !left.empty())
    notes_.push_back(
        fmt::format("{}: left out, as no unit is stated: {}; --columns names them", source_, list_of(left)));
  if (!chosen_.empty()) return;
  throw InputError(
      fmt::format("{}: no column is called NAME_deg or NAME_rad: name angles with --columns; there are {}",
                  source_, list_of(there)));
}

void Angles::find_joints() {
  const std::vector<std::string>& there = reader_->columns();
  const auto place = [&](const std::string& name) -> std::optional<std::size_t> {
    const auto at = std::ranges::find(there, name);
    if (at == there.end()) return std::nullopt;
    return static_cast<std::size_t>(at - there.begin());
  };
  for (const std::string& column : chosen_) {
    const auto at = place(column);
    if (!at)
      throw InputError(fmt::format("{}: no column \"{}\"; there are {}", source_, column, list_of(there)));
    const std::string unit = reader_->units()[*at];
    const std::string other = unit.empty() ? recording::unknown_angle_unit(column) : unit;
    if (!other.empty() && other != "deg" && other != "rad")
      throw InputError(fmt::format("{}: column \"{}\" is in {}: an angle in deg or rad is needed", source_,
                                   column, other));
    if (other.empty())
      notes_.push_back(
          fmt::format("{}: column \"{}\" states no unit and is taken as degrees", source_, column));
    joints_.push_back(joint_of(column));
    places_.push_back({*at, unit == "rad" ? 180 / std::numbers::pi : 1, place(joints_.back() + "_quality")});
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
                                   pair.substr(0, at), list_of(before)));
    joints_[static_cast<std::size_t>(joint - before.begin())] = pair.substr(at + 1);
  }
}

void Angles::require_different() const {
  std::set<std::string> seen;
  for (const std::string& joint : joints_) {
    if (!seen.insert(joint).second)
      throw InputError(fmt::format(
          "{}: two columns are the joint {}: choose with --columns, or call one otherwise with --names",
          source_, joint));
  }
}

bool Angles::read(AngleRow& row) {
  recording::Row from;
  do {
    if (!stream_->next(from)) return false;
  } while (last_s_ && from.t_s <= *last_s_ && ++bursts_ > 0);
  last_s_ = row.t_s = from.t_s;
  row.angle_deg.clear();
  for (const Joint& joint : places_) {
    const bool lost = joint.quality && from.value[*joint.quality] >= kLost;
    lost_ += lost ? 1 : 0;
    row.angle_deg.push_back(lost ? kNaN : from.value[joint.column] * joint.to_deg);
  }
  return true;
}

void Angles::put(std::vector<double> angle_deg) {
  ready_.push_back({due(), std::move(angle_deg)});
  ++points_;
}

// The grid's points before this one that the resampler passed over: it begins anew after a long pause.
void Angles::fill(double until_s) {
  if (until_s - due() > kLongestPause_s) {
    throw InputError(fmt::format("{}: nothing for {:.0f} s after {:.1f} s: export the parts one by one",
                                 source_, until_s - due(), due()));
  }
  for (auto missing = std::llround((until_s - due()) / period_s_); missing > 0; --missing) {
    put(std::vector<double>(joints_.size(), kNaN));
    ++paused_;
  }
}

void Angles::resample(const AngleRow& row) {
  resampler_->push(row.t_s, row.angle_deg, [&](const recording::Sample& s) {
    if (!first_s_) first_s_ = s.t_s;
    fill(s.t_s);
    std::vector<double> value(s.value.begin(), s.value.end());
    if (s.pause) std::ranges::fill(value, kNaN);
    paused_ += s.pause ? 1 : 0;
    put(std::move(value));
  });
}

bool Angles::next(AngleRow& row) {
  if (!resampler_) return read(row);
  while (ready_.empty()) {
    AngleRow raw;
    if (!read(raw)) return false;
    resample(raw);
  }
  row = std::move(ready_.front());
  ready_.pop_front();
  return true;
}

std::vector<std::string> Angles::notes() const {
  std::vector<std::string> out = stream_->notes();
  out.insert(out.end(), notes_.begin(), notes_.end());
  const auto say = [&](std::size_t count, const char* what) {
    if (count > 0) out.push_back(fmt::format("{}: {} {}", source_, count, what));
  };
  say(bursts_, "row(s) have the time of the row before and are left out");
  say(lost_, "angle(s) were lost by the camera: they are written as not known");
  say(paused_, "row(s) lie in pauses of the log: their angles are written as not known");
  return out;
}

}  // namespace flexor::exports
