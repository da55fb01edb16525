#include "host/recording/csv.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iostream>
#include <limits>
#include <sstream>
#include <utility>

#include "host/io/io.hpp"
#include "host/recording/unit.hpp"

namespace flexor::recording {
namespace {

using io::InputError;

constexpr std::size_t kLongestExcerpt = 40;  // of a cell in a message
constexpr std::size_t kTornRows = 5;
constexpr double kTornShare = 0.1;
constexpr std::size_t kSureRows =
    20;  // of a live log: behind them a row with a bad cell is malformed, in them the log is
constexpr std::size_t kTitles = 40;    // lines in which the first row of numbers is looked for
constexpr std::size_t kLiveRows = 20;  // of look-ahead where rows come as they are made, and
constexpr std::size_t kRows =
    60'000;  // of a file: a sensor that gives nothing for ten minutes at 100 Hz is dead
constexpr double kCounter = 4294967296.0;  // ticks of a 32-bit counter
constexpr const char* kNoData = "has a header but no data";
constexpr double kDay_s = 86400;
constexpr double kHour_s = 3600;

std::string excerpt(std::string_view text) { return io::start_of(text, kLongestExcerpt); }

const char* spelt(char separator) {
  return separator == ';'    ? "semicolons"
         : separator == '\t' ? "tabs"
         : separator == ' '  ? "blanks"
                             : "commas";
}

// What a file that is no text is, by how it begins, with the mend; nothing of text.
const char* binary_kind(std::string_view line) {
  static constexpr std::array<std::pair<std::string_view, const char*>, 5> kKinds = {
      {{"MATLAB 5.0 MAT-file", "a MATLAB file: writetable(T, \"log.csv\") in MATLAB"},
       {"\xC2\x89HDF", "an HDF5 or MATLAB file: write its table as CSV"},
       {"PK\x03\x04", "an Excel workbook or a ZIP archive: save the sheet as CSV"},
       {"\xC3\x90\xC3\x8F\x11", "an old Excel workbook: save the sheet as CSV"},
       {"\x1F\xC2\x8B", "compressed: gunzip it"}}};
  for (const auto& [begin, kind] : kKinds) {
    if (line.starts_with(begin)) return kind;
  }
  const bool is_text = std::ranges::none_of(
      line.substr(0, 200), [](unsigned char c) { return c < ' ' && c != '\t' && c != '\r' && c != '\f'; });
  return is_text ? nullptr : "no text: export it as CSV";
}

bool is_number_or_time(const std::string& cell, char separator) {
  return read_number(cell, separator) || to_time(cell);
}

// More numbers than words, and beside a time of the line's own, one, else two or more.
bool is_row(const std::vector<std::string>& cells, char separator, bool has_time) {
  const auto numbers = static_cast<std::size_t>(
      std::ranges::count_if(cells, [&](const auto& c) { return is_number_or_time(c, separator); }));
  return numbers >= (has_time ? 1U : 2U) && 2 * numbers > cells.size();
}

std::unique_ptr<std::istream> open(const std::filesystem::path& path) {
  io::require_readable(path);
  return std::make_unique<std::ifstream>(path, std::ios::binary);
}

}  // namespace

CsvReader::CsvReader(std::istream& stream, std::string source, const CsvOptions& options)
    : lines_(stream), source_(std::move(source)), options_(options) {
  begin();
}

CsvReader::CsvReader(const std::filesystem::path& path, const CsvOptions& options)
    : file_(path == "-" ? nullptr : open(path)),
      lines_(file_ ? *file_ : std::cin),
      source_(file_ ? path.string() : "standard input"),
      options_(options) {
  options_.is_live = !file_;
  begin();
}

void CsvReader::begin() {
  const double rate_hz = options_.time.log_rate_hz;
  if (!options_.time.unit.empty() && !seconds_in(options_.time.unit))
    throw InputError(fmt::format("unknown unit of time \"{}\"; known: s, ms, us, ns", options_.time.unit));
  if (!(rate_hz >= 0 && rate_hz <= 1e5))
    throw InputError(fmt::format("--log-rate {}: must lie between 0 and 100000 rows a second", rate_hz));
  find_layout();
  read_header();
  read_units();
  find_time();
  choose(options_.columns);
}

void CsvReader::fail(const std::string& what) const {
  throw InputError(fmt::format("{}: row {}: {}", source_, line_.number, what));
}

bool CsvReader::has(const std::string& column) const { return std::ranges::count(header_, column) > 0; }

// The next line of the file that holds something, its time cut off where the log has arrows.
bool CsvReader::read_line(Line& line) {
  line.comment.clear();
  while (lines_.next(line.text)) {
    const std::string_view inner = trimmed(line.text);
    if (inner.empty()) continue;
    if (inner.front() == '#') {
      const std::size_t text = inner.find_first_not_of("# ");
      if (text != std::string_view::npos) line.comment = inner.substr(text);
      continue;
    }
    line.number = lines_.number();
    line.is_cut_off = lines_.cut_off();
    line.time.clear();
    (void)cut_at_arrow(line.text, line.time);
    return true;
  }
  return false;
}

const CsvReader::Line* CsvReader::peek(std::size_t i) {
  while (ahead_.size() <= i) {
    if (Line line; read_line(line)) {
      ahead_.push_back(std::move(line));
    } else {
      return nullptr;
    }
  }
  return &ahead_[i];
}

bool CsvReader::next_line(Line& line) {
  if (ahead_.empty()) return read_line(line);
  line = std::move(ahead_.front());
  ahead_.pop_front();
  return true;
}

const CsvReader::Line& CsvReader::first_line(const char* lack) {
  if (const Line* line = peek(0)) return *line;
  throw InputError(fmt::format("{}: {}", source_, lack));
}

// Into cells_, in the order of the header; none where the line is of another layout, or has a label of its own.
void CsvReader::split_line(const std::string& text) {
  if (layout_ == Layout::table) return split(text, separator_, cells_);
  cells_.clear();
  new_label_.clear();
  if (!read_labelled(text, labelled_) || labelled_.layout != layout_ || labelled_.label.empty()) return;
  cells_.assign(header_.size(), "");
  for (std::size_t i = 0; i < labelled_.label.size(); ++i) {
    const auto column = std::ranges::find(header_, labelled_.label[i]);
    if (column == header_.end()) {
      new_label_ = labelled_.label[i];
      return cells_.clear();
    }
    cells_[static_cast<std::size_t>(column - header_.begin())] = labelled_.value[i];
  }
}

void CsvReader::find_layout() {
  if (const char* kind = binary_kind(first_line("is empty").text))
    throw InputError(fmt::format("{}: is {}", source_, kind));
  if (ahead_[0].text.size() == 5 && lower(ahead_[0].text).starts_with("sep=")) {
    separator_ = ahead_[0].text[4];
    ahead_.pop_front();
  }
  Cells cells;
  while (read_labelled(first_line("is empty").text, cells) &&
         cells.label.empty()) {  // what a VR driver's glove is
    ahead_.pop_front();
  }
  if (read_labelled(ahead_[0].text, cells) && std::ranges::none_of(cells.value, is_missing)) {
    layout_ = cells.layout;
    header_ = cells.label;
  } else if (const auto row = find_first_row(); row && *row > 0) {
    // The nearest line above the rows that has as many cells, or the one right above, unless it is a greeting.
    std::vector<std::string> cells_of_row;
    split(ahead_[*row].text, separator_, cells_of_row);
    std::size_t header = *row;
    for (std::size_t i = *row; i-- > 0;) {
      std::vector<std::string> names;
      split(ahead_[i].text, separator_, names);
      const bool is_above = i + 1 == *row;
      const bool is_greeting = names.size() == 1 && (!is_above || names[0].find(' ') != std::string::npos);
      const bool fits = names.size() <= cells_of_row.size() && 2 * names.size() > cells_of_row.size();
      const auto is_number = [&](const auto& cell) { return is_number_or_time(cell, separator_); };
      if (is_greeting || !(fits || is_above) || (is_units_row(names) && i > 0) ||
          std::ranges::any_of(names, is_number))
        continue;
      header = i;
      break;
    }
    leave_out_titles(header);
  } else if (separator_ == 0) {
    separator_ = separator_of(ahead_[0].text, peek(1) != nullptr ? peek(1)->text : "-");
  }
  arrow_ = !ahead_[0].time.empty();
}

// The first of two rows of numbers that have as many cells as each other, and the separator; 0 where the first two lines have,
// whatever they hold. None: there are no such lines.
std::optional<std::size_t> CsvReader::find_first_row() {
  std::vector<std::string> a;
  std::vector<std::string> b;
  for (std::size_t i = 0; i < kTitles; ++i) {
    const Line* second = peek(i + 1);
    if (second == nullptr) return std::nullopt;
    const bool has_time = !second->time.empty();
    for (const char c : separator_ != 0 ? std::vector{separator_} : std::vector{';', '\t', ',', ' '}) {
      split(ahead_[i].text, c, a);
      split(second->text, c, b);
      while (a.size() > b.size() && a.back().empty()) a.pop_back();
      while (b.size() > a.size() && b.back().empty()) b.pop_back();
      if (a.size() != b.size() || (a.size() < 2 && (!has_time || c != ','))) continue;
      const bool are_rows = is_row(a, c, has_time) && is_row(b, c, has_time);
      if (!are_rows && (i > 0 || a.size() < 2)) continue;
      separator_ = c;
      return i;
    }
  }
  return std::nullopt;
}

void CsvReader::leave_out_titles(std::size_t count) {
  if (count == 0) return;
  for (std::size_t i = 0; i < count; ++i) {
    std::string text = lower(trimmed(ahead_[i].text));
    std::erase_if(text, [](char c) { return c == ' ' || c == '\t'; });
    if (text == "indegrees=yes") angle_unit_ = "deg";
    if (text == "indegrees=no") angle_unit_ = "rad";
    std::vector<std::string>& cells = titles_.emplace_back();
    split(text.empty() ? text : ahead_[i].text, separator_, cells);
    while (!cells.empty() && cells.back().empty()) cells.pop_back();
    const auto rate = cells.size() == 1 ? to_number(cells[0]) : std::nullopt;
    if (rate && *rate > 0) frame_rate_hz_ = *rate;
  }
  notes_.push_back(count == 1 ? fmt::format("{}: row {} (\"{}\") does not fit what follows and is left out",
                                            source_, ahead_[0].number, excerpt(ahead_[0].text))
                              : fmt::format("{}: rows {} to {} are titles", source_, ahead_[0].number,
                                            ahead_[count - 1].number));
  ahead_.erase(ahead_.begin(), ahead_.begin() + static_cast<std::ptrdiff_t>(count));
}

void CsvReader::read_header() {
  if (layout_ == Layout::keyed)
    notes_.push_back(fmt::format("{}: text for VR drivers: A to E are thumb to pinky", source_));
  if (layout_ != Layout::table) return;  // the labels name the columns
  line_ = ahead_[0];
  split_line(line_.text);
  if (!arrow_ && separator_ == ' ' && cells_.size() > 1 && to_time(cells_[0] + " " + cells_[1])) {
    fail("date and clock are separated like columns; quote them, or separate the columns with commas");
  }
  while (cells_.size() > 1 && cells_.back().empty()) cells_.pop_back();
  header_ = cells_;
  has_header_ = !std::ranges::all_of(
      cells_, [&](const std::string& c) { return is_missing(c) || is_number_or_time(c, separator_); });
  if (has_header_) {
    ahead_.pop_front();
    name_by_titles();
  } else {
    has_header_ = comment_is_header(line_.comment);
  }
  for (std::size_t i = 0; i < header_.size(); ++i) {
    if (!has_header_ || header_[i].empty()) header_[i] = fmt::format("column{}", i + 1);
  }
  if (has_header_) return;
  notes_.push_back(fmt::format("{}: has no header: the columns are called {} to {} in their order", source_,
                               header_.front(), header_.back()));
}

// Columns without a name, or of one name, get that of the nearest title that spans them.
void CsvReader::name_by_titles() {
  const auto is_told = [&](const std::string& name) {
    return !name.empty() && std::ranges::count(header_, name) == 1;
  };
  for (auto title = titles_.rbegin(); title != titles_.rend() && !std::ranges::all_of(header_, is_told);
       ++title) {
    if (title->size() < 2 || title->size() > header_.size() || std::ranges::count(*title, "ID") > 0) continue;
    const std::vector<std::string> before = header_;
    std::string above;
    for (std::size_t i = 0; i < header_.size(); ++i) {
      if (i < title->size() && !(*title)[i].empty()) above = (*title)[i];
      const bool is_double = !before[i].empty() && std::ranges::count(before, before[i]) > 1;
      if (is_double && !above.empty()) header_[i] = above + "_" + before[i];
      if (before[i].empty() && i < title->size()) header_[i] = (*title)[i];
    }
  }
}

// As NumPy writes it: # t_s,index,middle
bool CsvReader::comment_is_header(const std::string& comment) {
  std::vector<std::string> names;
  split(comment, separator_, names);
  if (comment.empty() || names.size() != header_.size() || to_time(names.front())) return false;
  header_ = names;
  return true;
}

// A row below the header that holds units instead of numbers; else a title's.
void CsvReader::read_units() {
  for (const std::string& name : header_) {
    std::optional<double> ignored;
    const bool is_angle = !is_time_name(name, ignored) && !lower(name).ends_with("_tx") &&
                          !lower(name).ends_with("_ty") && !lower(name).ends_with("_tz");
    const std::string unit = unit_of(name);
    header_units_.push_back(unit.empty() && is_angle ? angle_unit_ : unit);
  }
  if (layout_ != Layout::table || !has_header_) return;
  split_line(first_line(kNoData).text);
  if (cells_.size() > header_.size() || !is_units_row(cells_)) return;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    if (known_unit(cells_[i]) || seconds_in(cells_[i]))
      header_units_[i] = known_unit(cells_[i]).value_or(cells_[i]);
  }
  notes_.push_back(fmt::format("{}: row {} is taken as a row of units", source_, ahead_[0].number));
  ahead_.pop_front();
}

