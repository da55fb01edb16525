// Units, as they stand in a column's name: index_V, Angle(deg), "flex [count]", SensorA1_adc.
//
// Nothing is guessed from values. A column without a unit has the unit "".
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace flexor::recording {

// The unit that the column's name states, in one spelling: count V mV ohm kohm deg rad mm. Empty: none.
std::string unit_of(std::string_view column);

// One spelling of what a person or a units row calls a unit ("Volts", "degrees", "adc"); none where Flexor knows none.
std::optional<std::string> known_unit(std::string_view text);
bool is_unit(std::string_view text);  // one of those, or of time

// "index_mcp_deg", "index_mcp (deg)" -> index_mcp; a name without a unit that Flexor knows as it is.
std::string without_unit(std::string_view column);

// What the column's name states as the unit of an angle though it is none that Flexor knows: anything in brackets, or grad gon
// mrad turn percent at the end, or a quaternion's. Empty: nothing of that kind.
std::string unknown_angle_unit(std::string_view column);

// Seconds in a unit of time (s ms us ns, min; "millis", "sec" ...); none where it is no unit of time.
std::optional<double> seconds_in(std::string_view unit);

// A column's name cut into what it is called and the unit that it states: "Time (ms)" -> time, ms.
struct NameAndUnit {
  std::string name;  // lower case, without blanks
  std::string unit;  // as written; empty where there is none
};
NameAndUnit cut_name(std::string_view column);

bool is_one_of(std::string_view word, std::string_view list);  // of words between blanks, in any capitals
std::string lower(std::string_view text);
std::string_view trimmed(std::string_view text);

}  // namespace flexor::recording
