#include "host/recording/unit.hpp"

#include <algorithm>
#include <cctype>

namespace flexor::recording {
namespace {

struct Unit {
  const char* name;
  double seconds;  // in one; 0: it is none of time
  const char* written;
};

// alpha: what the article's divider makes of counts, in degrees.
constexpr Unit kUnits[] = {{"count", 0, "count counts adc lsb"},
                           {"V", 0, "v volt volts"},
                           {"mV", 0, "mv millivolt millivolts"},
                           {"ohm", 0, "ohm ohms Ω"},
                           {"kohm", 0, "kohm kohms kω kΩ"},
                           {"deg", 0, "deg degs degree degrees ° alpha"},
                           {"rad", 0, "rad rads radian radians"},
                           {"mm", 0, "mm millimeter millimeters millimetres"},
                           {"s", 1, "s sec secs second seconds"},
                           {"ms", 1e-3, "ms msec msecs millis millis() millisecond milliseconds"},
                           {"us", 1e-6, "us usec usecs µs μs micros micros() microsec microseconds"},
                           {"ns", 1e-9, "ns nsec nsecs nanos nanosec nanosecs nanoseconds"},
                           {"min", 60, "min mins minute minutes"},
                           {"h", 3600, "h hr hour hours"}};

// In brackets or not. Null: it is none that Flexor knows.
const Unit* find_unit(std::string_view text) {
  text = trimmed(text);
  if (text.size() > 2 && (text.front() == '(' || text.front() == '[')) text = text.substr(1, text.size() - 2);
  const auto unit = std::ranges::find_if(kUnits, [&](const Unit& u) { return is_one_of(text, u.written); });
  return unit == std::end(kUnits) ? nullptr : unit;
}

}  // namespace

std::string lower(std::string_view text) {
  std::string out(text);
  std::ranges::transform(out, out.begin(), [](unsigned char c) { return std::tolower(c); });
  return out;
}

bool is_one_of(std::string_view word, std::string_view list) {
  if (word.empty() || word.size() > 15 || word.find(' ') != word.npos) return false;
  const std::string wanted = lower(word);
  for (std::size_t at = list.find(wanted); at != list.npos; at = list.find(wanted, at + 1)) {
    const std::size_t end = at + wanted.size();
    if ((at == 0 || list[at - 1] == ' ') && (end == list.size() || list[end] == ' ')) return true;
  }
  return false;
}

std::string_view trimmed(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

NameAndUnit cut_name(std::string_view column) {
  std::string_view text = trimmed(column);
  text.remove_prefix(std::min(text.find_first_not_of("% "), text.size()));  // ROS and MATLAB
  const bool has_brackets = text.ends_with(')') || text.ends_with(']');
  const std::size_t at =
      has_brackets ? text.rfind(text.ends_with(')') ? '(' : '[') : text.find_last_of("_ /");
  const std::string_view rest = at == text.npos ? "" : text.substr(at + 1);
  NameAndUnit out;
  if (has_brackets ? !rest.empty() : is_unit(rest)) {
    out.unit = trimmed(rest.substr(0, rest.size() - (has_brackets ? 1 : 0)));
    text = text.substr(0, at);
    const std::size_t before = text.find_last_of("_ /");  // thumb_alpha_deg states its unit twice
    const auto unit = known_unit(out.unit);
    if (unit && before != text.npos && known_unit(text.substr(before + 1)) == unit)
      text = text.substr(0, before);
  }
  out.name = lower(text);
  std::erase_if(out.name, [](char c) { return c == ' ' || c == '_' || c == '/' || c == ','; });
  return out;
}

bool is_unit(std::string_view text) { return find_unit(text) != nullptr; }

std::optional<std::string> known_unit(std::string_view text) {
  const Unit* unit = find_unit(text);
  return unit != nullptr && unit->seconds == 0 ? std::optional<std::string>(unit->name) : std::nullopt;
}

std::string unit_of(std::string_view column) { return known_unit(cut_name(column).unit).value_or(""); }

std::string without_unit(std::string_view column) {
  std::string name(trimmed(column));
  const std::string unit = cut_name(name).unit;
  if (!known_unit(unit)) return name;
  const std::string out = name.substr(0, name.find_last_not_of(" _([", name.rfind(unit) - 1) + 1);
  return out.empty() ? name : out;
}

std::string unknown_angle_unit(std::string_view column) {
  const std::string unit = cut_name(column).unit;
  if (!unit.empty()) return known_unit(unit) ? "" : unit;
  const std::string text = lower(trimmed(column));
  if (is_one_of(text, "qw qx qy qz q0 q1 q2 q3 quat_w quat_x quat_y quat_z")) return "parts of a quaternion";
  const std::string last = text.substr(text.find_last_of("_ ") + 1);
  return last.size() < text.size() && is_one_of(last, "grad gon mrad turn turns percent %") ? last : "";
}

std::optional<double> seconds_in(std::string_view text) {
  const Unit* unit = find_unit(text);
  return unit != nullptr && unit->seconds > 0 ? std::optional(unit->seconds) : std::nullopt;
}

}  // namespace flexor::recording
