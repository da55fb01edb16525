#include "host/recording/csv.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>
#include <sstream>

#include "host/io/io.hpp"

namespace flexor::recording {
namespace {

using io::InputError;

constexpr double kMaxBackwardShare = 0.01;
constexpr double kMaxMedianStep_s = 5;

std::string_view trimmed(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

char find_delimiter(const std::string& header) {
  char best = ',';
  for (const char c : {';', '\t'}) {
    if (std::ranges::count(header, c) > std::ranges::count(header, best)) best = c;
  }
  return best;
}

// RFC 4180 within one line. Reuses the strings of `cells`.
void split(const std::string& line, char delimiter, std::vector<std::string>& cells) {
  std::size_t n = 0;
  const auto next_cell = [&]() -> std::string& {
    if (n == cells.size()) cells.emplace_back();
    cells[n].clear();
    return cells[n++];
  };
  std::string* cell = &next_cell();
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (quoted && c == '"' && i + 1 < line.size() && line[i + 1] == '"') {
      cell->push_back('"');
      ++i;
    } else if (c == '"' && (quoted || trimmed(*cell).empty())) {
      quoted = !quoted;
    } else if (c == delimiter && !quoted) {
      cell = &next_cell();
    } else {
      cell->push_back(c);
    }
  }
  cells.resize(n);
  for (std::string& text : cells) {
    const std::string_view inner = trimmed(text);
    if (inner.size() != text.size()) text = std::string(inner);
  }
}

std::optional<double> to_number(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

// Seconds since 1970 of YYYY-MM-DD[T ]hh:mm:ss[.fff][Z|+hh:mm|-hh:mm].
std::optional<double> to_iso_time(const std::string& text) {
  int year = 0;
  unsigned month = 0;
  unsigned day = 0;
  int hour = 0;
  int minute = 0;
  double second = 0;
  char separator = 0;
  int used = 0;
  if (std::sscanf(text.c_str(), "%4d-%2u-%2u%c%2d:%2d:%lf%n", &year, &month, &day, &separator, &hour, &minute,
                  &second, &used) != 7 ||
      (separator != 'T' && separator != ' ')) {
    return std::nullopt;
  }
  const std::chrono::year_month_day date{std::chrono::year(year), std::chrono::month(month),
                                         std::chrono::day(day)};
  if (!date.ok() || hour < 0 || hour > 24 || minute < 0 || minute > 59 || !(second >= 0 && second < 61)) {
    return std::nullopt;
  }
  double zone_s = 0;
  const std::string zone = text.substr(static_cast<std::size_t>(used));
  if (!zone.empty() && zone != "Z") {
    int zone_hour = 0;
    int zone_minute = 0;
    char sign = 0;
    if (std::sscanf(zone.c_str(), "%c%2d:%2d", &sign, &zone_hour, &zone_minute) != 3) return std::nullopt;
    if (sign != '+' && sign != '-') return std::nullopt;
    zone_s = (sign == '+' ? 1 : -1) * (zone_hour * 3600.0 + zone_minute * 60.0);
  }
  const auto days = std::chrono::sys_days(date).time_since_epoch().count();
  return static_cast<double>(days) * 86400 + hour * 3600 + minute * 60 + second - zone_s;
}

std::string lower(std::string_view text) {
  std::string out(text);
  std::ranges::transform(out, out.begin(), [](unsigned char c) { return std::tolower(c); });
  return out;
}

// The unit in a time column's name, if it says one, and whether the name is one of a time column at all.
struct TimeName {
  bool is_time = false;
  std::optional<double> unit_s;
};

TimeName read_time_name(std::string_view name) {
  std::string text = lower(name);
  std::erase_if(text, [](char c) { return c == ' '; });
  TimeName result;
  static constexpr std::array<std::pair<const char*, double>, 4> kUnits = {
      {{"ms", 1e-3}, {"us", 1e-6}, {"sec", 1}, {"s", 1}}};
  for (const auto& [unit, seconds] : kUnits) {
    for (const std::string& suffix :
         {fmt::format("({})", unit), fmt::format("[{}]", unit), fmt::format("_{}", unit)}) {
      if (text.ends_with(suffix)) {
        result.unit_s = seconds;
        text.resize(text.size() - suffix.size());
        break;
      }
    }
    if (result.unit_s) break;
  }
  result.is_time = text == "t" || text == "time" || text == "timestamp" || text == "datetime";
  return result;
}

// A column's name as one cell.
std::string quoted(const std::string& name) {
  if (name.find_first_of(",;\t\"") == std::string::npos) return name;
  std::string out = "\"";
  for (const char c : name) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + '"';
}

// Sorts out repeated and backward times in place; every vector in `recording` keeps the same length.
void repair_time(Recording& recording, const std::vector<std::size_t>& lines) {
  std::vector<double>& t = recording.t_s;
  std::size_t kept = 0;
  std::size_t merged = 0;
  std::size_t dropped = 0;
  std::size_t first_bad = 0;
  std::size_t in_mean = 1;
  for (std::size_t i = 1; i < t.size(); ++i) {
    if (t[i] > t[kept]) {
      ++kept;
      t[kept] = t[i];
      for (Column& c : recording.columns) c.value[kept] = c.value[i];
      in_mean = 1;
    } else if (t[i] == t[kept]) {
      ++merged;
      ++in_mean;
      for (Column& c : recording.columns) {
        c.value[kept] += (c.value[i] - c.value[kept]) / static_cast<double>(in_mean);
      }
    } else {
      if (dropped++ == 0) first_bad = i;
    }
  }
  const auto total = static_cast<double>(t.size());
  if (static_cast<double>(dropped) > kMaxBackwardShare * total || kept == 0) {
    const std::size_t line = dropped > 0 ? lines[first_bad] : lines[1];
    throw InputError(
        fmt::format("{}: row {}: time does not increase ({} of {} rows); sort the log, or cut it "
                    "where the clock was reset",
                    recording.source, line, dropped + merged, t.size()));
  }
  if (dropped > 0) {
    recording.warnings.push_back(
        fmt::format("{}: {} row(s) with a time that goes backwards were left out, the "
                    "first is row {}",
                    recording.source, dropped, lines[first_bad]));
  }
  if (merged > 0) {
    recording.warnings.push_back(
        fmt::format("{}: {} row(s) repeat the time of the row before; each group became its mean",
                    recording.source, merged));
  }
  t.resize(kept + 1);
  for (Column& c : recording.columns) c.value.resize(kept + 1);
}

void check_time_unit(const Recording& recording) {
  const auto& t = recording.t_s;
  if (t.size() < 3) return;
  std::vector<double> steps;
  for (std::size_t i = 1; i < t.size(); ++i) steps.push_back(t[i] - t[i - 1]);
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  if (*middle <= kMaxMedianStep_s) return;
  throw InputError(
      fmt::format("{}: time steps of {:.4g} s; if the time column is in milliseconds, name it time_ms",
                  recording.source, *middle));
}

Recording read_all(std::istream& stream, const std::string& source, const std::vector<std::string>& columns) {
  CsvReader reader(stream, source, columns);
  Recording recording;
  recording.source = source;
  for (const std::string& name : reader.columns()) recording.columns.push_back({name, {}});
  std::vector<std::size_t> lines;
  CsvReader::Row row;
  while (reader.next(row)) {
    recording.t_s.push_back(row.t_s);
    lines.push_back(reader.line());
    for (std::size_t i = 0; i < row.value.size(); ++i) recording.columns[i].value.push_back(row.value[i]);
  }
  if (recording.t_s.size() < 2) {
    throw InputError(
        fmt::format("{}: {} row(s) of data; a recording needs at least two", source, recording.t_s.size()));
  }
  repair_time(recording, lines);
  check_time_unit(recording);
  return recording;
}

}  // namespace

CsvReader::CsvReader(std::istream& stream, std::string source, const std::vector<std::string>& columns)
    : stream_(stream), source_(std::move(source)) {
  if (!std::getline(stream_, text_)) throw InputError(fmt::format("{}: is empty", source_));
  if (text_.starts_with("\xEF\xBB\xBF")) text_.erase(0, 3);
  line_ = 1;
  delimiter_ = find_delimiter(text_);
  split(text_, delimiter_, header_);
  if (read_cells()) {
    have_first_row_ = true;
  } else {
    throw InputError(fmt::format("{}: has a header but no data", source_));
  }
  find_time();
  find_columns(columns);
}

void CsvReader::fail(const std::string& what) const {
  throw InputError(fmt::format("{}: row {}: {}", source_, line_, what));
}

bool CsvReader::read_cells() {
  do {
    if (!std::getline(stream_, text_)) return false;
    ++line_;
  } while (trimmed(text_).empty());
  split(text_, delimiter_, cells_);
  if (cells_.size() == header_.size()) return true;
  if (cells_.size() < header_.size() && stream_.eof()) return false;  // cut off while being written
  fail(fmt::format("{} cells, the header has {}", cells_.size(), header_.size()));
}

void CsvReader::find_time() {
  const auto it =
      std::ranges::find_if(header_, [](const std::string& n) { return read_time_name(n).is_time; });
  if (it == header_.end()) {
    throw InputError(
        fmt::format("{}: no time column (t_s, time, Time(ms), timestamp ...): name it t_s or time_ms; "
                    "there are: {}",
                    source_, fmt::join(header_, ", ")));
  }
  time_place_ = static_cast<std::size_t>(it - header_.begin());
  time_unit_s_ = read_time_name(*it).unit_s.value_or(1);
}

void CsvReader::find_columns(const std::vector<std::string>& wanted) {
  if (wanted.empty()) {
    for (std::size_t i = 0; i < header_.size(); ++i) {
      if (i == time_place_ || !to_number(cells_[i])) continue;
      columns_.push_back(header_[i]);
      places_.push_back(i);
    }
    return;
  }
  for (const std::string& name : wanted) {
    const auto it = std::ranges::find(header_, name);
    if (it == header_.end()) {
      throw InputError(
          fmt::format("{}: no column \"{}\"; there are: {}", source_, name, fmt::join(header_, ", ")));
    }
    columns_.push_back(name);
    places_.push_back(static_cast<std::size_t>(it - header_.begin()));
  }
}

double CsvReader::number(std::size_t cell, const std::string& column) const {
  const std::string& text = cells_[cell];
  const auto value = to_number(text);
  if (!value) {
    fail(fmt::format("column \"{}\": {}; mend or remove the row", column,
                     text.empty() ? "is empty" : fmt::format("\"{}\" is not a number", text.substr(0, 40))));
  }
  if (!std::isfinite(*value)) {
    fail(fmt::format("column \"{}\": {} is not a measurement; mend or remove the row", column, text));
  }
  return *value;
}

double CsvReader::time(std::size_t cell) const {
  if (const auto iso = to_iso_time(cells_[cell])) return *iso;
  return number(cell, header_[cell]) * time_unit_s_;
}

bool CsvReader::next(Row& row) {
  if (!have_first_row_ && !read_cells()) return false;
  have_first_row_ = false;
  row.t_s = time(time_place_);
  row.value.resize(places_.size());
  for (std::size_t i = 0; i < places_.size(); ++i) row.value[i] = number(places_[i], columns_[i]);
  return true;
}

Recording parse_csv(const std::string& text, const std::string& source,
                    const std::vector<std::string>& columns) {
  std::istringstream stream(text);
  Recording recording = read_all(stream, source, columns);
  recording.digest = io::digest(text);
  return recording;
}

Recording read_csv(const std::filesystem::path& path, const std::vector<std::string>& columns) {
  return parse_csv(io::read_file(path), path.string(), columns);
}

std::string to_csv(const Recording& recording) {
  fmt::memory_buffer out;
  fmt::format_to(std::back_inserter(out), "t_s");
  for (const Column& c : recording.columns) fmt::format_to(std::back_inserter(out), ",{}", quoted(c.name));
  out.push_back('\n');
  for (std::size_t i = 0; i < recording.t_s.size(); ++i) {
    fmt::format_to(std::back_inserter(out), "{}", recording.t_s[i]);
    for (const Column& c : recording.columns) fmt::format_to(std::back_inserter(out), ",{}", c.value[i]);
    out.push_back('\n');
  }
  return fmt::to_string(out);
}

}  // namespace flexor::recording
