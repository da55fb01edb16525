// Glove and camera logs as people really have them, row by row.
//
// Text      UTF-8, UTF-16, Latin-1; a byte-order mark; lines that start with #; a line sep=;
// Cells     separated by comma, semicolon, tab or blanks; quotes; decimal commas where the separator is none;
//           one separator too many at the end of each row; a first line that is half a line, or a greeting
// Names     a header, with a row of units below it or not; none: column1, column2, ... in their order, the
//           first is the time; a header in the last comment before the numbers
// Time      a column called t, time, timestamp, datetime, millis, Uhrzeit, ... with or without a unit: (ms),
//           [ms], _ms ...; without one seconds; or ISO 8601, 12:03:11.123, 3:11.5, 1.5.2026 12:03:11,
//           13/5/2026 12:03:11. Rows that share whole seconds are spread over them (whole_seconds.hpp)
// Monitors  12:03:11.123 -> 356,323,446 as the Arduino IDE writes it, and behind the arrow also text for VR
//           drivers (A356B323C446D350E360...: thumb, index, middle, ring, pinky)
// Plotters  index:512,middle:300 as the Arduino IDE's takes it, behind an arrow or with a label for the time (t_ms)
// Torn rows (too short, a cell that is empty or nan, the header again, as after a reset of the board) are left out and
//           counted; at most one in ten.
// Each assumption is one line of notes(). What could be read in two ways is refused.
//
// Errors are io::InputError, one line naming file, row (as an editor counts lines) and column, and the mend.
#pragma once

#include <filesystem>
#include <istream>
#include <optional>
#include <string>
#include <vector>

#include "host/recording/lines.hpp"
#include "host/recording/recording.hpp"
#include "host/recording/stream.hpp"
#include "host/recording/time.hpp"
#include "host/recording/whole_seconds.hpp"

namespace flexor::recording {

struct CsvOptions {
  std::vector<std::string>
      columns;  // to read; none: every column whose first cell is a number, or a hole where these may be
  std::string time_unit;  // s, ms, us, ns: of a time column that states none
  bool holes = false;     // an empty cell or "nan" is a missing reading, NaN; else its row is left out
};

class CsvReader : public Source {
 public:
  // Reads as far as the first row. `source` names the stream in errors; the stream must outlive the reader.
  CsvReader(std::istream& stream, std::string source, const CsvOptions& options);

  const std::string& name() const override { return source_; }
  const std::vector<std::string>& columns() const override { return columns_; }
  // Of each column; from its name, or from the row of units.
  const std::vector<std::string>& units() const { return units_; }
  // A last line that was cut off while it was being written (short, without an end) counts as the end.
  bool next(Row& row) override;
  double wrap_s() const override { return wrap_s_; }
  // Once a row was read: its times are dates, in seconds since 1970.
  bool is_dated() const {
    return time_format_ && *time_format_ != TimeFormat::number && *time_format_ != TimeFormat::clock &&
           *time_format_ != TimeFormat::minutes;
  }
  std::vector<std::string> notes() const override;
  std::string digest() const { return lines_.digest(); }

 private:
  enum class Layout { table, keyed, labelled };  // cells in columns, letters before numbers, label:value
  struct Line {
    std::string time;  // before an arrow; empty: in a cell
    std::string text;
    std::size_t number = 0;
  };

  bool read_row(Row& row);
  bool next_line(Line& line);
  void split_line();
  void split_labelled();
  void put_back();
  void leave_out_fragment();
  void read_layout();
  void find_delimiter(const Line& first, const std::optional<Line>& second);
  void read_header();
  bool comment_is_header(const std::string& comment);
  void read_units();
  void find_time(const CsvOptions& options);
  void find_columns(const std::vector<std::string>& wanted);
  std::size_t place_of(const std::string& name) const;
  bool is_torn();
  bool is_unmeasured() const;
  bool is_hole(const std::string& cell) const;
  void leave_out();
  struct Parsed {
    double value;
    char decimal;  // '.', ',' or none
  };
  std::optional<Parsed> parse(std::string_view text) const;
  double checked(const Parsed& parsed, const std::string& column, const std::string& text);
  double number(std::size_t cell, const std::string& column);
  double time(const std::string& text);
  [[noreturn]] void fail(const std::string& what) const;

  LineReader lines_;
  std::string source_;
  Layout layout_ = Layout::table;
  char delimiter_ = ',';
  bool delimiter_given_ = false;
  bool arrow_ = false;
  bool has_header_ = true;
  std::string comment_;      // the last one before the numbers
  std::vector<Line> ahead_;  // read to see the layout, not yet given; last first
  Line line_;
  std::vector<std::string> header_;
  std::vector<std::string> header_units_;
  std::vector<std::string> cells_;
  std::vector<std::string> columns_;
  std::vector<std::string> units_;
  std::vector<std::size_t> places_;
  bool holes_ = false;
  std::optional<std::size_t> time_place_;
  double time_unit_s_ = 1;
  std::optional<TimeFormat> time_format_;
  WholeSeconds seconds_;
  double wrap_s_ = 0;
  char decimal_ = 0;  // what separates the fractions, once one was seen
  std::size_t rows_ = 0;
  std::size_t torn_ = 0;
  std::size_t first_torn_ = 0;
  std::size_t unmeasured_ = 0;
  std::size_t first_unmeasured_ = 0;
  std::vector<std::string> notes_;
};

// All rows through Stream, few as they may be.
Recording read_rows(CsvReader& reader, Resets resets);
// A whole recording of two times or more; a reset of the clock is refused.
Recording read(CsvReader& reader);
Recording read_csv(const std::filesystem::path& path, const std::vector<std::string>& columns,
                   const std::string& time_unit = {});
Recording parse_csv(const std::string& text, const std::string& source,
                    const std::vector<std::string>& columns);

// The columns that a file has to offer, or throws as above.
std::vector<std::string> columns_of(const std::filesystem::path& path, const std::string& time_unit,
                                    bool holes = false);

// Wide CSV: t_s, then every column, shortest text that reads back to the same double.
std::string to_csv(const Recording& recording);

// A column's name as one cell.
std::string quoted(const std::string& name);

}  // namespace flexor::recording