// How likely a column is the time, the higher the likelier; none: it is not.
// The same for so long that it is no clock, but when a session began.
bool CsvReader::stands(std::size_t place, const std::string& first) {
  constexpr std::size_t kRows = 1000;
  std::vector<std::string> cells;
  std::size_t k = 1;
  for (const Line* line = peek(k); line != nullptr && k < kRows; line = peek(++k)) {
    split(line->text, separator_, cells);
    if (place < cells.size() && cells[place] != first) return false;
  }
  return k > 1;
}

std::optional<CsvReader::Clock> CsvReader::clock_in(std::size_t place, const std::vector<std::string>& first,
                                                    const std::vector<std::string>& second) {
  std::optional<double> unit_s;
  const bool is_named = has_header_ ? is_time_name(header_[place], unit_s) : place == 0;
  if (!unit_s) unit_s = seconds_in(header_units_[place]);
  const auto number = place < first.size() ? read_number(first[place], separator_) : std::nullopt;
  const bool is_written = !number && place < first.size() && to_time(first[place]);
  if (!is_named && !is_written) return std::nullopt;
  const auto next = place < second.size() ? read_number(second[place], separator_) : std::nullopt;
  const bool counts =
      number && next && !unit_s && options_.time.unit.empty() && next->value == number->value + 1;
  const bool useless = (!number && !is_written) || (is_written && stands(place, first[place]));
  return Clock{place, counts ? 2 : useless ? 1 : is_named ? 4 : 3, unit_s};
}

