// Glove and camera logs as people really have them, row by row: the only reader of files of text.
//
// Text      UTF-8, UTF-16, Latin-1; a byte-order mark; lines that start with #; a line sep=;
// Lines     as line_format.hpp has them; one separator too many at the end of each row
// Names     a header, with a row of units below it or not; none: column1, column2, ... in their order; a header in the
//           last comment before the numbers. Above it greetings, half a line, or titles, as OpenSim (.mot, .sto, .trc), Vicon and
//           Motive write them: inDegrees is a unit, names above tell columns of one name apart, a rate above Frame is a clock
// Time      a column called t, time, timestamp, datetime, millis, Uhrzeit, ... with or without a unit: (ms), [ms], _ms ...;
//           else a column of times of day or dates; without a header the first; or none, at a rate that is given. ISO 8601,
//           12:03:11.123, 3:11.5, 1.5.2026 12:03:11, 13/5/2026 12:03:11. A counter (1, 2, 3 ...) gives way to written times. Rows that
//           share whole seconds are spread over them (whole_seconds.hpp)
// Malformed rows (too short or too long, no time; in a live log also text for a number; the header again, as after a reset of
//           the board) are left out and counted; at most one in ten.
// Each assumption is one line of notes(). What could be read in two ways is refused.
//
// Errors are io::InputError, one line naming file, row (as an editor counts lines) and column, and the mend.
#pragma once

#include <deque>
#include <filesystem>
#include <istream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host/recording/line_format.hpp"
#include "host/recording/lines.hpp"
#include "host/recording/recording.hpp"
#include "host/recording/stream.hpp"
#include "host/recording/time.hpp"
#include "host/recording/whole_seconds.hpp"

namespace flexor::recording {

struct CsvOptions {
  std::vector<std::string> columns;  // to read; none: all whose first number comes before any word, and soon
  TimeOptions time = {};
  bool holes = false;  // a missing reading is NaN; else its row is left out
  bool is_live =
      false;  // rows come as they are made: few are looked ahead, no bad cell among good ones ends it
};

class CsvReader : public Source {
 public:
  // Reads as far as the first row, or the first that tells what each column is. `source` names the stream in errors; the stream
  // must outlive the reader.
  CsvReader(std::istream& stream, std::string source, const CsvOptions& options);
  // Of a file; "-" is standard input.
  CsvReader(const std::filesystem::path& path, const CsvOptions& options);

  // Other columns than before, while no row was read; none: as of CsvOptions.
  void choose(const std::vector<std::string>& columns);
  bool has(const std::string& column) const;

  const std::string& name() const override { return source_; }
  const std::vector<std::string>& columns() const override { return columns_; }
  // Of each column; from its name, or from the row of units.
  const std::vector<std::string>& units() const { return units_; }
  // A last line that was cut off while it was being written (short, without an end) counts as the end.
  bool next(Row& row) override;
  double wrap_s() const override { return wrap_s_; }
  double time_unit_s() const override { return time_unit_s_; }
  bool guesses_time() const override { return time_place_ && !has_header_; }
  // Once a row was read: its times are dates, in seconds since 1970.
  bool is_dated() const { return time_format_ && is_date(*time_format_); }
  std::vector<std::string> notes() const override;
  std::string digest() const { return lines_.digest(); }

 private:
  struct Line {
    std::string time;  // before an arrow; empty: in a cell
    std::string text;
    std::string comment;  // the last one above it
    std::size_t number = 0;
    bool is_cut_off = false;
  };
  struct Clock {
    std::size_t place;
    int rank;
    std::optional<double> unit_s;
  };

  bool read_row(Row& row);
  bool read_line(Line& line);
  const Line* peek(std::size_t i);
  bool next_line(Line& line);
  const Line& first_line(const char* lack);
  void split_line(const std::string& text);
  void find_layout();
  std::optional<std::size_t> find_first_row();
  void leave_out_titles(std::size_t count);
  void read_header();
  void name_by_titles();
  bool comment_is_header(const std::string& comment);
  void read_units();
  bool stands(std::size_t place, const std::string& first);
  std::optional<Clock> clock_in(std::size_t place, const std::vector<std::string>& first,
                                const std::vector<std::string>& second);
  void find_time();
  void require_time();
  std::vector<std::size_t> columns_of_numbers();
  std::size_t place_of(const std::string& name) const;
  bool is_whole(std::string& why);
  bool read_time(double& t_s, std::string& why);
  bool read_values(std::vector<double>& value, std::string& why);
  std::optional<double> checked(const Number& number, std::string& why);
  void leave_out();
  [[noreturn]] void fail(const std::string& what) const;
  void begin();

  std::unique_ptr<std::istream> file_;
  LineReader lines_;
  std::string source_;
  CsvOptions options_;
  Layout layout_ = Layout::table;
  char separator_ = 0;  // 0: not known yet
  bool arrow_ = false;
  bool has_header_ = true;
  std::deque<Line> ahead_;  // read, not yet given
  Line line_;
  std::vector<std::vector<std::string>> titles_;
  std::string angle_unit_;    // of columns that state none, by a title
  double frame_rate_hz_ = 0;  // likewise
  std::vector<std::string> header_;
  std::vector<std::string> header_units_;
  std::vector<std::string> cells_;
  Cells labelled_;
  std::string new_label_;  // of a line, which the header does not have
  std::vector<std::string> columns_;
  std::vector<std::string> units_;
  std::vector<std::size_t> places_;
  std::optional<std::size_t> time_place_;
  double time_unit_s_ = 1;
  std::optional<TimeFormat> time_format_;
  WholeSeconds seconds_;
  double wrap_s_ = 0;
  char decimal_ = 0;  // what separates the fractions, once one was seen
  std::size_t rows_ = 0;
  std::size_t torn_ = 0;
  std::size_t first_torn_ = 0;
  std::size_t too_long_ = 0;  // of the torn ones
  std::size_t unmeasured_ = 0;
  std::size_t first_unmeasured_ = 0;
  std::vector<std::string> notes_;
  std::string left_out_;  // columns
};

// All rows through Stream, few as they may be.
Recording read_rows(CsvReader& reader, Resets resets);
// A whole recording of two times or more; a reset of the clock is refused.
Recording read(CsvReader& reader);
Recording read_csv(const std::filesystem::path& path, const std::vector<std::string>& columns,
                   const TimeOptions& time = {});
Recording parse_csv(const std::string& text, const std::string& source,
                    const std::vector<std::string>& columns);

// The columns that a file has to offer, or throws as above.
std::vector<std::string> columns_of(const std::filesystem::path& path, const TimeOptions& time,
                                    bool holes = false);

// Wide CSV: t_s, then every column, shortest text that reads back to the same double.
std::string to_csv(const Recording& recording);

// A column's name as one cell.
std::string quoted(const std::string& name);

}  // namespace flexor::recording
