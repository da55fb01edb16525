// Lines of a log to rows of named columns with units, as they come: the only reader of text. Files, pipes, replays and ports are
// sources of lines.
//
// Lines     as line_format.hpp has them; blank ones and those that start with #; a line sep=;; one separator too many at the end
// Names     a header, with a row of units below it or not, or in the last comment; none: column1, column2, ... Above it greetings,
//           half a line, or titles, as OpenSim (.mot, .sto, .trc), Vicon and Motive write them: inDegrees is a unit, names above
//           tell columns of one name apart, a rate above Frame is a clock. It may come again, also in another order
// Time      a column called t, time, timestamp, datetime, millis, Uhrzeit, ... with or without a unit: (ms), [ms], _ms ...;
//           else one of times of day or dates (time.hpp); without a header the first; or none, at a rate that is given. A counter
//           (1, 2, 3 ...) gives way to written times
//           Of several sections of Vicon's the first that has the columns asked for
// Malformed rows (too short or too long, no time; in a live log also text for a number) are left out and counted; at most one
//           in ten, but of a port, which never ends. What is assumed is noted, what could be read in two ways is a problem.
#pragma once

#include <algorithm>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "host/recording/line_format.hpp"
#include "host/recording/stream.hpp"
#include "host/recording/time.hpp"

namespace flexor::recording {

enum class From {
  file,
  pipe,  // rows come as they are made: few are looked ahead, and no bad cell among good ones ends it
  port   // a pipe that may begin anywhere and that nothing ends; it needs no times
};

enum class Holes {  // missing readings
  none,             // a row with one is left out
  some,             // it is NaN, and a row without any reading is left out
  all               // it is NaN
};

// Which rows are kept, and the notes on those that lack a reading.
class HoleCounter {
 public:
  explicit HoleCounter(Holes holes) : holes_(holes) {}
  bool keeps(const std::vector<double>& value, std::size_t line);
  std::vector<std::string> notes(const std::vector<std::string>& columns) const;
  std::size_t kept() const { return kept_; }
  std::size_t rows() const { return kept_ + without_; }

 private:
  Holes holes_;
  std::vector<std::size_t> missing_;  // of each column
  std::size_t kept_ = 0;
  std::size_t without_ = 0;
  std::size_t first_without_ = 0;
};

struct TableOptions {
  std::vector<std::string> columns;  // to read; none: all with more numbers than words at first
  TimeOptions time = {};
  Holes holes = Holes::none;
  From from = From::file;
  std::string names = {};  // of the columns of a log that has none
};

struct Line {
  std::string text;
  std::size_t number = 0;   // as an editor counts
  bool is_cut_off = false;  // the last one, without an end: it may be half written
  double host_s = 0;        // of a port: when it came, and its length on the wire
  std::size_t bytes = 0;
  std::string time = {};     // before an arrow
  std::string comment = {};  // the last one above it
  bool is_title = false;     // above the rows, and neither header nor units
};

struct Problem {
  enum class Kind { option, empty, not_text, no_time, ambiguous, no_column, cell, malformed };
  Kind kind;
  std::size_t row = 0;  // 0: of the whole log
  std::string column;   // empty: of no one
  std::string detail;
};

// What is known of a table: what each column is, once it is settled, and the lines that were not taken yet.
class TableState {
 public:
  explicit TableState(const TableOptions& options)
      : options_(options), next_try_(options.from == From::file ? 1000 : 1) {}

  bool is_settled() const { return is_settled_; }  // what each column is, is known
  bool has_ended() const { return has_ended_; }
  const std::optional<Problem>& problem() const { return problem_; }
  std::string time_column() const { return time_place_ ? header_[*time_place_] : std::string(); }
  bool has(const std::string& column) const { return std::ranges::count(header_, column) > 0; }
  const std::vector<std::string>& columns() const { return columns_; }
  const std::vector<std::string>& units() const { return units_; }  // from the name, or from the row of units
  const std::vector<std::string>& header() const { return header_; }
  bool has_time() const { return time_place_ || arrow_; }
  const Times& times() const { return times_; }
  bool is_live() const { return options_.from != From::file; }
  Layout layout() const { return layout_; }
  bool splits_by_clock() const { return splits_by_clock_; }

 protected:
  // Of those that may be rows; null: it has not come.
  const Line* at(std::size_t i) const { return first_ + i < ahead_.size() ? &ahead_[first_ + i] : nullptr; }
  void refuse(Problem::Kind kind, const std::string& detail, std::size_t row = 0) {
    if (!problem_) problem_ = Problem{kind, row, "", detail};
  }
  void note(const std::string& text) { notes_.push_back(text); }
  void split_line(const std::string& text);
  bool is_port() const { return options_.from == From::port; }
  bool is_pipe() const { return options_.from == From::pipe; }
  bool is_of_time(std::size_t place) const { return time_place_ == place || part_place_ == place; }

