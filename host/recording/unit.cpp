#include "host/recording/unit.hpp"

#include <algorithm>
#include <cctype>
#include <vector>

namespace flexor::recording {
namespace {

struct Unit {
  const char* name;
  double seconds;                    // in one; 0: it is none of time
  std::vector<const char*> written;  // lower case
};

// alpha: what the article's divider makes of counts, in degrees.
const std::vector<Unit>& units() {
  static const std::vector<Unit> all = {
      {"count", 0, {"count", "counts", "adc", "lsb"}},
      {"V", 0, {"v", "volt", "volts"}},
      {"mV", 0, {"mv", "millivolt", "millivolts"}},
      {"ohm", 0, {"ohm", "ohms", "Ω"}},
      {"kohm", 0, {"kohm", "kohms", "kω", "kΩ"}},
      {"deg", 0, {"deg", "degs", "degree", "degrees", "°", "alpha"}},
      {"rad", 0, {"rad", "rads", "radian", "radians"}},
      {"mm", 0, {"mm", "millimeter", "millimeters", "millimetres"}},
      {"s", 1, {"s", "sec", "secs", "second", "seconds"}},
      {"ms", 1e-3, {"ms", "msec", "msecs", "millis", "millis()", "millisecond", "milliseconds"}},
      {"us", 1e-6, {"us", "usec", "usecs", "µs", "μs", "micros", "micros()", "microsec", "microseconds"}},
      {"ns", 1e-9, {"ns", "nsec", "nsecs", "nanos", "nanosec", "nanosecs", "nanoseconds"}},
      {"min", 60, {"min", "mins", "minute", "minutes"}},
      {"h", 3600, {"h", "hr", "hour", "hours"}}};
  return all;
}

// In lower case, without brackets.
std::string bare(std::string_view text) {
  const std::string out = lower(trimmed(text));
  const bool has_brackets = out.size() > 2 && (out.front() == '(' || out.front() == '[');
  return has_brackets ? out.substr(1, out.size() - 2) : out;
}

// Null: it is none that Flexor knows.
const Unit* find_unit(std::string_view text) {
  const std::string wanted = bare(text);
  for (const Unit& unit : units()) {
    if (std::ranges::any_of(unit.written, [&](const char* w) { return wanted == w; })) return &unit;
  }
  return nullptr;
}

}  // namespace

std::string lower(std::string_view text) {
  std::string out(text);
  std::ranges::transform(out, out.begin(), [](unsigned char c) { return std::tolower(c); });
  return out;
}

bool is_one_of(std::string_view word, std::string_view list) {
  if (word.empty() || word.size() > 15 || word.find(' ') != word.npos) return false;
  return (' ' + std::string(list) + ' ').find(' ' + lower(word) + ' ') != std::string::npos;
}

std::string_view trimmed(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

NameAndUnit cut_name(std::string_view column) {
  std::string text(trimmed(column));
  NameAndUnit out;
  const auto finish = [&](std::size_t name_end, std::size_t unit_begin, std::size_t unit_end) {
    out.unit = trimmed(std::string_view(text).substr(unit_begin, unit_end - unit_begin));
    text.resize(name_end);
  };
  text.erase(0, text.find_first_not_of("% "));  // ROS and MATLAB
  const char last = text.empty() ? '\0' : text.back();
  if (last == ')' || last == ']') {
    const std::size_t open = text.rfind(last == ')' ? '(' : '[');
    if (open != std::string::npos && open + 1 < text.size()) finish(open, open + 1, text.size() - 1);
  } else if (const std::size_t at = text.find_last_of("_ /"); at != std::string::npos) {
    const std::string unit = text.substr(at + 1);
    if (known_unit(unit) || seconds_in(unit)) finish(at, at + 1, text.size());
  }
  out.name = lower(text);
  std::erase_if(out.name, [](char c) { return c == ' ' || c == '_' || c == '/' || c == ','; });
  return out;
}

std::optional<std::string> known_unit(std::string_view text) {
  const Unit* unit = find_unit(text);
  return unit != nullptr && unit->seconds == 0 ? std::optional<std::string>(unit->name) : std::nullopt;
}

std::string unit_of(std::string_view column) {
  return known_unit(cut_name(column).unit).value_or(std::string());
}

std::string without_unit(std::string_view column) {
  const std::string name(trimmed(column));
  const std::string unit = cut_name(name).unit;
  if (unit.empty() || unit_of(name).empty()) return name;
  const std::string out = name.substr(0, name.find_last_not_of(" _([", name.rfind(unit) - 1) + 1);
  return out.empty() ? name : out;
}

std::string unknown_angle_unit(std::string_view column) {
  const std::string unit = cut_name(column).unit;
  if (!unit.empty()) return known_unit(unit) ? "" : unit;
  const std::string text = lower(trimmed(column));
  const std::string last = text.substr(text.find_last_of("_ ") + 1);
  return last.size() < text.size() && is_one_of(last, "grad gon mrad turn turns percent %") ? last : "";
}

std::optional<double> seconds_in(std::string_view text) {
  const Unit* unit = find_unit(text);
  return unit != nullptr && unit->seconds > 0 ? std::optional(unit->seconds) : std::nullopt;
}

}  // namespace flexor::recording
