// A recording: named columns over one clock.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace flexor::recording {

// One signal on its own clock; both spans have the same length, t_s never decreasing.
struct Series {
  std::span<const double> t_s;
  std::span<const double> value;
};

struct Column {
  std::string name;
  std::vector<double> value;
  std::string unit = {};  // as unit.hpp spells it; empty: not stated
};

struct Recording {
  std::string source;       // file name, for messages
  std::vector<double> t_s;  // never decreasing; rows of a burst may share a time
  std::vector<Column> columns;
  std::vector<std::string> warnings;  // what was repaired on the way in
  std::string digest;                 // of the file's bytes
  std::string time_column = {};       // that t_s was read from

  // Throws io::InputError, listing the columns there are.
  const Column& column(std::string_view name) const;
  Column& column(std::string_view name) { return const_cast<Column&>(std::as_const(*this).column(name)); }
  Series series(std::string_view name) const { return {t_s, column(name).value}; }
};

// One file, or two whose times are kHostClock.
bool share_a_clock(const Recording& one, const Recording& other);

bool is_video(const std::filesystem::path& file);  // by its ending

// Throws io::InputError, naming file and column, when the signal never changes.
void require_change(const Recording& recording, std::string_view column, std::string_view hint);

}  // namespace flexor::recording
