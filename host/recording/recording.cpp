#include "host/recording/recording.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "host/io/io.hpp"
#include "host/recording/line_format.hpp"
#include "host/recording/time.hpp"
#include "host/recording/unit.hpp"

namespace flexor::recording {

const Column& Recording::column(std::string_view name) const {
  const auto it = std::ranges::find(columns, name, &Column::name);
  if (it != columns.end()) return *it;
  std::vector<std::string> names;
  for (const Column& c : columns) names.push_back(c.name);
  throw io::InputError("{}: no column \"{}\"; there are: {}", source, name, listed(names));
}

bool share_a_clock(const Recording& one, const Recording& other) {
  const bool is_one_file = !one.digest.empty() && one.digest == other.digest;
  return one.time_column == other.time_column && (is_one_file || one.time_column == kHostClock);
}

bool is_video(const std::filesystem::path& file) {
  constexpr std::array kEndings = {".mp4", ".m4v", ".avi", ".mkv", ".mov", ".webm", ".mjpeg"};
  return std::ranges::count(kEndings, lower(file.extension().string())) > 0;
}

void require_change(const Recording& recording, std::string_view name, std::string_view hint) {
  std::vector<double> values = recording.column(name).value;
  std::erase_if(values, [](double value) { return std::isnan(value); });
  if (values.empty())
    throw io::InputError("{}: column \"{}\" has no reading; {}", recording.source, name, hint);
  const auto [low, high] = std::ranges::minmax(values);
  if (high > low) return;
  throw io::InputError("{}: column \"{}\" never changes (always {}); {}", recording.source, name, low, hint);
}

}  // namespace flexor::recording
