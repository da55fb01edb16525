#include "host/recording/stream.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "host/io/io.hpp"
#include "host/io/numbers.hpp"
#include "host/recording/time.hpp"
#include "host/recording/unit.hpp"

namespace flexor::recording {
namespace {

using io::InputError;

constexpr std::size_t kOddRows = 3;  // so many odd rows are forgiven, and
constexpr double kOddShare = 0.01;   // one in a hundred
constexpr const char* kNoTimes =
    "if the log has no times, --log-rate 50 gives the rows a second where the command has it";
constexpr const char* kSort = "sort the log by time";
constexpr const char* kCut =
    "the clock was reset; cut the log there and use one part, or let identify take each for a trial: "
    "--segment clock";
constexpr std::size_t kFirstSteps = 9;  // that tell the unit
constexpr double kLongestStep_s = 5;
constexpr double kShortestStep_s = 1e-4;
// Where nothing says the unit: 1, 2, 3 and 4, 8, 12 may be rows or milliseconds.
constexpr double kLongestUnnamed_s = 0.99;
constexpr double kPause_s = 2;  // without a row, and so many steps: no log is made so, some rows lack
constexpr double kPauseSteps = 20;
constexpr double kLate_s = 1;  // a board that was reset has been silent for longer
// Of its range: a clock that goes back by so much has passed its end, and a counter where the step over it is at most so many: of
// 16 bits a reset is as likely.
constexpr double kWrapShare = 0.98;
constexpr double kWrapSteps = 5;

std::string row_name(std::size_t line) { return line > 0 ? fmt::format("row {}", line) : "a row"; }

}  // namespace

const char* spreadsheet_mend(double value, double step) {
  const bool is_rounded = step == 0 && value >= kFirstEpoch_s;
  const bool is_fast =
      step * kDay_s >= kShortestStep_s && step < kShortestStep_s && step * kDay_s <= kLongestStep_s;
  const bool is_date =
      (value > 20'000 && value < 70'000) || (value > 700'000 && value < 800'000);  // of 1954 to 2091
  if (is_rounded)
    return "was rounded by a spreadsheet, as to 1.77763E+12: give the cells the format 0 or 0.000 there and "
           "save again";
  if (is_fast ? is_date || (value > 0 && value < 1) : step == 0 && is_date && value != std::floor(value))
    return "are these days, as a spreadsheet counts them? show them there as hh:mm:ss.000, or as seconds, "
           "and save again";
  return nullptr;
}

bool Stream::next(Row& row) {
  while (ready_.empty())
    if (!read()) return false;
  row = std::move(ready_.front());
  ready_.pop_front();
  return true;
}

bool Stream::read() {
  Row row;
  if (!source_.next(row)) {
    // Nothing follows that would confirm it.
    if (const auto odd = std::exchange(pending_, {})) leave_out(*odd, odd->t_s > last_s_ ? ahead_ : back_);
    if (first_steps_s_.size() >= 2 && first_steps_s_.size() < kFirstSteps) check_unit();
    return false;
  }
  if (std::exchange(source_segment_, row.segment) != row.segment && started_) {
    if (const auto odd = std::exchange(pending_, {})) leave_out(*odd, ahead_);
    begin_segment(std::move(row));
    return true;
  }
  note_step(row.t_s);
  row.t_s += shift_s_;
  if (auto odd = std::exchange(pending_, {})) {
    const bool ahead = odd->t_s > last_s_;
    const double wrap_s = ahead ? 0 : wrap_of(*odd);
    const bool closely = ahead || wrap_s > 0;
    const bool confirmed =
        row.t_s >= odd->t_s && (closely ? row.t_s - odd->t_s <= kJump_s : row.t_s < last_s_);
    const double before = shift_s_;
    if (!confirmed) {
      leave_out(*odd, ahead ? ahead_ : back_);
    } else if (closely) {
      if (!ahead) wraps_.add(*odd);
      shift_s_ += wrap_s;
      odd->t_s += wrap_s;
      accept(std::move(*odd));
    } else {
      start_again(std::move(*odd));
    }
    row.t_s += shift_s_ - before;
  }
  if (const double step = row.t_s - last_s_; started_ && (step < 0 || step > kJump_s)) {
    pending_ = std::move(row);
  } else {
    accept(std::move(row));
  }
  return true;
}

// A counter stands within its range, which begins at 0, or half below it.
double Stream::wrap_of(const Row& row) const {
  const double own_s = source_.times().wrap_s;
  const double now_s = row.t_s - shift_s_;
  const double before_s = last_s_ - shift_s_;
  for (const double wrap_s : own_s > 0 ? std::vector{own_s} : std::vector(kWraps_s.begin(), kWraps_s.end())) {
    const bool counts =
        (now_s >= 0 && before_s <= wrap_s) || (now_s >= -wrap_s / 2 && before_s <= wrap_s / 2 && own_s == 0);
    const double step_s = now_s + wrap_s - before_s;
    const double most_s = own_s > 0 ? (1 - kWrapShare) * wrap_s : kWrapSteps * last_step_s_;
    if (counts && step_s >= 0 && step_s < most_s) return wrap_s;
  }
  return 0;
}

void Stream::note_step(double t_s) {
  const double step = t_s - written_s_;
  written_s_ = t_s;
  if (rows_++ == 0 || !(step > 0) || first_steps_s_.size() == kFirstSteps) return;
  first_steps_s_.push_back(step);
  if (first_steps_s_.size() == kFirstSteps) check_unit();
}

void Stream::accept(Row row) {
  const double step = row.t_s - last_s_;
  // A missing reading is as good as another.
  const auto is_same = [](double x, double y) { return x == y || (std::isnan(x) && std::isnan(y)); };
  if (started_ && step == 0 && std::ranges::equal(row.value, last_value_, is_same)) return doubled_.add(row);
  if (started_ && step == 0) repeated_.add(row);
  if (started_ && rows_ > kOddRows && step > kPause_s && step > kPauseSteps * last_step_s_) {
    pauses_.add(row);
    longest_pause_s_ = std::max(longest_pause_s_, step);
  }
  if (started_ && step > 0 && step <= kJump_s) last_step_s_ = step;
  started_ = true;
  last_s_ = row.t_s;
  last_value_ = row.value;
  row.segment = segment_;
  ready_.push_back(std::move(row));
}

void Stream::begin_segment(Row row) {
  ++segment_;
  shift_s_ = 0;
  written_s_ = row.t_s;
  started_ = false;
  accept(std::move(row));
}

void Stream::start_again(Row row) {
  if (resets_ == Resets::split) {
    row.t_s -= shift_s_;
    return begin_segment(std::move(row));
  }
  const bool too_often = !is_forgiven(resets_seen_.rows + 1);
  if (source_.is_live() && (too_often || last_s_ - row.t_s < kLate_s)) return leave_out(row, back_);
  resets_seen_.add(row);
  if (resets_ == Resets::refuse || too_often)
    throw InputError("{}: {}: time does not increase ({:g} s, then {:g} s, and it goes on from there): {}",
                     source_.name(), row_name(row.line), last_s_, row.t_s,
                     mend(too_often || is_shuffled(row.t_s) ? kSort : kCut));
  shift_s_ += last_s_ + last_step_s_ - row.t_s;
  row.t_s = last_s_ + last_step_s_;
  accept(std::move(row));
}

// By the rows that follow, which are not needed any more.
bool Stream::is_shuffled(double t_s) {
  std::size_t rows = 0;
  std::size_t back = 0;
  for (Row row; source_.next(row); ++rows)
    if (row.t_s < std::exchange(t_s, row.t_s)) ++back;
  return 4 * back > rows;
}

void Stream::leave_out(const Row& row, Count& count) {
  count.add(row);
  if (source_.is_live() || is_forgiven(ahead_.rows + back_.rows)) return;
  if (first_steps_s_.size() >= 2) check_unit();
  throw InputError("{}: {}: time does not increase (at least {} rows do not follow the one before); {}",
                   source_.name(), row_name(count.first_line), ahead_.rows + back_.rows, mend(kSort));
}

bool Stream::is_forgiven(std::size_t odd) const {
  return static_cast<double>(odd) <= static_cast<double>(kOddRows) + kOddShare * static_cast<double>(rows_);
}

std::string Stream::mend(std::string by_hand) const {
  const Times times = source_.times();
  if (times.are_guessed) return kNoTimes;
  if (times.are_uneven) by_hand += "; or are 5 ms written as 17.5 instead of 17.005? print them as %03u";
  if (times.other.empty()) return by_hand;
  return by_hand +
         fmt::format("; or take the other time: --time-column \"{}\" where the command has it", times.other);
}

// A time column in another unit than it says makes steps of which no glove log is made; the mend is one with which it would.
void Stream::check_unit() const {
  const double middle = io::median(first_steps_s_);
  const Times times = source_.times();
  const double longest_s = times.is_unit_known ? kLongestStep_s : kLongestUnnamed_s;
  if (middle >= kShortestStep_s && middle <= longest_s) return;
  if (middle >= kShortestStep_s && middle <= kLongestStep_s)
    throw InputError(
        "{}: time steps of {:.4g}, and nothing says of what: milliseconds, --time-unit ms; seconds, "
        "--time-unit s; or rows, which --log-rate 50 gives a second",
        source_.name(), middle);
  static constexpr std::array<std::pair<const char*, const char*>, 4> kUnits = {
      {{"s", "seconds"}, {"ms", "milliseconds"}, {"us", "microseconds"}, {"ns", "nanoseconds"}}};
  const double step = middle / times.unit_s;
  const auto* const unit = std::ranges::find_if(kUnits, [&](const auto& u) {
    const double step_s = step * *seconds_in(u.first);
    return step_s >= kShortestStep_s && step_s <= 0.2 * kLongestStep_s;
  });
  std::string mend = "is the time column in the unit that it states?";
  if (unit != kUnits.end())
    mend = fmt::format(
        "if the time column is in {0}, name it time_{1} or add --time-unit {1} where the command has it",
        unit->second, unit->first);
  if (const char* of_days = spreadsheet_mend(written_s_ / times.unit_s, step)) mend = of_days;
  if (times.are_guessed) mend += std::string("; ") + kNoTimes;
  throw InputError("{}: time steps of {:.4g} s, which no glove log has: {}", source_.name(), middle, mend);
}

std::vector<std::string> Stream::notes() const {
  std::vector<std::string> out = source_.notes();
  const auto say = [&](const Count& count, const std::string& what) {
    if (count.rows == 0) return;
    out.push_back(fmt::format("{}: {} row(s) {}", source_.name(), count.rows, what));
    if (count.first_line > 0) out.back() += fmt::format(", the first is row {}", count.first_line);
  };
  say(doubled_, "repeat the time and the readings of the row before and were left out");
  say(repeated_, "repeat the time of the row before and are taken as a burst");
  say(ahead_, fmt::format("with a time far ahead of all around ({:.10g} s) were left out", ahead_.first_s));
  say(back_, "with a time that goes backwards were left out");
  say(pauses_, fmt::format("come after a pause or jump of the clock, of up to {:.4g} s", longest_pause_s_));
  say(resets_seen_, "where the clock starts again: what follows is placed one step after what came before");
  say(wraps_, "where the clock's counter passes its end and starts from 0: it is taken to go on");
  return out;
}

}  // namespace flexor::recording
