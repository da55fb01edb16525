#include "host/recording/time.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>

#include "host/recording/unit.hpp"

namespace flexor::recording {
namespace {

// Takes pieces off the front of a text; false and nothing taken where the piece is not there.
class Scanner {
 public:
  explicit Scanner(std::string_view text) : rest_(text) {}

  bool digits(int& value, std::size_t least, std::size_t most) {
    std::size_t n = 0;
    int v = 0;
    while (n < rest_.size() && n < most && rest_[n] >= '0' && rest_[n] <= '9')
      v = v * 10 + (rest_[n++] - '0');
    if (n < least || (n < rest_.size() && rest_[n] >= '0' && rest_[n] <= '9')) return false;
    value = v;
    rest_.remove_prefix(n);
    return true;
  }

  bool one(char wanted) {
    if (rest_.empty() || rest_.front() != wanted) return false;
    rest_.remove_prefix(1);
    return true;
  }

  // ss[.fff] or ss[,fff]
  bool seconds(double& value) {
    int whole = 0;
    if (!digits(whole, 1, 2)) return false;
    value = whole;
    if (!one('.') && !one(',')) return true;
    double unit = 0.1;
    std::size_t n = 0;
    for (; n < rest_.size() && rest_[n] >= '0' && rest_[n] <= '9'; ++n, unit /= 10)
      value += unit * (rest_[n] - '0');
    rest_.remove_prefix(n);
    return n > 0;
  }

  bool clock(double& value_s) {
    int hour = 0;
    int minute = 0;
    double second = 0;
    if (!digits(hour, 1, 2) || !one(':') || !digits(minute, 2, 2) || !one(':') || !seconds(second))
      return false;
    if (hour > 24 || minute > 59 || second >= 61 || !half_of_day(hour)) return false;
    value_s = hour * 3600 + minute * 60 + second;
    return true;
  }

  // mm:ss.fff
  bool minutes(double& value_s) {
    int minute = 0;
    double second = 0;
    if (!digits(minute, 1, 2) || !one(':') || rest_.find_first_of(".,") != 2 || !seconds(second))
      return false;
    if (minute > 59 || second >= 61) return false;
    value_s = minute * 60 + second;
    return true;
  }

  bool zone(double& value_s) {
    value_s = 0;
    if (rest_.empty() || one('Z')) return true;
    const bool east = one('+');
    int hour = 0;
    int minute = 0;
    if ((!east && !one('-')) || !digits(hour, 2, 2) || !one(':') || !digits(minute, 2, 2)) return false;
    value_s = (east ? 1 : -1) * (hour * 3600.0 + minute * 60.0);
    return true;
  }

  void blanks() {
    while (!rest_.empty() && rest_.front() == ' ') rest_.remove_prefix(1);
  }
  bool at_end() const { return rest_.empty(); }

 private:
  // AM or PM, if it stands there; false where the hour is none of it.
  bool half_of_day(int& hour) {
    const std::string text = lower(trimmed(rest_));
    if (text != "am" && text != "pm") return true;
    rest_ = {};
    if (hour < 1 || hour > 12) return false;
    hour = hour % 12 + (text == "pm" ? 12 : 0);
    return true;
  }

  std::string_view rest_;
};

std::optional<double> since_1970(int year, int month, int day) {
  const std::chrono::year_month_day date{std::chrono::year(year),
                                         std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day))};
  if (!date.ok()) return std::nullopt;
  return static_cast<double>(std::chrono::sys_days(date).time_since_epoch().count()) * 86400;
}

std::optional<double> to_iso(std::string_view text) {
  Scanner s(text);
  int year = 0;
  int month = 0;
  int day = 0;
  double clock_s = 0;
  double zone_s = 0;
  if (!s.digits(year, 4, 4) || !s.one('-') || !s.digits(month, 1, 2) || !s.one('-') || !s.digits(day, 1, 2) ||
      (!s.one('T') && !s.one(' ')) || !s.clock(clock_s)) {
    return std::nullopt;
  }
  s.blanks();
  if (!s.zone(zone_s) || !s.at_end()) return std::nullopt;
  const auto date = since_1970(year, month, day);
  if (!date) return std::nullopt;
  return *date + clock_s - zone_s;
}

struct Date {
  int first;
  int second;
  double value;  // day first; where that is no date, month first
};

// dd.mm.yyyy or dd/mm/yyyy, then a clock.
std::optional<Date> to_date(std::string_view text, char separator) {
  Scanner s(text);
  int first = 0;
  int second = 0;
  int year = 0;
  double clock_s = 0;
  if (!s.digits(first, 1, 2) || !s.one(separator) || !s.digits(second, 1, 2) || !s.one(separator) ||
      !s.digits(year, 4, 4)) {
    return std::nullopt;
  }
  (void)s.one(',');
  s.blanks();
  if (!s.clock(clock_s)) return std::nullopt;
  s.blanks();
  if (!s.at_end()) return std::nullopt;
  auto date = since_1970(year, second, first);
  if (!date && separator == '/') date = since_1970(year, first, second);
  if (!date) return std::nullopt;
  return Date{first, second, *date + clock_s};
}

}  // namespace

std::optional<double> to_number(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

bool is_measurement(double value) {
  constexpr double kLargest = 1e30;
  return std::abs(value) <= kLargest;
}

bool is_missing(std::string_view cell) {
  static constexpr std::array kMissing = {"nan", "na", "n/a", "none", "null", "-", "--", "#n/a"};
  if (cell.empty() || cell.size() > 4 || (cell.front() >= '0' && cell.front() <= '9')) return cell.empty();
  return std::ranges::find(kMissing, lower(cell)) != kMissing.end();
}

bool is_ambiguous_date(std::string_view text) {
  const auto date = to_date(trimmed(text), '/');
  return date && date->first <= 12 && date->second <= 12 && date->first != date->second;
}

std::optional<Time> to_time(std::string_view text) {
  text = trimmed(text);
  if (const auto number = to_number(text)) {
    if (!std::isfinite(*number)) return std::nullopt;
    return Time{TimeFormat::number, *number};
  }
  if (const auto iso = to_iso(text)) return Time{TimeFormat::iso, *iso};
  if (const auto date = to_date(text, '.')) return Time{TimeFormat::dotted, date->value};
  if (const auto date = to_date(text, '/')) return Time{TimeFormat::slashed, date->value};
  Scanner s(text);
  double clock_s = 0;
  if (s.clock(clock_s) && s.at_end()) return Time{TimeFormat::clock, clock_s};
  Scanner short_one(text);
  if (short_one.minutes(clock_s) && short_one.at_end()) return Time{TimeFormat::minutes, clock_s};
  return std::nullopt;
}

}  // namespace flexor::recording