// The column that is called a time and holds one in the first row, or that has times of day or dates.
void CsvReader::find_time() {
  split_line(first_line(kNoData).text);
  const std::vector<std::string> first = cells_;
  std::vector<std::string> second;
  if (const Line* line = peek(1)) {
    split_line(line->text);
    second = cells_;
  }
  const bool may_be_none = options_.time.log_rate_hz > 0 && !has_header_;
  std::optional<Clock> best;
  std::optional<Clock> other;  // that would do as well
  for (std::size_t i = 0; i < header_.size() && !arrow_; ++i) {
    std::optional<Clock> clock = clock_in(i, first, second);
    if (!clock || (may_be_none && clock->rank != 3)) continue;
    if (!best || clock->rank > best->rank) std::swap(best, clock);
    if (clock && clock->rank > 2) other = clock;
  }
  if (!options_.time.column.empty() &&
      (!best || has(options_.time.column))) {  // a reference may have a clock of its own
    const std::size_t place = place_of(options_.time.column);
    const auto by_name = seconds_in(cut_name(header_[place]).unit);
    best = clock_in(place, first, second)
               .value_or(Clock{place, 0, by_name ? by_name : seconds_in(header_units_[place])});
    other.reset();
  } else if (!options_.time.column.empty()) {
    notes_.push_back(fmt::format("{}: no column \"{}\" (--time-column): \"{}\" is its time", source_,
                                 options_.time.column, header_[best->place]));
  }
  if (!best && frame_rate_hz_ > 0 && has("Frame")) best = {place_of("Frame"), 0, 1 / frame_rate_hz_};
  if (best) time_place_ = best->place;
  if (other) {
    const std::string both = fmt::format("{}: columns \"{}\" and \"{}\" could both be the time", source_,
                                         header_[best->place], header_[other->place]);
    if (!has_header_) throw InputError(both + ": say which with --time-column");
    notes_.push_back(fmt::format("{}: \"{}\" is taken (--time-column)", both, header_[best->place]));
  }
  require_time();
  const auto asked = seconds_in(options_.time.unit);
  if (asked && best && best->unit_s && *asked != *best->unit_s) {
    notes_.push_back(fmt::format("{}: column \"{}\" states its unit itself: --time-unit is not for it",
                                 source_, header_[*time_place_]));
  }
  time_unit_s_ = (best ? best->unit_s : std::nullopt).value_or(asked.value_or(1));
}

