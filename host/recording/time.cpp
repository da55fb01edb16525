#include "host/recording/time.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <chrono>
#include <cmath>

#include "host/recording/unit.hpp"

namespace flexor::recording {
namespace {

// Takes numbers off the front of a text, by a pattern: d has 1 or 2 digits, m 2, y 4, s is seconds[.fff] or [,fff], also .fff,fff
// as Zephyr has it; n is a month's name.
bool take(std::string_view& text, std::string_view pattern, double* value) {
  // English, German, Italian; what Spanish, Portuguese and Dutch have otherwise.
  static constexpr std::string_view kMonths =
      "janfebmaraprmayjunjulaugsepoctnovdecjanfebmrzaprmaijunjulaugsepoktnovdezgenfebmaraprmaggiulugagosetott"
      "novdicenefevmrtabrmeijunjulagosetoutnovdic";
  std::string_view rest = text;
  const auto digit = [&](std::size_t n) { return n < rest.size() && rest[n] >= '0' && rest[n] <= '9'; };
  for (const char p : pattern) {
    const bool is_number = std::string_view("dmys").find(p) != std::string_view::npos;
    const std::size_t most = p == 'y' ? 4 : 2;
    std::size_t n = is_number || !rest.starts_with(p) ? 0 : 1;
    for (*value = 0; is_number && n < most && digit(n); ++n) *value = *value * 10 + (rest[n] - '0');
    if (p == 'n') {
      const std::size_t month = rest.size() < 3 ? 1 : kMonths.find(lower(rest.substr(0, 3)));
      *value = static_cast<double>(month / 3 % 12 + 1);
      for (n = 0; month < kMonths.size() && month % 3 == 0 && n < rest.size() &&
                  std::isalpha(static_cast<unsigned char>(rest[n]));)
        ++n;
    }
    for (; p == ' ' && n > 0 && n < rest.size() && rest[n] == ' ';) ++n;
    if (n < (p == 'y' ? 4U : p == 'm' ? 2U : 1U)) return false;
    if (p == 's' && n < rest.size() && (rest[n] == '.' || rest[n] == ',')) {
      if (!digit(n + 1)) return false;
      double unit = 0.1;
      const std::size_t point = n;
      for (++n; digit(n) ||
                (n == point + 4 && rest[n - 4] == '.' && rest.substr(n).starts_with(',') && digit(n + 1));
           ++n) {
        if (rest[n] == ',') continue;
        *value += unit * (rest[n] - '0');
        unit /= 10;
      }
    }
    rest.remove_prefix(n);
    value += is_number || p == 'n' ? 1 : 0;
  }
  text = rest;
  return true;
}

bool has_digits_alone(std::string_view text) {
  return text.find_first_not_of("0123456789") == std::string_view::npos;
}

// By name, which is left out: all of a log is in one.
constexpr const char* kZones =
    "z utc gmt cet cest met mest wet west eet eest bst msk ist jst kst sgt hkt aest aedt nzst nzdt est edt "
    "cst "
    "cdt mst mdt pst pdt";

// Of the day, AM or PM or a zone behind it; 9:59:30:50 and 9:59:30::050 have 50 ms; 12-03-11 in file names; or 120311 and 120311123.
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
  std::string half = lower(trimmed(text));
  std::erase_if(half, [](char c) { return c == '.' || c == ' '; });  // p. m.
  if (half == "am" || half == "pm") {
    text = {};
    if (of[0] < 1 || of[0] > 12) return false;
    of[0] = (of[0] < 12 ? of[0] : 0) + (half == "pm" ? 12 : 0);
  }
  const std::string_view behind = trimmed(text);
  const std::size_t word = std::min(behind.find_first_of(" +-"), behind.size());
  if (is_one_of(behind.substr(0, word), kZones)) text = behind.substr(word);
  value_s = of[0] * 3600 + of[1] * 60 + of[2] + thousandths.value_or(0) / 1000;
  return true;
}

constexpr std::array kDates = {"y-d-d", "y/d/d", "y.d.d", "ymm",    "d.d.y",  "d.d.m", "d/d/y", "d-d-y",
                               "d/d/m", "d-n-y", "d n y", "d. n y", "n d, y", "n d y", "n d"};

// A date, then a clock. Of slashes day first, but with AM or PM; where that is no date, the other first.
std::optional<Time> to_date(std::string_view text) {
  std::array<double, 5> of{};
  std::array<double, 3> zone{};
  double clock_s = 0;
  const std::size_t word = text.find_first_of(" ,");
  if (word != text.npos && word > 2 && is_one_of(text.substr(0, 3), "mon tue wed thu fri sat sun"))
    text.remove_prefix(std::min(text.find_first_not_of(" ,", word), text.size()));
  const auto kind = std::ranges::find_if(kDates, [&](const char* k) { return take(text, k, of.data()); });
  if (kind == kDates.end()) return std::nullopt;
  const std::string_view pattern = *kind;
  const std::size_t gap = text.find_first_not_of(",T_ ");
  if ((gap == 0 && pattern != "ymm") || gap > 3) return std::nullopt;
  text.remove_prefix(gap);
  const bool has_half = lower(trimmed(text)).ends_with('m') || text.ends_with('.');
  if (!take_clock(text, clock_s)) return std::nullopt;
  text = trimmed(text);
  const char first = pattern.front();
  double year = pattern == "n d" ? 0 : of[first == 'y' ? 0 : 2];
  if (pattern == "n d" && take(text, "y", &year)) text = trimmed(text);
  if (year == 0) return text.empty() ? std::optional(Time{TimeFormat::clock, clock_s}) : std::nullopt;
  if (year < 100) year += 2000;
  const double sign = text.starts_with('-') ? -1 : 1;
  if (!text.empty() && !take(text, sign < 0 ? "-m:m" : "+m:m", zone.data()) &&
      !take(text, sign < 0 ? "-mm" : "+mm", zone.data()))
    return std::nullopt;
  double month = of[first == 'n' ? 0 : 1];
  double day = of[first == 'y' ? 2 : first == 'n' ? 1 : 0];
  const TimeFormat format = first == 'y'                        ? TimeFormat::iso
                            : pattern.find('n') != pattern.npos ? TimeFormat::named
                            : pattern[1] == '.'                 ? TimeFormat::dotted
                                                                : TimeFormat::slashed;
  const bool may_be_both = format == TimeFormat::slashed && month <= 12 && day <= 12 && month != day;
  if (format == TimeFormat::slashed && (has_half || month > 12) && day <= 12) std::swap(month, day);
  const std::chrono::year_month_day date{std::chrono::year(static_cast<int>(year)),
                                         std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day))};
  if (!date.ok() || !text.empty()) return std::nullopt;
  const auto midnight_s =
      static_cast<double>(std::chrono::sys_days(date).time_since_epoch().count()) * kDay_s;
  return Time{format, midnight_s + clock_s - sign * (zone[0] * 3600 + zone[1] * 60),
              may_be_both && !has_half};
}

