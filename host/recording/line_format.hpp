// A line of a log, from a file or a port, as cells: the one place that knows how people's lines are written.
//
// table     cells separated by comma, semicolon, tab or blanks, in quotes or not; decimal commas where the separator is none
// labelled  label:value or label=value pairs, as serial plotters take them, separated by , ; | tabs or blanks; a unit may follow a value
// keyed     text for VR drivers (A356B323C446...; runtime/link/opengloves.hpp): labels thumb_count, index_count, ...
// Each also behind the clock, level and tag that a terminal or a logger writes (cut_prefix), in brackets, and in colours.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/recording/time.hpp"

namespace flexor::recording {

inline constexpr std::array kFingers = {"thumb", "index", "middle", "ring", "pinky"};
inline constexpr std::string_view kSeparators = ";\t,| ";

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

// What a terminal or a logger puts before the values is cut off `line`, its clock is `time`, and colours and brackets around all.
//   12:03:11.123 -> 356        the Arduino IDE's monitor, and > of others
//   [2026-05-01 12:03:11] 356  minicom, Tera Term, Zephyr ([00:00:01.234,000] <inf> glove: 356), ROS ([INFO] [1700000000.5] [glove]: 356)
//   2026-05-01 12:03:11 356    date and clock, before anything but a tab or another separator; a clock alone or seconds since 1970
//                              only before a list with commas, or labels
//   I (1234) glove: 356        ESP-IDF, [  1234][I][glove.ino:8] loop(): 356 of Arduino: milliseconds
void cut_prefix(std::string& line, std::string& time);

// A version, or a word that boards say when they start.
bool is_greeting(const std::vector<std::string>& cells);

// False where the line is neither labelled nor keyed. What else a VR driver's line says (buttons, its version) is left out.
bool read_labelled(std::string_view line, Cells& cells);

// With a decimal comma only where commas do not separate.
std::optional<double> read_number(std::string_view cell, char separator);

// Such a number, in some unit, or a time as it is written.
std::optional<Time> time_in(std::string_view cell, char separator);

// Cells of which each is missing, a number or a time, or else a word.
struct CellCounts {
  std::size_t numbers = 0;
  std::size_t words = 0;
};
CellCounts count_cells(const std::vector<std::string>& cells, char separator);
bool has_word(const std::vector<std::string>& cells, char separator);
bool is_header(const std::vector<std::string>& cells, char separator);  // words alone

// Whether a column is called like a time, and the seconds of the unit that its name states, whatever it is called.
struct TimeName {
  bool is_time = false;
  std::optional<double> unit_s = {};
};
TimeName read_time_name(std::string_view column);
bool names_prefix(std::string_view column);  // a time, or a logger's level

// Cells of which each is a unit, or nothing, as a spreadsheet has them below its header.
bool is_units_row(const std::vector<std::string>& cells);

// Some names for a message, the others counted.
std::string listed(const std::vector<std::string>& names);

}  // namespace flexor::recording