void CsvReader::require_time() {
  const bool has_time = time_place_ || arrow_;
  if (has_time && options_.time.log_rate_hz > 0)
    notes_.push_back(fmt::format("{}: has times of its own: --log-rate is not for it", source_));
  if (has_time || options_.time.log_rate_hz > 0) return;
  if (layout_ != Layout::table) {
    throw InputError(
        fmt::format("{}: has no times: {}; record with time stamps, as 12:03:11.123 -> ..., print "
                    "t_ms:{{millis()}} as well, or give the rows a second: --log-rate 50",
                    source_, listed(header_)));
  }
  throw InputError(fmt::format(
      "{}: no time column (t_s, time, Time(ms), timestamp ...): name it t_s or time_ms, say which it "
      "is with --time-column, or give the rows a second of a log without: --log-rate 50; there are: {}",
      source_, listed(header_)));
}

std::size_t CsvReader::place_of(const std::string& name) const {
  const auto it = std::ranges::find(header_, name);
  if (it == header_.end())
    throw InputError(fmt::format("{}: no column \"{}\"; there are: {}", source_, name, listed(header_)));
  if (std::find(it + 1, header_.end(), name) != header_.end())
    throw InputError(fmt::format("{}: column \"{}\" occurs twice: rename one of them", source_, name));
  return static_cast<std::size_t>(it - header_.begin());
}

