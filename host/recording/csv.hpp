// Glove and camera logs as people really have them, row by row: lines of a file or a pipe for table.hpp, in UTF-8, UTF-16 or Latin-1,
// with a byte-order mark or without; or a recording that the caller holds in memory.
//
// Errors are io::InputError, one line naming file, row (as an editor counts lines) and column, and the mend.
#pragma once

#include <concepts>
#include <deque>
#include <filesystem>
#include <istream>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "host/recording/lines.hpp"
#include "host/recording/recording.hpp"
#include "host/recording/stream.hpp"
#include "host/recording/table.hpp"

namespace flexor::recording {

// Of a recording in memory the path is its name alone.
class Log : public std::filesystem::path {
 public:
  Log() = default;
  template <class Path>
  requires(std::convertible_to<Path, std::filesystem::path> && !std::same_as<std::remove_cvref_t<Path>, Log>)
      Log(Path&& file)  // NOLINT(bugprone-forwarding-reference-overload): never a Log
      : std::filesystem::path(std::forward<Path>(file)) {}
  explicit Log(Recording held)
      : std::filesystem::path(held.source), memory_(std::make_shared<const Recording>(std::move(held))) {}

  const std::shared_ptr<const Recording>& memory() const { return memory_; }  // null: a file

 private:
  std::shared_ptr<const Recording> memory_;
};

// Where a log's clock shows whole seconds, while several rows come in each (10:00:01, 10:00:01, 10:00:02 ...), the rows of a second
// are spread evenly over it, those of the first at its end, since the log began within it; where a second has fewer rows than
// most, they are as far apart as elsewhere. Rows that share any other time are a burst and stay so.
class CsvReader : public LogReader {
 public:
  // Reads as far as the first row, or the first that tells what each column is. `source` names the stream in errors; the stream
  // must outlive the reader.
  CsvReader(std::istream& stream, std::string source, const TableOptions& options);
  // Of a file or a pipe; "-" is standard input.
  CsvReader(const std::filesystem::path& path, const TableOptions& options);

  void choose(const std::vector<std::string>& columns) override;
  bool has(const std::string& column) const override { return table_.has(column); }
  std::string time_column() const override { return table_.time_column(); }

  const std::string& name() const override { return source_; }
  const std::vector<std::string>& columns() const override { return table_.columns(); }
  const std::vector<std::string>& units() const override { return table_.units(); }
  // A last line that was cut off while it was being written (short, without an end) counts as the end. Reads some seconds ahead once
  // two rows share a whole second, and where rows are spread a second ahead from then on. Throws io::InputError where the seconds
  // hold so unlike numbers of rows that nobody knows when these were.
  bool next(Row& row) override;
  Times times() const override { return table_.times(); }
  bool is_live() const override { return table_.is_live(); }
  bool splits_by_clock() const override { return table_.splits_by_clock(); }
  // Once a row was read: its times are dates, in seconds since 1970.
  bool is_dated() const { return table_.is_dated(); }
  std::vector<std::string> notes() const override;
  std::string digest() const override { return lines_.digest(); }

 private:
  void begin();
  void feed();
  bool read_row(Row& row);
  void require_good() const;
  bool take(Row& row);
  bool take_second(std::vector<Row>& second);
  void look_ahead(Row row);
  void spread(const std::vector<Row>& second, std::size_t before);

  std::unique_ptr<std::istream> file_;
  std::string source_;
  TableReader table_;
  LineReader lines_;
  Line line_;
  std::deque<Row> ahead_;  // read, but not yet looked at
  std::deque<Row> ready_;
  bool is_settled_ = false;  // whether anything is spread
  std::optional<double> last_s_;
  std::size_t per_second_ = 0;  // rows; 0: nothing is spread
};

// Of a recording in memory; NaN is a missing reading. Rows are counted from 1 in messages.
class MemoryReader : public LogReader {
 public:
  MemoryReader(std::shared_ptr<const Recording> recording, const TableOptions& options);

  const std::string& name() const override { return recording_->source; }
  const std::vector<std::string>& columns() const override { return names_; }
  const std::vector<std::string>& units() const override { return units_; }
  void choose(const std::vector<std::string>& columns) override;
  bool has(const std::string& column) const override;
  bool next(Row& row) override;
  std::vector<std::string> notes() const override;
  std::string digest() const override { return recording_->digest; }
  std::string time_column() const override { return recording_->time_column; }

 private:
  std::shared_ptr<const Recording> recording_;
  std::vector<const Column*> chosen_;
  std::vector<std::string> names_;
  std::vector<std::string> units_;
  std::size_t next_ = 0;
  HoleCounter holes_;
};

std::unique_ptr<LogReader> open_log(const Log& log, const TableOptions& options);

// How the two logs of a pair are read: by kHostClock where both have it and nothing else is asked for.
TimeOptions times_of_pair(const Log& sensor, const Log& reference, TimeOptions time);
// Of those the reference's: in one file with two clocks beside each other it has the second that is asked for.
TimeOptions times_of_reference(const Log& sensor, const Log& reference, TimeOptions time);

// A whole recording of two times or more.
Recording read(LogReader& reader, Resets resets = Resets::refuse);
// Rows as they stand, also where the clock goes back or starts again.
Recording read_rows(LogReader& reader);
Recording read_csv(const std::filesystem::path& path, const std::vector<std::string>& columns,
                   const TimeOptions& time = {});
// Of each trial in it, which TimeOptions tell apart.
std::vector<Recording> read_segments(LogReader& reader, const TimeOptions& time);
Recording parse_csv(const std::string& text, const std::string& source,
                    const std::vector<std::string>& columns);

// Wide CSV: t_s, then every column, shortest text that reads back to the same double.
std::string to_csv(const Recording& recording);

// A column's name as one cell.
std::string quoted(const std::string& name);

}  // namespace flexor::recording