  TableOptions options_;
  Layout layout_ = Layout::table;
  char separator_ = 0;  // 0: not known yet
  bool arrow_ = false;
  bool has_header_ = true;
  bool is_settled_ = false;
  bool has_ended_ = false;
  std::size_t next_try_;    // so many lines are looked at
  std::deque<Line> ahead_;  // not yet taken
  std::size_t first_ = 0;   // of those, the first that may be a row
  std::optional<Problem> problem_;
  std::vector<std::string> header_;
  std::vector<std::string> header_units_;
  std::string title_unit_;              // of columns that state none, by a title
  double frame_rate_hz_ = 0;            // likewise
  double frame_rows_ = 0;               // of each of Vicon's frames; 0: rows are counted
  std::optional<double> first_frame_;   // in rows
  bool is_section_ = false;             // of a file that may have more, Vicon's
  std::vector<std::string> elsewhere_;  // columns of sections that were passed over
  std::vector<std::string> cells_;
  std::size_t found_ = 0;
  Cells labelled_;
  std::string new_label_;           // of a line, which the header does not have
  std::vector<std::string> order_;  // of the header that came last; empty: that of the first
  std::vector<std::string> columns_;
  std::vector<std::string> units_;
  std::vector<std::size_t> places_;
  std::optional<std::size_t> time_place_;
  std::optional<std::size_t> clock_place_;  // hour, minute and second, three columns that are made one
  std::optional<std::size_t> part_place_;   // of the column with the rest of its seconds,
  double part_s_ = 0;                       // in this unit
  std::optional<std::size_t> segment_place_;
  bool labels_begin_ = false;     // a trial each, which goes on below them
  bool splits_by_clock_ = false;  // into trials
  Times times_;
  double time_zero_ = 0;     // in their unit, which 0 s is
  double packed_ticks_ = 0;  // a second, where the time is a clock as one number; 0: it is none
  std::vector<std::string> notes_;
  std::string left_out_;  // columns
};

class TableReader : public TableState {
 public:
  enum class Take { none, row, aside, malformed };  // malformed: or without a reading

  explicit TableReader(const TableOptions& options);

  // False: the line holds nothing. Swaps its text away.
  bool push(Line& line);
  void end() {
    has_ended_ = true;
    try_settle();
  }
  // A port was opened again: another header is another glove's.
  void cut() { is_fresh_ = true; }
  // What the next line is; none: more lines are needed, or there is a problem.
  Take take(Row& row);
  const Line& line() const { return line_; }  // the one that was taken
  // The values in it; 0: none.
  std::size_t found() const { return found_; }

  // Other columns than before, while no row was taken; none: as of TableOptions.
  void choose(const std::vector<std::string>& columns);
  // Of a live log, of which nothing is taken any more: the columns of the other glove; empty: none speaks.
  const std::string& refusal() const { return refusal_; }
  bool is_dated() const { return time_format_ && is_date(*time_format_); }
  std::vector<std::string> notes() const;

 private:
  void try_settle();
  bool skip_section(const std::vector<std::string>& header);
  bool is_header_again();
  bool is_anothers();
  bool is_whole(Problem& why);
  bool read_frame(double& t_s);
  bool read_time(double& t_s, Problem& why);
  bool read_values(std::vector<double>& value, Problem& why);
  const char* fault_of(const std::string& cell, double number, double& last);
  void leave_out(const Problem& why);

  std::string comment_ = options_.names;
  Line line_;
  bool is_new_ = false;             // line_ is not taken yet
  std::vector<std::string> other_;  // a header with other names; no row came yet
  bool is_over_ = false;            // another section follows
  bool is_fresh_ = false;           // plugged in, and no row came yet
  std::string refusal_;
  std::optional<TimeFormat> time_format_;
  std::vector<double> last_;  // of each column, the last whole number
  double last_time_ = 0;
  bool is_month_first_ = false;  // and noted
  char decimal_ = 0;             // what separates the fractions, once one was seen
  std::string segment_;
  std::size_t segments_ = 0;
  std::size_t malformed_ = 0;
  Problem first_malformed_{};
  std::size_t too_long_ = 0;  // of the malformed ones
  std::size_t headers_ = 0;   // that came again
  HoleCounter rows_{options_.holes};
};

}  // namespace flexor::recording
