#include "host/recording/log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/io/io.hpp"
#include "host/recording/csv.hpp"

namespace flexor::recording {
namespace {

constexpr double kOwnClock_s = 1;  // a clock that begins before it is the log's own

bool holds_numbers(const Column& column) {
  const auto holes = std::ranges::count_if(column.value, [](double v) { return std::isnan(v); });
  return 2 * holes < std::ssize(column.value);
}

}  // namespace

MemoryReader::MemoryReader(std::shared_ptr<const Recording> recording, const TableOptions& options)
    : recording_(std::move(recording)), holes_(options.holes) {
  choose(options.columns);
}

void MemoryReader::choose(const std::vector<std::string>& columns) {
  chosen_.clear();
  for (const std::string& name : columns) chosen_.push_back(&recording_->column(name));
  for (const Column& column : recording_->columns) {
    if (columns.empty() && holds_numbers(column)) chosen_.push_back(&column);
  }
  if (chosen_.empty()) throw io::InputError(fmt::format("{}: no column of numbers", name()));
  names_.clear();
  units_.clear();
  for (const Column* column : chosen_) {
    names_.push_back(column->name);
    units_.push_back(column->unit);
  }
}

bool MemoryReader::has(const std::string& column) const {
  return std::ranges::count(recording_->columns, column, &Column::name) > 0;
}

bool MemoryReader::next(Row& row) {
  while (next_ < recording_->t_s.size()) {
    const std::size_t k = next_++;
    row = {recording_->t_s[k], {}, next_, 0};
    for (const Column* column : chosen_) {
      const double value = column->value[k];
      row.value.push_back(value);
      if (!std::isnan(value) && !is_measurement(value))
        throw io::InputError(
            fmt::format("{}: row {}: column \"{}\": {} is no reading", name(), next_, column->name, value));
    }
    if (holes_.keeps(row.value, next_)) return true;
  }
  return false;
}

std::vector<std::string> MemoryReader::notes() const {
  std::vector<std::string> out = recording_->warnings;
  for (const std::string& note : holes_.notes(names_)) out.push_back(name() + ": " + note);
  return out;
}

std::unique_ptr<LogReader> open_log(const Log& log, const TableOptions& options) {
  if (log.memory()) return std::make_unique<MemoryReader>(log.memory(), options);
  return std::make_unique<CsvReader>(log, options);
}

TimeOptions times_of_pair(const Log& sensor, const Log& reference, TimeOptions time) {
  const auto has_host_clock = [&](const Log& log) {
    if (log.memory()) return log.memory()->time_column == kHostClock;
    if (!std::filesystem::is_regular_file(log) || !CsvReader(log, {{}, time}).has(kHostClock)) return false;
    TimeOptions by_host = time;
    by_host.columns = {kHostClock};
    Row first;
    return CsvReader(log, {{}, by_host, Holes::all}).next(first) && first.t_s >= kOwnClock_s;
  };
  if (sensor != reference && time.columns.empty() && has_host_clock(sensor) && has_host_clock(reference))
    time.columns = {kHostClock};
  return time;
}

}  // namespace flexor::recording
