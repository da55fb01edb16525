// A line of a log, from a file or a port, as cells: the one place that knows how people's lines are written.
//
// table     cells separated by comma, semicolon, tab or blanks, in quotes or not; decimal commas where the separator is none
// labelled  label:value or label=value pairs, as serial plotters take them, separated by , ; | tabs or blanks; a unit may follow a value
// keyed     text for VR drivers (A356B323C446...; runtime/link/opengloves.hpp): labels thumb_count, index_count, ...
// Each also behind the Arduino IDE's clock: 12:03:11.123 -> 356,323,446
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace flexor::recording {

enum class Layout { table, labelled, keyed };

// Of one line; without labels the values stand in columns.
struct Cells {
  Layout layout = Layout::table;
  std::vector<std::string> label;
  std::vector<std::string> value;
};

// RFC 4180 within one line; blanks separate as many at a time as there are. Reuses the strings of `cells`. Whether a quote is open
// at its end.
bool split(std::string_view line, char separator, std::vector<std::string>& cells);

// The separator under which both lines have the same number of cells, else the one with most of the first; of one line, that which
// it has.
char separator_of(std::string_view first, std::string_view second = {});

// The time before an arrow is cut off `line`; false where there is none.
bool cut_at_arrow(std::string& line, std::string& time);

// False where the line is neither labelled nor keyed. What else a VR driver's line says (buttons, its version) is left out.
bool read_labelled(std::string_view line, Cells& cells);

struct Number {
  double value;
  char decimal;  // '.', ',' or none
};
// With a decimal comma only where commas do not separate.
std::optional<Number> read_number(std::string_view cell, char separator);

bool is_number_or_time(const std::string& cell, char separator);
// A cell that is neither of these and not missing.
bool has_word(const std::vector<std::string>& cells, char separator);
bool is_header(const std::vector<std::string>& cells, char separator);

// Whether a column is called like a time; `unit_s` then has the seconds of the unit that the name states.
bool is_time_name(std::string_view column, std::optional<double>& unit_s);

// Cells of which each is a unit, or nothing, as a spreadsheet has them below its header.
bool is_units_row(const std::vector<std::string>& cells);

// Some names for a message, the others counted.
std::string listed(const std::vector<std::string>& names);

}  // namespace flexor::recording
