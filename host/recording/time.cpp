#include "host/recording/time.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>

#include "host/recording/unit.hpp"

namespace flexor::recording {
namespace {

// Takes numbers off the front of a text, by a pattern: d has 1 or 2 digits, m 2, y 4, s is seconds[.fff] or [,fff].
bool take(std::string_view& text, std::string_view pattern, double* value) {
  std::string_view rest = text;
  const auto digit = [&](std::size_t n) { return n < rest.size() && rest[n] >= '0' && rest[n] <= '9'; };
  for (const char p : pattern) {
    const bool is_number = std::string_view("dmys").find(p) != std::string_view::npos;
    const std::size_t most = p == 'y' ? 4 : 2;
    std::size_t n = is_number || !rest.starts_with(p) ? 0 : 1;
    for (*value = 0; is_number && n < most && digit(n); ++n) *value = *value * 10 + (rest[n] - '0');
    if (n < (p == 'y' ? 4U : p == 'm' ? 2U : 1U)) return false;
    if (p == 's' && n < rest.size() && (rest[n] == '.' || rest[n] == ',')) {
      if (!digit(n + 1)) return false;
      double unit = 0.1;
      for (++n; digit(n); ++n, unit /= 10) *value += unit * (rest[n] - '0');
    }
    rest.remove_prefix(n);
    if (is_number) ++value;
  }
  text = rest;
  return true;
}

bool has_digits_alone(std::string_view text) {
  return text.find_first_not_of("0123456789") == std::string_view::npos;
}

// Of the day, AM or PM behind it or not; 9:59:30:50 and 9:59:30::050 have 50 ms; or as file names have it, 12-03-11; or of digits alone, 120311 or
// 120311123.
bool take_clock(std::string_view& text, double& value_s) {
  std::array<double, 4> of{};  // hour, minute, second
  const char separator = take(text, "d:d:s", of.data()) ? ':' : take(text, "m-m-s", of.data()) ? '-' : '\0';
  if (separator == '\0' && !take(text, "mms", of.data())) return false;
  if (of[0] > 24 || of[1] > 59 || of[2] >= 61) return false;
  const std::string_view rest = text.substr(std::min(text.find_first_not_of(separator), text.size()));
  const bool counts_frames = rest.size() == 2 && rest.starts_with('0');  // as films do, 0 to 23 or 29
  const bool may_be = separator != '\0' ? rest.size() < text.size() && rest.size() < 4 : rest.size() == 3;
  const auto thousandths =
      may_be && !counts_frames && has_digits_alone(rest) ? to_number(rest) : std::nullopt;
  if (thousandths) text = {};
  const std::string half = lower(trimmed(text));
  if (half == "am" || half == "pm") {
    text = {};
    if (of[0] < 1 || of[0] > 12) return false;
    of[0] = (of[0] < 12 ? of[0] : 0) + (half == "pm" ? 12 : 0);
  }
  value_s = of[0] * 3600 + of[1] * 60 + of[2] + thousandths.value_or(0) / 1000;
  return true;
}

std::optional<double> since_1970(double year, double month, double day) {
  const std::chrono::year_month_day date{std::chrono::year(static_cast<int>(year)),
                                         std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day))};
  if (!date.ok()) return std::nullopt;
  return static_cast<double>(std::chrono::sys_days(date).time_since_epoch().count()) * 86400;
}

std::optional<double> to_iso(std::string_view text) {
  std::array<double, 4> of{};
  std::array<double, 3> zone{};
  double clock_s = 0;
  const bool is_packed = take(text, "ymm", of.data());
  if (!is_packed && !take(text, "y-d-d", of.data()) && !take(text, "y/d/d", of.data())) return std::nullopt;
  const bool has_gap = text.starts_with('T') || text.starts_with(' ') || text.starts_with('_');
  if (!has_gap && !is_packed) return std::nullopt;
  text.remove_prefix(has_gap ? 1 : 0);
  if (!take_clock(text, clock_s)) return std::nullopt;
  text = trimmed(text);
  const double sign = text.starts_with('-') ? -1 : 1;
  if (text == "Z" || text == "UTC") text = {};
  if (!text.empty() && !take(text, sign < 0 ? "-m:m" : "+m:m", zone.data()) &&
      !take(text, sign < 0 ? "-mm" : "+mm", zone.data()))
    return std::nullopt;
  const auto date = since_1970(of[0], of[1], of[2]);
  if (!date || !text.empty()) return std::nullopt;
  return *date + clock_s - sign * (zone[0] * 3600 + zone[1] * 60);
}

// dd.mm.yyyy or dd/mm/yyyy, then a clock. Day first; where that is no date, month first.
std::optional<Time> to_date(std::string_view text, char separator) {
  std::array<double, 4> of{};
  double clock_s = 0;
  if (!take(text, separator == '.' ? "d.d.y" : "d/d/y", of.data())) return std::nullopt;
  if (text.starts_with(',')) text.remove_prefix(1);
  text = trimmed(text);
  if (!take_clock(text, clock_s) || !trimmed(text).empty()) return std::nullopt;
  auto date = since_1970(of[2], of[1], of[0]);
  if (!date && separator == '/') date = since_1970(of[2], of[0], of[1]);
  if (!date) return std::nullopt;
  return Time{separator == '.' ? TimeFormat::dotted : TimeFormat::slashed, *date + clock_s,
              separator == '/' && of[0] <= 12 && of[1] <= 12 && of[0] != of[1]};
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

std::optional<double> to_packed_clock(double number) {
  const double hour = std::floor(number / 1e4);
  const double minute = std::floor(number / 100) - 100 * hour;
  const double second = number - 100 * std::floor(number / 100);
  if (!(hour >= 0 && hour <= 24 && minute < 60 && second < 60)) return std::nullopt;
  return 3600 * hour + 60 * minute + second;
}

bool is_packed_date(std::string_view text) {
  const std::string_view whole = text.substr(0, text.find_first_of(".,"));
  const bool may_be =
      (whole.size() == 14 || text.size() == 17) && (text.starts_with("19") || text.starts_with("20"));
  return may_be && has_digits_alone(whole) && to_iso(text);
}

std::optional<Time> to_time(std::string_view text) {
  text = trimmed(text);
  if (const auto number = to_number(text); number && !is_packed_date(text)) {
    if (!std::isfinite(*number)) return std::nullopt;
    return Time{TimeFormat::number, *number};
  }
  if (const auto iso = to_iso(text)) return Time{TimeFormat::iso, *iso};
  if (const auto date = to_date(text, '.')) return date;
  if (const auto date = to_date(text, '/')) return date;
  double clock_s = 0;
  std::string_view rest = text;
  if (take_clock(rest, clock_s) && rest.empty()) return Time{TimeFormat::clock, clock_s};
  std::array<double, 3> of{};
  const bool has_fraction = text.find_first_of(".,") == text.find(':') + 3;
  if (has_fraction && take(text, "d:s", of.data()) && text.empty() && of[0] <= 59 && of[1] < 61)
    return Time{TimeFormat::minutes, of[0] * 60 + of[1]};
  return std::nullopt;
}

}  // namespace flexor::recording