// A column is of numbers when the first cell in it that is not missing is one.
std::vector<std::size_t> CsvReader::columns_of_numbers() {
  enum class Kind { missing, number, text };
  std::vector<Kind> kind(header_.size(), Kind::missing);
  if (time_place_) kind[*time_place_] = Kind::text;
  const std::size_t most = options_.is_live ? kLiveRows : kRows;
  for (std::size_t k = 0; k < most && std::ranges::count(kind, Kind::missing) > 0 && peek(k) != nullptr;
       ++k) {
    split_line(ahead_[k].text);
    for (std::size_t i = 0; i < std::min(header_.size(), cells_.size()); ++i) {
      if (kind[i] != Kind::missing || is_missing(cells_[i])) continue;
      kind[i] = read_number(cells_[i], separator_) ? Kind::number : Kind::text;
    }
  }
  std::vector<std::size_t> out;
  std::vector<std::string> left;
  for (std::size_t i = 0; i < header_.size(); ++i) {
    if (kind[i] == Kind::number || (kind[i] == Kind::missing && options_.holes)) {
      out.push_back(i);
    } else if (time_place_ != i && (kind[i] == Kind::missing || header_units_[i] == "deg")) {
      left.push_back(header_[i]);
    }
  }
  left_out_ = left.empty() ? "" : listed(left);
  return out;
}

