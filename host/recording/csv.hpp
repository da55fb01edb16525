// Glove and camera logs as people really have them, row by row: lines of a file or a pipe for table.hpp, in UTF-8, UTF-16 or Latin-1,
// with a byte-order mark or without. Rows that share whole seconds are spread over them (whole_seconds.hpp).
//
// Errors are io::InputError, one line naming file, row (as an editor counts lines) and column, and the mend.
#pragma once

#include <filesystem>
#include <istream>
#include <memory>
#include <string>
#include <vector>

#include "host/recording/lines.hpp"
#include "host/recording/log.hpp"
#include "host/recording/recording.hpp"
#include "host/recording/stream.hpp"
#include "host/recording/table.hpp"
#include "host/recording/whole_seconds.hpp"

namespace flexor::recording {

class CsvReader : public LogReader {
 public:
  // Reads as far as the first row, or the first that tells what each column is. `source` names the stream in errors; the stream
  // must outlive the reader.
  CsvReader(std::istream& stream, std::string source, const TableOptions& options);
  // Of a file or a pipe; "-" is standard input.
  CsvReader(const std::filesystem::path& path, const TableOptions& options);

  // Other columns than before, while no row was read; none: as of TableOptions.
  void choose(const std::vector<std::string>& columns) override;
  bool has(const std::string& column) const override { return table_.has(column); }
  std::string time_column() const override { return table_.time_column(); }

  const std::string& name() const override { return source_; }
  const std::vector<std::string>& columns() const override { return table_.columns(); }
  const std::vector<std::string>& units() const override { return table_.units(); }
  // A last line that was cut off while it was being written (short, without an end) counts as the end.
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

  std::unique_ptr<std::istream> file_;
  LineReader lines_;
  std::string source_;
  TableReader table_;
  Line line_;
  bool has_ended_ = false;
  WholeSeconds seconds_;
};

// A whole recording of two times or more.
Recording read(LogReader& reader, Resets resets = Resets::refuse);
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
