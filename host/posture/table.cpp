#include "host/posture/table.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/io/io.hpp"
#include "host/recording/time.hpp"
#include "host/recording/unit.hpp"

namespace flexor::posture {
namespace {

std::string trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r\"";
  const std::size_t begin = text.find_first_not_of(kBlank);
  if (begin == std::string_view::npos) return {};
  return std::string(text.substr(begin, text.find_last_not_of(kBlank) - begin + 1));
}

}  // namespace

TableReader::TableReader(std::istream& stream, std::string source)
    : lines_(stream), source_(std::move(source)) {
  std::string line;
  if (!lines_.next(line))
    throw io::InputError(fmt::format("{}: is empty; give a table with a header", source_));
  for (const char c : {',', ';', '\t'}) {
    if (line.find(c) == std::string::npos) continue;
    delimiter_ = c;
    break;
  }
  split(line);
  header_ = cells_;
  find_time();
}

void TableReader::find_time() {
  const auto times = [](const std::string& column) {
    const recording::NameAndUnit cut = recording::cut_name(column);
    return (cut.name == "t" || cut.name == "time") && recording::seconds_in(cut.unit);
  };
  const auto it = has("t_s") ? header_.end() : std::ranges::find_if(header_, times);
  time_place_ = place_of(it == header_.end() ? "t_s" : *it);
  time_unit_s_ = *recording::seconds_in(recording::cut_name(header_[time_place_]).unit);
}

void TableReader::fail(const std::string& what) const {
  throw io::InputError(fmt::format("{}: row {}: {}", source_, lines_.number(), what));
}

bool TableReader::has(const std::string& column) const { return std::ranges::count(header_, column) > 0; }

std::size_t TableReader::place_of(const std::string& column) const {
  const auto it = std::ranges::find(header_, column);
  if (it == header_.end()) {
    throw io::InputError(
        fmt::format("{}: no column \"{}\"; there are: {}", source_, column, fmt::join(header_, ", ")));
  }
  if (std::count(it, header_.end(), column) > 1)
    fail(fmt::format("column \"{}\" stands twice; rename one", column));
  return static_cast<std::size_t>(it - header_.begin());
}

void TableReader::choose(const std::vector<std::string>& columns) {
  places_.clear();
  for (const std::string& column : columns) places_.push_back(place_of(column));
}

void TableReader::split(const std::string& line) {
  cells_.clear();
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find(delimiter_, begin), line.size());
    cells_.push_back(trimmed(std::string_view(line).substr(begin, end - begin)));
    begin = end + 1;
  }
}

double TableReader::number(std::size_t place) const {
  const std::string& cell = cells_[place];
  if (recording::is_missing(cell)) return std::numeric_limits<double>::quiet_NaN();
  std::string text = cell;
  if (delimiter_ != ',') std::ranges::replace(text, ',', '.');
  const auto value = recording::to_number(text);
  if (value && std::isfinite(*value)) return *value;
  fail(fmt::format(
      "column \"{}\": \"{}\" is no number; mend it, or leave the cell empty where nothing was read",
      header_[place], io::start_of(cell, 40)));
}

bool TableReader::next(TableRow& row) {
  std::string line;
  do {
    if (!lines_.next(line)) return false;
  } while (trimmed(line).empty());
  split(line);
  if (cells_.size() != header_.size()) {
    fail(fmt::format("{} cells where the header has {}; mend the row or take it out", cells_.size(),
                     header_.size()));
  }
  row.t_s = number(time_place_) * time_unit_s_;
  if (std::isnan(row.t_s))
    fail(fmt::format("column \"{}\": no time; give one, or take the row out", header_[time_place_]));
  const bool plain = time_unit_s_ == 1 && cells_[time_place_].find(',') == std::string::npos;
  row.time = plain ? cells_[time_place_] : fmt::format("{}", row.t_s);
  row.value.clear();
  for (const std::size_t place : places_) row.value.push_back(number(place));
  return true;
}

double step_s(double before_s, double now_s) {
  constexpr double kPause_s = 0.5;
  const double step = now_s - before_s;
  return step > 0 && step <= kPause_s ? step : 0;
}

}  // namespace flexor::posture
