#include "host/study/recorded_motion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <sstream>

#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/model/model.hpp"
#include "host/recording/csv.hpp"
#include "host/recording/resample.hpp"

namespace flexor::study {
namespace {

using io::InputError;
using twin::kFingers;

// What is kept in memory grows with the rows, not with the time between them.
constexpr double kLongestPause_s = 60;

// From 0. `row(i)` gives where sample i is.
std::vector<double> motion_time(const std::vector<double>& t_s, const std::string& file,
                                const std::function<std::string(std::size_t)>& row) {
  if (t_s.size() < 2) throw InputError("{}: a motion needs at least two rows", file);
  for (std::size_t i = 1; i < t_s.size(); ++i) {
    const double pause_s = t_s[i] - t_s[i - 1];
    if (pause_s > kLongestPause_s) {
      throw InputError(
          "{}: {}: its time is {:g} s after the row before, and a motion pauses {:g} s "
          "at most; mend or remove the row",
          file, row(i), pause_s, kLongestPause_s);
    }
  }
  const double lasts_s = t_s.back() - t_s.front();
  if (!(lasts_s >= 0.01 && lasts_s <= twin::kMaxDuration_s)) {
    throw InputError("{}: lasts {:g} s; a motion lasts 0.01 to {:g} s", file, lasts_s, twin::kMaxDuration_s);
  }
  return recording::since_start(t_s);
}

// The row of a log that has this time, as an editor counts.
std::string row_at(const std::string& text, const std::vector<std::string>& columns, double t_s) {
  std::istringstream stream(text);
  recording::CsvReader reader(stream, "", {.columns = columns, .time = {}});
  for (recording::Row row; reader.next(row);)
    if (row.t_s == t_s) return fmt::format("row {}", row.line);
  return fmt::format("time {:g}", t_s);
}

constexpr recording::Range kHand_deg[] = {{90, 170}, {28, 113}};  // the bionic one's thumb and other fingers
constexpr double kBeyond_deg = 5;                                 // a measured angle overshoots

constexpr std::size_t kClock = 7;  // a date and a flag, then joint 1

// A row's numbers, in their ranges.
template <class Fail>
std::vector<double> grasp_numbers(const std::string& line, const Fail& fail) {
  constexpr std::size_t kFields = kClock + 23;
  std::istringstream fields(line);
  std::vector<double> v;
  for (double x = 0; fields >> x;) v.push_back(x);
  if (v.size() != kFields || !fields.eof())
    fail(fmt::format("{} number(s) where a date, a flag and 23 joint angles make {}", v.size(), kFields));
  const bool clock =
      v[2] >= 1 && v[2] <= 31 && v[3] >= 0 && v[3] < 24 && v[4] >= 0 && v[4] < 60 && v[5] >= 0 && v[5] < 61;
  if (!clock) fail(fmt::format("day {:g}, {:g}:{:g}:{:g} is no time", v[2], v[3], v[4], v[5]));
  for (std::size_t j = kClock; j < kFields; ++j) {
    if (!(std::abs(v[j]) <= 2 * std::numbers::pi))
      fail(fmt::format("{:g} is no joint angle in radians", v[j]));
  }
  return v;
}

}  // namespace

twin::Motion csv_motion(const std::string& text, const std::filesystem::path& source,
                        std::vector<std::string>& notes) {
  std::vector<std::string> columns;
  for (const std::string& finger : model::finger_names()) columns.push_back(finger + "_deg");
  recording::Recording r = recording::parse_csv(text, source.string(), columns);
  notes.insert(notes.end(), r.warnings.begin(), r.warnings.end());
  std::vector<double> t_s =
      motion_time(r.t_s, source.string(), [&](std::size_t i) { return row_at(text, columns, r.t_s[i]); });
  std::array<std::vector<double>, kFingers> angle_deg;
  double largest_deg = 0;
  std::string beyond;
  for (std::size_t i = 0; i < kFingers; ++i) {
    angle_deg[i] = r.column(columns[i]).value;
    const auto [low, high] = std::ranges::minmax(angle_deg[i]);
    if (low < 0 || high > 180) {
      throw InputError("{}: column {}: {:g} to {:g} is no joint's range; write degrees between 0 and 180",
                       source.string(), columns[i], low, high);
    }
    largest_deg = std::max(largest_deg, high);
    const auto [least, most] = kHand_deg[i > 0];
    if (low < least - kBeyond_deg || high > most + kBeyond_deg)
      beyond += (beyond.empty() ? "" : ", ") + columns[i];
  }
  if (!beyond.empty())
    notes.push_back(
        fmt::format("{}: {}: angles are the bionic hand's own, 90 (open) to 170 (fist) of its thumb and "
                    "28 to 113 of the others; beyond them it stays at its stops, and that counts as error",
                    source.string(), beyond));
  if (largest_deg < 4)
    throw InputError("{}: no angle above {:g}: are these radians? Write degrees", source.string(),
                     largest_deg);
  return twin::Motion::from_samples(io::to_utf8(source.stem().string()), std::move(t_s),
                                    std::move(angle_deg));
}

twin::Motion grasp_motion(const std::string& text, const std::filesystem::path& source) {
  constexpr std::size_t kMcp[kFingers] = {2, 5, 9, 13, 17};
  std::vector<double> t_s;
  std::vector<std::string> rows;  // of each sample
  std::array<std::vector<double>, kFingers> angle_deg;
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    const std::string row = fmt::format("row {}", number);
    const auto fail = [&](const std::string& what) {
      throw InputError("{}: {}: {}; mend or remove the row", source.string(), row, what);
    };
    const std::vector<double> v = grasp_numbers(line, fail);
    const double t = ((v[2] * 24 + v[3]) * 60 + v[4]) * 60 + v[5];
    if (!t_s.empty() && t == t_s.back()) continue;  // some rows repeat the one before
    if (!t_s.empty() && t < t_s.back()) fail("the time goes backwards");
    t_s.push_back(t);
    rows.push_back(row);
    for (std::size_t i = 0; i < kFingers; ++i)
      angle_deg[i].push_back(-v[kClock - 1 + kMcp[i]] * 180 / std::numbers::pi);
  }
  t_s = motion_time(t_s, source.string(), [&](std::size_t i) { return rows[i]; });
  // The glove's zero is its own: the straightest that each finger gets lies at the hand's lower limit, and a degree is a degree.
  for (std::size_t i = 0; i < kFingers; ++i) {
    const auto [lower, upper] = kHand_deg[i > 0];
    const double straight = *std::ranges::min_element(angle_deg[i]);
    for (double& angle : angle_deg[i]) angle = std::clamp(lower + angle - straight, lower, upper);
  }
  return twin::Motion::from_samples(io::to_utf8(source.stem().string()), std::move(t_s),
                                    std::move(angle_deg));
}

}  // namespace flexor::study
