#include "host/recording/unit.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <utility>
#include <vector>

namespace flexor::recording {
namespace {

struct Spelling {
  const char* unit;
  std::vector<const char*> written;  // lower case
};

// alpha: what the article's divider makes of counts, in degrees.
const std::vector<Spelling>& spellings() {
  static const std::vector<Spelling> all = {{"count", {"count", "counts", "adc", "lsb"}},
                                            {"V", {"v", "volt", "volts"}},
                                            {"mV", {"mv", "millivolt", "millivolts"}},
                                            {"ohm", {"ohm", "ohms", "Ω"}},
                                            {"kohm", {"kohm", "kohms", "kω", "kΩ"}},
                                            {"deg", {"deg", "degs", "degree", "degrees", "°", "alpha"}},
                                            {"rad", {"rad", "rads", "radian", "radians"}}};
  return all;
}

}  // namespace

std::string lower(std::string_view text) {
  std::string out(text);
  std::ranges::transform(out, out.begin(), [](unsigned char c) { return std::tolower(c); });
  return out;
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
  const char last = text.empty() ? '\0' : text.back();
  if (last == ')' || last == ']') {
    const std::size_t open = text.rfind(last == ')' ? '(' : '[');
    if (open != std::string::npos && open + 1 < text.size()) finish(open, open + 1, text.size() - 1);
  } else if (const std::size_t at = text.find_last_of("_ "); at != std::string::npos) {
    const std::string unit = text.substr(at + 1);
    if (known_unit(unit) || seconds_in(unit)) finish(at, at + 1, text.size());
  }
  out.name = lower(text);
  std::erase_if(out.name, [](char c) { return c == ' ' || c == '_'; });
  return out;
}

std::optional<std::string> known_unit(std::string_view text) {
  std::string wanted = lower(trimmed(text));
  if (wanted.size() > 2 && (wanted.front() == '(' || wanted.front() == '[')) {
    wanted = wanted.substr(1, wanted.size() - 2);
  }
  for (const Spelling& s : spellings()) {
    if (std::ranges::any_of(s.written, [&](const char* w) { return wanted == w; })) return s.unit;
  }
  return std::nullopt;
}

std::string unit_of(std::string_view column) {
  return known_unit(cut_name(column).unit).value_or(std::string());
}

std::string unknown_angle_unit(std::string_view column) {
  const std::string unit = cut_name(column).unit;
  if (!unit.empty()) return known_unit(unit) ? "" : unit;
  const std::string text = lower(trimmed(column));
  const std::string last = text.substr(text.find_last_of("_ ") + 1);
  for (const char* other : {"grad", "gon", "mrad", "turn", "turns", "percent", "%"}) {
    if (last == other && last.size() < text.size()) return last;
  }
  return "";
}

std::optional<double> seconds_in(std::string_view unit) {
  static constexpr std::array<std::pair<const char*, double>, 22> kUnits = {{{"s", 1},
                                                                             {"sec", 1},
                                                                             {"secs", 1},
                                                                             {"second", 1},
                                                                             {"seconds", 1},
                                                                             {"ms", 1e-3},
                                                                             {"msec", 1e-3},
                                                                             {"msecs", 1e-3},
                                                                             {"millis", 1e-3},
                                                                             {"millis()", 1e-3},
                                                                             {"millisecond", 1e-3},
                                                                             {"milliseconds", 1e-3},
                                                                             {"us", 1e-6},
                                                                             {"usec", 1e-6},
                                                                             {"µs", 1e-6},
                                                                             {"micros", 1e-6},
                                                                             {"micros()", 1e-6},
                                                                             {"microseconds", 1e-6},
                                                                             {"ns", 1e-9},
                                                                             {"nsec", 1e-9},
                                                                             {"nanoseconds", 1e-9},
                                                                             {"min", 60}}};
  std::string wanted = lower(trimmed(unit));
  if (wanted.size() > 2 && (wanted.front() == '(' || wanted.front() == '[')) {
    wanted = wanted.substr(1, wanted.size() - 2);
  }
  for (const auto& [name, seconds] : kUnits) {
    if (wanted == name) return seconds;
  }
  return std::nullopt;
}

}  // namespace flexor::recording
