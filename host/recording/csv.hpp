// Glove and camera logs as people really have them: byte-order mark, non-ASCII names, comma, semicolon or
// tab, quotes, text columns beside numbers, bursts, pauses, a time column in milliseconds, seconds or ISO
// 8601.
//
// The time column is the first that is called t, time, timestamp or datetime, with or without a unit: (ms),
// [ms], _ms, and likewise us, s, sec; without one, ISO 8601 or seconds. `columns` are the columns to read;
// none: every column whose first cell is a number.
//
// Errors are io::InputError, one line naming file, row (as an editor counts lines) and column, and the mend.
#pragma once

#include <filesystem>
#include <istream>
#include <string>
#include <vector>

#include "host/recording/recording.hpp"

namespace flexor::recording {

// Row by row, for streams that never end.
class CsvReader {
 public:
  struct Row {
    double t_s = 0;
    std::vector<double> value;  // in the order of columns()
  };

  // Reads the header. `source` names the stream in errors; the stream must outlive the reader.
  CsvReader(std::istream& stream, std::string source, const std::vector<std::string>& columns);

  const std::vector<std::string>& columns() const { return columns_; }

  // False at the end. Time is as written: order is the caller's concern. A last line that was cut off while
  // it was being written (short, without a newline) counts as the end.
  bool next(Row& row);

  std::size_t line() const { return line_; }  // of the row that next() gave, counted from 1

 private:
  bool read_cells();
  void find_time();
  void find_columns(const std::vector<std::string>& wanted);
  double number(std::size_t cell, const std::string& column) const;
  double time(std::size_t cell) const;
  [[noreturn]] void fail(const std::string& what) const;

  std::istream& stream_;
  std::string source_;
  std::string text_;
  std::vector<std::string> cells_;
  std::vector<std::string> header_;
  std::vector<std::string> columns_;
  std::vector<std::size_t> places_;
  std::size_t time_place_ = 0;
  double time_unit_s_ = 1;
  std::size_t line_ = 0;
  char delimiter_ = ',';
  bool have_first_row_ = false;
};

// The whole file. Rows with the same time become one (their mean); up to 1 % of rows that go backwards are
// left out, with a warning; more of them, or a clock that does not look like seconds, is an error.
Recording read_csv(const std::filesystem::path& path, const std::vector<std::string>& columns);
Recording parse_csv(const std::string& text, const std::string& source,
                    const std::vector<std::string>& columns);

// Wide CSV: t_s, then every column, shortest text that reads back to the same double.
std::string to_csv(const Recording& recording);

}  // namespace flexor::recording
