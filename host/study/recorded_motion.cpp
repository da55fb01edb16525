#include "host/study/recorded_motion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <sstream>

#include "host/io/io.hpp"
#include "host/model/model.hpp"
#include "host/recording/csv.hpp"
#include "host/recording/resample.hpp"

namespace flexor::study {
namespace {

using io::InputError;
using twin::kFingers;

// What is kept in memory grows with the rows, not with the time between them.
constexpr double kLongestPause_s = 60;

// The row of a log that has this time, as an editor counts.
std::string row_at(const std::string& text, const recording::TableOptions& options, double t_s) {
  std::istringstream stream(text);
  recording::CsvReader reader(stream, "", options);
  for (recording::Row row; reader.next(row);)
    if (row.t_s == t_s) return fmt::format("row {}", row.line);
  return fmt::format("time {:g}", t_s);
}

// Its columns, on a clock from 0.
recording::Recording read(const std::string& text, const std::string& file,
                          const recording::TableOptions& options, std::vector<std::string>& notes) {
  std::istringstream stream(text);
  recording::CsvReader reader(stream, file, options);
  recording::Recording out = recording::read(reader);
  notes.insert(notes.end(), out.warnings.begin(), out.warnings.end());
  for (std::size_t i = 1; i < out.t_s.size(); ++i) {
    const double pause_s = out.t_s[i] - out.t_s[i - 1];
    if (pause_s > kLongestPause_s) {
      throw InputError(
          "{}: {}: its time is {:g} s after the row before, and a motion pauses {:g} s "
          "at most; mend or remove the row",
          file, row_at(text, options, out.t_s[i]), pause_s, kLongestPause_s);
    }
  }
  const double lasts_s = out.t_s.back() - out.t_s.front();
  if (!(lasts_s >= 0.01 && lasts_s <= twin::kMaxDuration_s)) {
    throw InputError("{}: lasts {:g} s; a motion lasts 0.01 to {:g} s", file, lasts_s, twin::kMaxDuration_s);
  }
  out.t_s = recording::since_start(out.t_s);
  return out;
}

constexpr recording::Range kHand_deg[] = {{90, 170}, {28, 113}};  // the bionic one's thumb and other fingers
constexpr double kBeyond_deg = 5;                                 // a measured angle overshoots

}  // namespace

twin::Motion csv_motion(const std::string& text, const std::filesystem::path& source,
                        std::vector<std::string>& notes) {
  std::vector<std::string> columns;
  for (const std::string& finger : model::finger_names()) columns.push_back(finger + "_deg");
  const recording::Recording r = read(text, source.string(), {.columns = columns}, notes);
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
  return twin::Motion::from_samples(io::to_utf8(source.stem().string()), r.t_s, std::move(angle_deg));
}

twin::Motion grasp_motion(const std::string& text, const std::filesystem::path& source,
                          std::vector<std::string>& notes) {
  std::string names = "year month day hour minute second flag";  // which the file does not have
  for (int joint = 1; joint <= 23; ++joint) names += fmt::format(" joint{}_rad", joint);
  const std::vector<std::string> mcp = {"joint2_rad", "joint5_rad", "joint9_rad", "joint13_rad",
                                        "joint17_rad"};
  const recording::Recording r = read(text, source.string(), {.columns = mcp, .names = names}, notes);
  // The glove's zero is its own: the straightest that each finger gets lies at the hand's lower limit, and a degree is a degree.
  std::array<std::vector<double>, kFingers> angle_deg;
  for (std::size_t i = 0; i < kFingers; ++i) {
    const std::vector<double>& rad = r.column(mcp[i]).value;
    const auto [bent, straight] = std::ranges::minmax(rad);
    if (bent < -2 * std::numbers::pi || straight > 2 * std::numbers::pi) {
      throw InputError("{}: {}: {:g} to {:g} is no joint's range in radians", source.string(), mcp[i], bent,
                       straight);
    }
    const auto [lower, upper] = kHand_deg[i > 0];
    for (const double angle : rad)
      angle_deg[i].push_back(std::min(lower + (straight - angle) * 180 / std::numbers::pi, upper));
  }
  return twin::Motion::from_samples(io::to_utf8(source.stem().string()), r.t_s, std::move(angle_deg));
}

}  // namespace flexor::study