void CsvReader::choose(const std::vector<std::string>& columns) {
  columns_.clear();
  units_.clear();
  places_.clear();
  left_out_.clear();
  const auto take = [&](std::size_t place) {
    columns_.push_back(header_[place]);
    units_.push_back(header_units_[place]);
    places_.push_back(place);
  };
  for (const std::string& name : columns) take(place_of(name));
  if (!columns.empty()) return;
  for (const std::size_t place : columns_of_numbers()) take(place_of(header_[place]));
  if (!columns_.empty()) return;
  line_ = first_line(kNoData);
  split_line(line_.text);
  if (const std::size_t i = time_place_ == 0U ? 1 : 0;
      i < std::min(header_.size(), cells_.size()) && time_place_ != i)
    fail(fmt::format("no column of numbers: \"{}\" holds \"{}\", which is none", header_[i],
                     excerpt(cells_[i])));
  fail("no column beside the time");
}

std::optional<double> CsvReader::checked(const Number& number, std::string& why) {
  if (!is_measurement(number.value)) {
    why = "is not a measurement; mend or remove the row";
    return std::nullopt;
  }
  if (number.decimal != 0 && decimal_ != 0 && number.decimal != decimal_) {
    why = "some numbers have a decimal point and some a decimal comma; use one";
    return std::nullopt;
  }
  if (number.decimal != 0) decimal_ = number.decimal;
  return number.value;
}

bool CsvReader::read_values(std::vector<double>& value, std::string& why) {
  value.resize(places_.size());
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const std::string& cell = cells_[places_[i]];
    value[i] = std::numeric_limits<double>::quiet_NaN();
    if (is_missing(cell)) continue;
    const auto number = read_number(cell, separator_);
    const auto known = number ? checked(*number, why) : std::nullopt;
    if (!number) why = "is not a number; mend or remove the row";
    if (!why.empty()) {
      why = fmt::format("column \"{}\": {} {}", columns_[i],
                        number ? excerpt(cell) : '"' + excerpt(cell) + '"', why);
      return false;
    }
    value[i] = *known;
  }
  return true;
}