// As pandas and Python have it, also -1 days +23:59:59.95; or with its unit in each cell, as MATLAB and R write durations.
std::optional<Time> to_days(std::string_view text) {
  const std::size_t word = text.find(' ');
  const auto number = word == text.npos ? std::nullopt : to_number(text.substr(0, word));
  if (!number) return std::nullopt;
  if (const auto unit_s = seconds_in(text.substr(word))) return Time{TimeFormat::days, *number * *unit_s};
  double clock_s = 0;
  if (!text.substr(word).starts_with(" day") || *number != std::floor(*number)) return std::nullopt;
  text = text.substr(std::min(text.find_first_not_of("days, +", word), text.size()));
  if (text.empty() || !take_clock(text, clock_s) || !text.empty()) return std::nullopt;
  return Time{TimeFormat::days, *number * kDay_s + clock_s};
}

}  // namespace

std::optional<double> to_number(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

bool is_measurement(double value) { return std::abs(value) <= 1e30; }

bool is_missing(std::string_view cell) {
  if (cell.empty() || cell.size() > 9 || cell.find_first_of("0123456789") < 2) return cell.empty();
  return is_one_of(cell,
                   "nan -nan nan(ind) -nan(ind) nat na n/a n.a. <na> none null - -- ? . #n/a #nv #div/0!");
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
  return may_be && has_digits_alone(whole) && to_date(text);
}

std::optional<Time> to_time(std::string_view text) {
  text = trimmed(text);
  if (const auto number = to_number(text); number && !is_packed_date(text))
    return std::isfinite(*number) ? std::optional(Time{TimeFormat::number, *number}) : std::nullopt;
  double clock_s = 0;
  std::string_view rest = text;
  if (take_clock(rest, clock_s) && rest.empty()) return Time{TimeFormat::clock, clock_s};
  if (const auto date = to_date(text)) return date;
  if (const auto days = to_days(text)) return days;
  std::array<double, 3> of{};
  const bool has_fraction = text.find_first_of(".,") == text.find(':') + 3;
  if (has_fraction && take(text, "d:s", of.data()) && text.empty() && of[0] <= 59 && of[1] < 61)
    return Time{TimeFormat::minutes, of[0] * 60 + of[1]};
  return std::nullopt;
}

}  // namespace flexor::recording
