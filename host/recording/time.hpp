// Times as people write them.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace flexor::recording {

// Of this machine, monotonic: flexor record and live write it beside each row of a source.
inline constexpr const char* kHostClock = "host_s";
inline constexpr double kFirstEpoch_s = 1e9;  // since 1970, of 2001: what is less is no date
inline constexpr double kDay_s = 86400;
inline bool is_epoch(double since_1970_s) { return since_1970_s >= kFirstEpoch_s && since_1970_s < 4e9; }

// What a person says of a log's times.
struct TimeOptions {
  TimeOptions() = default;
  TimeOptions(const char* unit_stated) : unit(unit_stated) {}

  std::string unit;                  // s, ms, us, ns: of a time column that states none
  std::vector<std::string> columns;  // which are the time: the first of them that a log has; empty: found
  double log_rate_hz = 0;            // rows a second of a log without any time
  // Of several trials in one file: their column, the first of these that it has, or clock, which starts again; empty: one trial.
  std::vector<std::string> segments;
};

// Behind every clock AM or PM may stand, behind a date's a zone: Z, UTC, +hh:mm, +hhmm.
enum class TimeFormat {
  number,  // in a unit that the column states
  iso,  // 2026-05-01T12:03:11.123, a blank or _ for the T, / or . for the -; 20260501120311[.123], 20260501T120311.123
  dotted,   // 1.5.2026 12:03:11.123 or 01.05.26: day first, nobody writes it otherwise
  clock,    // 12:03:11.123, 12-03-11.123 or May 01 12:03:11: since midnight
  minutes,  // 03:11.123: since the hour. With a fraction, for 03:11 may be hours and minutes
  slashed,  // 13/5/2026 12:03:11, 13-05-2026 or 13/05/26, one of the two numbers above 12, or month first with AM or PM
  named,  // 01-May-2026 12:03:11, May 1, 2026 12:03 or Fri May 01 12:03:11 2026
  days    // 0 days 00:00:01.020000, or 0.05 sec: since a start
};

struct Time {
  TimeFormat format;
  double value;               // seconds since 1970 or since midnight; a number as it is
  bool is_ambiguous = false;  // 05/06/2026 is the fifth of June or the sixth of May
};

inline bool is_date(TimeFormat f) {
  return f == TimeFormat::iso || f == TimeFormat::dotted || f == TimeFormat::slashed ||
         f == TimeFormat::named;
}

// None where the text is no time. Numbers that are not finite are none.
std::optional<Time> to_time(std::string_view text);

// A clock as one number, 120311.123 for 12:03:11.123: seconds since midnight.
std::optional<double> to_packed_clock(double number);
bool is_packed_date(std::string_view text);

// A plain decimal number, all of the text.
std::optional<double> to_number(std::string_view text);

// What a reading can be: finite, and at most 1e30 from 0; beyond, sums and squares would overflow.
bool is_measurement(double value);

// A cell in which nothing was read: empty, nan, NA, None, null or -, in capitals or not.
bool is_missing(std::string_view cell);

}  // namespace flexor::recording