// False with a reason, or without one where no time stands.
bool CsvReader::read_time(double& t_s, std::string& why) {
  if (!arrow_ && !time_place_) {
    t_s = static_cast<double>(rows_ + torn_ + unmeasured_) / options_.time.log_rate_hz;
    return true;
  }
  const std::string& text = arrow_ ? line_.time : cells_[*time_place_];
  if (is_missing(text)) return false;
  const auto refuse = [&](const std::string& what) {
    why = fmt::format("column \"{}\": \"{}\" {}", time_place_ ? header_[*time_place_] : line_.time,
                      excerpt(text), what);
    return false;
  };
  const auto number = read_number(text, separator_);
  if (!number && !to_time(text) && to_time(text + ".0")) {
    return refuse(
        fmt::format("may be hours and minutes, or minutes and seconds; write it as 0:{}", excerpt(text)));
  }
  std::optional<Time> found = number ? Time{TimeFormat::number, number->value} : to_time(text);
  if (!found)
    return refuse("is no time (seconds, 12:03:11.123 or 2026-05-01T12:03:11); mend or remove the row");
  if (number && !checked(*number, why)) return refuse(why);
  if (!time_format_) {
    time_format_ = found->format;
    if (found->format == TimeFormat::clock) wrap_s_ = kDay_s;
    if (found->format == TimeFormat::minutes) wrap_s_ = kHour_s;
    if (found->format == TimeFormat::number && time_unit_s_ < 1 && frame_rate_hz_ == 0)
      wrap_s_ = kCounter * time_unit_s_;
  }
  if (found->format != *time_format_) return refuse("is written otherwise than the times before");
  if (found->format == TimeFormat::slashed && is_ambiguous_date(text))
    return refuse("can be read as two dates; write it as 2026-05-01");
  t_s = found->format == TimeFormat::number ? found->value * time_unit_s_ : found->value;
  return is_measurement(t_s) || refuse("is no time");
}

// Whether line_ has the header's cells. Without a reason it is what a restarting board leaves behind.
bool CsvReader::is_whole(std::string& why) {
  while (cells_.size() > header_.size() && cells_.back().empty()) cells_.pop_back();
  if (cells_.size() > header_.size() && rows_ == 0) {
    why =
        fmt::format("{} cells, the header has {}{}", cells_.size(), header_.size(),
                    separator_ == ',' ? "; decimal commas need another separator, such as a semicolon" : "");
  }
  if (!new_label_.empty()) why = fmt::format("\"{}\" is no label of the first row", excerpt(new_label_));
  return cells_.size() == header_.size();
}

void CsvReader::leave_out() {
  if (torn_++ == 0) first_torn_ = line_.number;
  too_long_ += cells_.size() > header_.size() ? 1 : 0;
  const double forgiven = static_cast<double>(kTornRows) + kTornShare * static_cast<double>(rows_);
  if (static_cast<double>(torn_) <= forgiven) return;
  throw InputError(fmt::format(
      "{}: row {}: {} of the first {} rows are torn: too short or too long, without a time, or with text "
      "for a number; mend or remove them{}",
      source_, first_torn_, torn_, rows_ + torn_,
      2 * too_long_ > torn_ && separator_ == ',' ? "; decimal commas need another separator" : ""));
}

bool CsvReader::next(Row& row) {
  return seconds_.next(
      row, [this](Row& read) { return read_row(read); }, source_);
}

bool CsvReader::read_row(Row& row) {
  while (next_line(line_)) {
    split_line(line_.text);
    std::string why;
    const bool is_good = is_whole(why) && read_time(row.t_s, why) && read_values(row.value, why);
    const bool lacks =
        is_good && !options_.holes && std::ranges::any_of(row.value, [](double v) { return std::isnan(v); });
    if (is_good && !lacks) {
      ++rows_;
      row.line = line_.number;
      return true;
    }
    if (line_.is_cut_off) return false;
    const bool is_header = has_header_ && line_.text.find(header_.front() + separator_) != std::string::npos;
    if (!is_good && !why.empty() && !is_header && !(options_.is_live && rows_ >= kSureRows)) fail(why);
    if (!is_good) {
      leave_out();
    } else if (unmeasured_++ == 0) {
      first_unmeasured_ = line_.number;
    }
  }
  return false;
}

