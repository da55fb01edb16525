#include "host/recording/csv.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>
#include <sstream>
#include <utility>

#include "host/io/io.hpp"

namespace flexor::recording {
namespace {

using io::InputError;

constexpr double kShortestTrial_s = 2;
constexpr double kShortestMean_s = 1e-5;  // of steps: days in a spreadsheet's digits
constexpr double kOwnClock_s = 1;         // a clock that begins before it is the log's own

constexpr std::size_t kSeconds = 6;  // that are looked at, the first and the last of them not whole
constexpr std::size_t kMostRowsASecond = 20000;  // of a second
constexpr std::size_t kUnlike = 2;               // times the rows of most seconds, or a part of them

bool is_whole(double t_s) { return t_s == std::floor(t_s); }

std::unique_ptr<std::istream> open(const std::filesystem::path& path) {
  if (path == "-") return nullptr;
  io::require_readable(path);
  return std::make_unique<std::ifstream>(path, std::ios::binary);
}

TableOptions of_file(TableOptions options, const std::filesystem::path& path) {
  if (!std::filesystem::is_regular_file(path)) options.from = From::pipe;
  return options;
}

void check_times(const Recording& recording, const Times& times) {
  if (recording.t_s.size() < 2) {
    const auto& notes = recording.warnings;
    throw InputError("{}: {} row(s) of data; a recording needs at least two{}", recording.source,
                     recording.t_s.size(), notes.empty() ? "" : notes.back().substr(recording.source.size()));
  }
  const double step_s =
      (recording.t_s.back() - recording.t_s.front()) / static_cast<double>(recording.t_s.size() - 1);
  const char* mend = spreadsheet_mend(recording.t_s.front() / times.unit_s, step_s / times.unit_s);
  if (step_s > 0 && (mend == nullptr || step_s > kShortestMean_s)) return;
  throw InputError("{}: row 3: time does not increase: it is {:.10g} s in every row; {}", recording.source,
                   recording.t_s.front(),
                   mend != nullptr ? mend
                   : times.other.empty()
                       ? "is another column the time (--time-column), or has it none (--log-rate 50)?"
                       : fmt::format("take the other time: --time-column \"{}\"", times.other));
}

// `rows`: of the reader, which a Stream has repaired or not.
template <class Rows>
std::vector<Recording> segments_of(const LogReader& reader, Rows& rows) {
  Recording empty;
  empty.source = reader.name();
  empty.time_column = reader.time_column();
  for (std::size_t i = 0; i < reader.columns().size(); ++i)
    empty.columns.push_back({reader.columns()[i], {}, reader.units()[i]});
  std::vector<Recording> out = {empty};
  for (Row row; rows.next(row);) {
    if (row.segment >= out.size()) out.push_back(empty);
    out.back().t_s.push_back(row.t_s);
    for (std::size_t i = 0; i < row.value.size(); ++i) out.back().columns[i].value.push_back(row.value[i]);
  }
  out.front().warnings = rows.notes();
  for (Recording& one : out) one.digest = reader.digest();
  return out;
}

}  // namespace

CsvReader::CsvReader(std::istream& stream, std::string source, const TableOptions& options)
    : source_(std::move(source)), table_(options), lines_(stream, source_, table_.is_live()) {
  begin();
}

CsvReader::CsvReader(const std::filesystem::path& path, const TableOptions& options)
    : file_(open(path)),
      source_(file_ ? path.string() : "standard input"),
      table_(of_file(options, path)),
      lines_(file_ ? *file_ : std::cin, source_, table_.is_live()) {
  begin();
}

void CsvReader::begin() {
  require_good();
  while (!table_.is_settled()) feed();
}

void CsvReader::require_good() const {
  if (const auto& p = table_.problem())
    throw InputError("{}{}{}: {}", source_, p->row > 0 ? fmt::format(": row {}", p->row) : "",
                     p->column.empty() ? "" : fmt::format(": column \"{}\"", p->column), p->detail);
}

void CsvReader::feed() {
  if (lines_.next(line_.text)) {
    line_.number = lines_.number();
    line_.is_cut_off = lines_.cut_off();
    table_.push(line_);
  } else {
    table_.end();
  }
  require_good();
}

void CsvReader::choose(const std::vector<std::string>& columns) {
  table_.choose(columns);
  require_good();
}

bool CsvReader::next(Row& row) {
  while (ready_.empty()) {
    std::vector<Row> second;
    if (per_second_ > 0) {
      if (!take_second(second)) return false;
      spread(second, 0);
      continue;
    }
    if (!take(row)) return false;
    if (is_settled_) return true;
    const bool again = std::exchange(last_s_, row.t_s) == row.t_s;
    is_settled_ = !is_whole(row.t_s);
    if (is_settled_ || !again) return true;
    look_ahead(std::move(row));
  }
  row = std::move(ready_.front());
  ready_.pop_front();
  return true;
}

bool CsvReader::take(Row& row) {
  if (ahead_.empty()) return read_row(row);
  row = std::move(ahead_.front());
  ahead_.pop_front();
  return true;
}

bool CsvReader::take_second(std::vector<Row>& second) {
  for (Row row; second.size() < kMostRowsASecond && take(row);) {
    if (!second.empty() && row.t_s != second.front().t_s) {
      ahead_.push_front(std::move(row));
      break;
    }
    second.push_back(row);
  }
  return !second.empty();
}

// `row` is the second one of its time; the first is given already.
void CsvReader::look_ahead(Row row) {
  is_settled_ = true;
  ahead_.push_front(std::move(row));
  std::vector<std::vector<Row>> seconds;
  bool whole = true;
  for (std::vector<Row> one; whole && seconds.size() < kSeconds && take_second(one); one.clear()) {
    whole = is_whole(one.front().t_s) && one.size() < kMostRowsASecond;
    seconds.push_back(one);
  }
  std::vector<std::size_t> rows;
  for (std::size_t i = 1; i < seconds.size(); ++i) rows.push_back(seconds[i].size());
  if (rows.size() > 1) rows.pop_back();  // the log may end in it
  std::ranges::sort(rows);
  const std::size_t most = rows.empty() ? 0 : rows[rows.size() / 2];
  if (!whole || most < 2) {
    for (const std::vector<Row>& one : seconds) ready_.insert(ready_.end(), one.begin(), one.end());
    return;
  }
  const auto unlike =
      std::ranges::count_if(rows, [&](std::size_t n) { return n > kUnlike * most || kUnlike * n < most; });
  if (unlike > 1) {
    throw InputError(
        "{}: row {}: the times are whole seconds, {} to {} rows in each: nobody knows when these were; log "
        "fractions of a second, or milliseconds (time_ms)",
        source_, seconds.front().front().line, rows.front(), rows.back());
  }
  per_second_ = most;
  for (std::size_t i = 0; i < seconds.size(); ++i)
    spread(seconds[i], i > 0 ? 0 : std::max(most, seconds[0].size() + 1) - seconds[0].size());
}

// Spread over its second, behind so many places that stay empty.
void CsvReader::spread(const std::vector<Row>& second, std::size_t before) {
  const auto places = static_cast<double>(std::max(per_second_, second.size() + before));
  for (std::size_t i = 0; i < second.size(); ++i) {
    ready_.push_back(second[i]);
    ready_.back().t_s += static_cast<double>(before + i) / places;
  }
}

bool CsvReader::read_row(Row& row) {
  for (;;) {
    const TableReader::Take take = table_.take(row);
    if (take == TableReader::Take::row) return true;
    require_good();
    if (!table_.refusal().empty())
      throw InputError("{}: row {}: the rows of another glove: {}", source_, table_.line().number,
                       table_.refusal());
    if (take != TableReader::Take::none) continue;
    if (table_.has_ended()) return false;
    feed();
  }
}

std::vector<std::string> CsvReader::notes() const {
  std::vector<std::string> out = table_.notes();
  if (lines_.is_utf16()) out.emplace_back("is read as UTF-16");
  if (lines_.saw_latin1()) out.emplace_back("is not UTF-8 and is read as Latin-1");
  if (per_second_ > 0)
    out.push_back(fmt::format(
        "the times are whole seconds: the rows of each, {} in most, are spread evenly over it", per_second_));
  for (std::string& note : out) note.insert(0, source_ + ": ");
  return out;
}

MemoryReader::MemoryReader(std::shared_ptr<const Recording> recording, const TableOptions& options)
    : recording_(std::move(recording)), holes_(options.holes) {
  choose(options.columns);
}

void MemoryReader::choose(const std::vector<std::string>& columns) {
  chosen_.clear();
  names_.clear();
  units_.clear();
  const auto take = [this](const Column& column) {
    chosen_.push_back(&column);
    names_.push_back(column.name);
    units_.push_back(column.unit);
  };
  for (const std::string& name : columns) take(recording_->column(name));
  for (const Column& column : recording_->columns) {
    const auto holes = std::ranges::count_if(column.value, [](double v) { return std::isnan(v); });
    if (columns.empty() && holes < std::ssize(column.value)) take(column);
  }
  if (chosen_.empty()) throw InputError("{}: no column of numbers", name());
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
        throw InputError("{}: row {}: column \"{}\": {} is no reading", name(), next_, column->name, value);
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

TimeOptions times_of_reference(const Log& sensor, const Log& reference, TimeOptions time) {
  if (sensor == reference) std::ranges::reverse(time.columns);
  return time;
}

Recording read(LogReader& reader, Resets resets) {
  Stream stream(reader, resets);
  Recording recording = std::move(segments_of(reader, stream).front());
  check_times(recording, reader.times());
  return recording;
}

Recording read_rows(LogReader& reader) {
  Recording recording = std::move(segments_of(reader, reader).front());
  if (recording.t_s.empty()) throw InputError(reader.name() + ": no row of data");
  return recording;
}

std::vector<Recording> read_segments(LogReader& reader, const TimeOptions& time) {
  Stream stream(reader, reader.splits_by_clock() ? Resets::split : Resets::refuse);
  std::vector<Recording> out = segments_of(reader, stream);
  if (!time.segments.empty() && out.size() == 1)
    out[0].warnings.push_back(fmt::format("{}: one trial alone (--segment)", reader.name()));
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (out.size() > 1) out[i].source += fmt::format(", trial {}", i + 1);
    check_times(out[i], reader.times());
    if (const double took_s = out[i].t_s.back() - out[i].t_s.front();
        out.size() > 1 && took_s < kShortestTrial_s)
      throw InputError("{}: {:.2g} s are no take: cut it out, or leave its label's cells empty",
                       out[i].source, took_s);
  }
  return out;
}

Recording parse_csv(const std::string& text, const std::string& source,
                    const std::vector<std::string>& columns) {
  std::istringstream stream(text);
  CsvReader reader(stream, source, {columns});
  return read(reader);
}

Recording read_csv(const std::filesystem::path& path, const std::vector<std::string>& columns,
                   const TimeOptions& time) {
  CsvReader reader(path, {columns, time});
  return read(reader);
}

std::string quoted(const std::string& name) {
  if (name.find_first_of(",;\t\"#") == std::string::npos) return name;
  std::string out = "\"";
  for (const char c : name) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + '"';
}

std::string to_csv(const Recording& recording) {
  std::string out = "t_s";
  for (const Column& c : recording.columns) out += "," + quoted(c.name);
  for (std::size_t i = 0; i < recording.t_s.size(); ++i) {
    fmt::format_to(std::back_inserter(out), "\n{}", recording.t_s[i]);
    for (const Column& c : recording.columns) fmt::format_to(std::back_inserter(out), ",{}", c.value[i]);
  }
  return out + '\n';
}

}  // namespace flexor::recording
