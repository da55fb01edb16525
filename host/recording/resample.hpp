// Uneven readings onto the even grid of a compensator, with nothing but past readings.
//
// The grid starts at the first reading: T_k = t_0 + k T. At T_k stands the mean of the readings since
// T_{k-1}; where there are none, what stood there before. A reading up to kTolerance_s after T_k belongs to
// it: logs are written in whole milliseconds. After a pause of more than kJump_s the grid starts again at the
// next reading, and nothing stands in between.
//
// A reading outside its column's range (a sensor on a rail) is never averaged with others: it stands at T_k
// only where nothing else was read since T_{k-1}, for the compensator to refuse.
//
// One reading brings at most (kJump_s / T) grid points; what is kept does not grow with the log.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "host/recording/recording.hpp"
#include "host/recording/stream.hpp"

namespace flexor::recording {

// What a compensator gets at one grid point.
struct Sample {
  double t_s = 0;
  std::span<const double> value;
  bool pause = false;  // the newest reading is older than max_gap_s
};

// Readings that mean something, both ends included.
struct Range {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
};

class Resampler {
 public:
  static constexpr double kTolerance_s = 0.0006;  // at most an eighth of the period

  // One range for each column; period_s > 0, max_gap_s > 0.
  Resampler(const std::vector<Range>& ranges, double period_s, double max_gap_s);

  // One reading of each column, t_s never decreasing. Calls sink(const Sample&) for each grid point that it
  // completes: those that it passes, and the one that it hits.
  template <class Sink>
  void push(double t_s, std::span<const double> value, Sink&& sink) {
    if (begin(t_s, sink)) {
      while (due() + tolerance_s_ < t_s) emit(sink);
    }
    take(t_s, value);
    if (t_s >= due() - tolerance_s_) emit(sink);
  }

 private:
  double due() const { return start_s_ + static_cast<double>(k_) * period_s_; }

  // False where the grid starts with this reading.
  template <class Sink>
  bool begin(double t_s, Sink& sink) {
    if (started_ && t_s - newest_s_ <= kJump_s) return true;
    if (started_ && read_) emit(sink);
    started_ = true;
    start_s_ = t_s;
    k_ = 0;
    return false;
  }

  void take(double t_s, std::span<const double> value);

  template <class Sink>
  void emit(Sink& sink) {
    close_cell();
    const double t_s = due();
    ++k_;
    sink(Sample{t_s, held_, t_s - newest_s_ > max_gap_s_});
  }

  void close_cell();

  double period_s_;
  double max_gap_s_;
  double tolerance_s_;
  bool started_ = false;
  double start_s_ = 0;
  std::uint64_t k_ = 0;
  double newest_s_ = 0;
  bool read_ = false;  // since the last grid point
  struct Column {
    Range range;
    std::size_t count = 0;  // readings in range since the last grid point
    double sum = 0;         // of them
    double refused = 0;     // the newest other one
  };
  std::vector<Column> columns_;
  std::vector<double> held_;  // at the last grid point
};

// All samples of one column of a recording.
struct Samples {
  std::vector<double> t_s;
  std::vector<double> value;
  std::vector<std::uint8_t> pause;
};
Samples resample(const Series& series, double period_s, double max_gap_s, const Range& range = {});

// A hole is what was read before it, or else the first that was read, or `otherwise`.
std::vector<double> held_over(std::vector<double> value, double otherwise);

// Of the readings, without holes and without the few that lie three times as far from all others as these are wide: a malformed line, a spike.
Range without_spikes(std::span<const double> value);

// 1 for each reading, 0 for one or two that jump away from their neighbours and back, each way in one step of a third of the range at
// least, faster than the range in 80 ms and five times as far as nearly all others, while the finger hardly moves before and after:
// what a tracker says that has lost its mark.
std::vector<std::uint8_t> without_jumps(const Series& series);

// Where values go one way and then the other, `turn` or more each: the places where the first way begins, where each ends and the
// next begins, and where the last one ends.
std::vector<std::size_t> ends_of_ways(std::span<const double> value, double turn);

// What counts as a pause of this log: five of its steps, at least 0.3 s. Its step is the one in which half of
// the log's time has passed, longer steps counted last: rows that come in bursts count little, since little
// time passes in them. Steps over kJump_s are left out, as are a few that are long in place of the others: holes.
double default_max_gap_s(std::span<const double> t_s);

// Times in seconds since the first, rounded to microseconds, so that results do not depend on where a clock
// started.
std::vector<double> since_start(std::span<const double> t_s);

}  // namespace flexor::recording