std::vector<std::string> CsvReader::notes() const {
  std::vector<std::string> out = notes_;
  const auto say = [&](const std::string& what) { out.push_back(source_ + ": " + what); };
  if (lines_.is_utf16()) say("is read as UTF-16");
  if (lines_.saw_latin1()) say("is not UTF-8 and is read as Latin-1");
  if (separator_ != ',' && layout_ == Layout::table)
    say(fmt::format("{} separate the columns", spelt(separator_)));
  if (!has_header_ && time_place_) say(fmt::format("{} is the time", header_[*time_place_]));
  if (!time_place_ && !arrow_)
    say(fmt::format("{} rows are a second (--log-rate)", options_.time.log_rate_hz));
  if (!angle_unit_.empty()) say(fmt::format("angles are in {} by its inDegrees", angle_unit_));
  if (!left_out_.empty()) say(fmt::format("without numbers, and left out: {}", left_out_));
  if (seconds_.per_second() > 0) {
    say(fmt::format("the times are whole seconds: the rows of each, {} in most, are spread evenly over it",
                    seconds_.per_second()));
  }
  if (decimal_ == ',') say("commas in numbers are decimal commas");
  if (torn_ > 0)
    say(fmt::format("{} row(s) are malformed and were left out, the first is row {}", torn_, first_torn_));
  if (unmeasured_ > 0) {
    say(fmt::format("{} of {} rows have no {} and were left out, the first is row {}", unmeasured_,
                    rows_ + unmeasured_, fmt::join(columns_, " or "), first_unmeasured_));
  }
  return out;
}

Recording read_rows(CsvReader& reader, Resets resets) {
  Recording recording;
  recording.source = reader.name();
  for (std::size_t i = 0; i < reader.columns().size(); ++i) {
    recording.columns.push_back({reader.columns()[i], {}, reader.units()[i]});
  }
  Stream stream(reader, resets);
  Row row;
  while (stream.next(row)) {
    recording.t_s.push_back(row.t_s);
    for (std::size_t i = 0; i < row.value.size(); ++i) recording.columns[i].value.push_back(row.value[i]);
  }
  recording.warnings = stream.notes();
  recording.digest = reader.digest();
  return recording;
}

Recording read(CsvReader& reader) {
  Recording recording = read_rows(reader, Resets::refuse);
  if (recording.t_s.size() < 2) {
    throw InputError(fmt::format("{}: {} row(s) of data; a recording needs at least two", recording.source,
                                 recording.t_s.size()));
  }
  if (recording.t_s.front() == recording.t_s.back()) {
    throw InputError(fmt::format("{}: row 3: time does not increase: it is {:g} s in every row",
                                 recording.source, recording.t_s.front()));
  }
  return recording;
}

Recording parse_csv(const std::string& text, const std::string& source,
                    const std::vector<std::string>& columns) {
  std::istringstream stream(text);
  CsvReader reader(stream, source, {columns});
  return read(reader);
}

Recording read_csv(const std::filesystem::path& path, const std::vector<std::string>& columns,
                   const TimeOptions& time) {
  CsvReader reader(path, {columns, time});
  return read(reader);
}

std::vector<std::string> columns_of(const std::filesystem::path& path, const TimeOptions& time, bool holes) {
  return CsvReader(path, {{}, time, holes}).columns();
}

std::string quoted(const std::string& name) {
  if (name.find_first_of(",;\t\"#") == std::string::npos) return name;
  std::string out = "\"";
  for (const char c : name) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + '"';
}

std::string to_csv(const Recording& recording) {
  fmt::memory_buffer out;
  fmt::format_to(std::back_inserter(out), "t_s");
  for (const Column& c : recording.columns) fmt::format_to(std::back_inserter(out), ",{}", quoted(c.name));
  out.push_back('\n');
  for (std::size_t i = 0; i < recording.t_s.size(); ++i) {
    fmt::format_to(std::back_inserter(out), "{}", recording.t_s[i]);
    for (const Column& c : recording.columns) fmt::format_to(std::back_inserter(out), ",{}", c.value[i]);
    out.push_back('\n');
  }
  return fmt::to_string(out);
}

}  // namespace flexor::recording
