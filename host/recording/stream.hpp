// Rows of a log, one after the other, with a clock that never runs backwards: what identify, apply and score read, from a file,
// from standard input or from memory.
//
// Clock repair looks one row ahead, and only where something is odd:
//  - the same time again: the row stays, a burst; where its readings are the same, too, it is left out.
//  - a row far ahead (more than kJump_s) that the next row does not confirm by following it closely: left out.
//  - a row that goes back, after which the clock goes on as before: left out.
//  - a clock that starts again (the board was reset): refused, or followed: what comes after it is placed one step after what
//    came before, because nobody knows how long the board was off.
//  - a counter that wraps, of 16 bits (65.536 s of milliseconds, also from -32.768) or of 32 (milliseconds or microseconds), or
//    midnight: goes on, where the step over it is about those before and the next row confirms it by following it closely.
// Of a log that comes as it is made no row that goes back is refused: it is left out. Each is reported with its row. What is kept
// does not grow with the log.
#pragma once

#include <array>
#include <deque>
#include <optional>
#include <string>
#include <vector>

namespace flexor::recording {

struct Row {
  double t_s = 0;
  std::vector<double> value;  // in the order of the columns
  std::size_t line = 0;       // as an editor counts; 0: not from a file
  std::size_t segment = 0;    // of several trials in one log
};

// What is known of a log's times.
struct Times {
  double wrap_s = 0;  // after so many seconds the clock starts from 0 again; 0: as a counter, or never
  double unit_s = 1;  // in which they are written
  bool is_unit_known = true;  // it is stated, or they are no numbers
  bool are_guessed = false;   // nothing says that their column is one
  std::string other = {};     // another column that could be it
  bool are_uneven = false;    // fractions of one to three digits: 17.5 may be 17.005
};

// The mend where a spreadsheet or MATLAB counts days, or has rounded times to six digits until they stand; null: neither. In the
// unit in which they are written.
const char* spreadsheet_mend(double value, double step);

// Of counters, after which they start from 0: 16 bits of milliseconds, 32 of microseconds, 32 of milliseconds.
inline constexpr std::array<double, 3> kWraps_s = {65.536, 4294.967296, 4294967.296};

// Rows of a log's columns, which are chosen before the first row is read.
class LogReader {
 public:
  virtual ~LogReader() = default;
  virtual const std::string& name() const = 0;  // for messages
  virtual const std::vector<std::string>& columns() const = 0;
  virtual const std::vector<std::string>& units() const = 0;  // of each column; empty: not stated
  virtual bool has(const std::string& column) const = 0;
  // Other columns than before; none: all of numbers. Throws io::InputError, listing those there are.
  virtual void choose(const std::vector<std::string>& columns) = 0;
  virtual bool next(Row& row) = 0;
  virtual std::string digest() const = 0;
  virtual std::string time_column() const = 0;
  virtual Times times() const { return {}; }
  virtual bool is_live() const { return false; }  // its rows come as they are made
  virtual bool splits_by_clock() const { return false; }
  // What was assumed or left out, a line each.
  virtual std::vector<std::string> notes() const { return {}; }
};

enum class Resets { refuse, follow, split };  // split: another segment

inline constexpr double kJump_s = 10;

class Stream {
 public:
  // The source must outlive the stream.
  Stream(LogReader& source, Resets resets) : source_(source), resets_(resets) {}

  // False at the end. Throws io::InputError, naming source and row: a reset that is to be refused, a clock
  // that goes back again and again (of a file), steps so long that the unit of the time must be another.
  bool next(Row& row);

  // The source's notes and what was repaired so far.
  std::vector<std::string> notes() const;

 private:
  struct Count {
    std::size_t rows = 0;
    std::size_t first_line = 0;
    double first_s = 0;
    void add(const Row& row) {
      if (rows++ > 0) return;
      first_line = row.line;
      first_s = row.t_s;
    }
  };

  bool read();  // one row of the source into ready_ or pending_; false at the end
  void note_step(double t_s);
  void accept(Row row);
  double wrap_of(const Row& row) const;  // 0: it has not wrapped
  void start_again(Row row);
  void begin_segment(Row row);
  void leave_out(const Row& row, Count& count);
  bool is_shuffled(double t_s);
  bool is_forgiven(std::size_t odd) const;
  std::string mend(std::string by_hand) const;  // of times that go back
  void check_unit() const;

  LogReader& source_;
  Resets resets_;
  std::deque<Row> ready_;
  std::optional<Row> pending_;
  bool started_ = false;
  double written_s_ = 0;  // of the newest row, as it stands in the log
  double last_s_ = 0;     // of the newest row that was accepted
  std::vector<double> last_value_;
  double last_step_s_ = 0.05;
  double shift_s_ = 0;
  std::size_t rows_ = 0;
  std::size_t segment_ = 0;
  std::size_t source_segment_ = 0;
  Count repeated_;
  Count doubled_;
  Count ahead_;
  Count back_;
  Count resets_seen_;
  Count wraps_;
  Count pauses_;
  double longest_pause_s_ = 0;
  std::vector<double> first_steps_s_;
};

}  // namespace flexor::recording
