#include "host/recording/csv.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>

#include "host/io/io.hpp"
#include "host/recording/unit.hpp"

namespace flexor::recording {
namespace {

using io::InputError;

constexpr std::size_t kLongestExcerpt = 40;  // of a cell in a message
constexpr std::size_t kTornRows = 5;
constexpr double kTornShare = 0.1;
constexpr double kCounter = 4294967296.0;  // ticks of a 32-bit counter
constexpr double kDay_s = 86400;
constexpr double kHour_s = 3600;

// RFC 4180 within one line; blanks separate as many at a time as there are. Reuses the strings of `cells`.
void split(const std::string& line, char delimiter, std::vector<std::string>& cells) {
  std::size_t n = 0;
  const auto next_cell = [&]() -> std::string& {
    if (n == cells.size()) cells.emplace_back();
    cells[n].clear();
    return cells[n++];
  };
  std::string* cell = &next_cell();
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    const bool separates = delimiter == ' ' ? c == ' ' || c == '\t' : c == delimiter;
    if (quoted && c == '"' && i + 1 < line.size() && line[i + 1] == '"') {
      cell->push_back('"');
      ++i;
    } else if (c == '"' && (quoted || trimmed(*cell).empty())) {
      quoted = !quoted;
    } else if (separates && !quoted) {
      if (delimiter != ' ' || !cell->empty()) cell = &next_cell();
    } else {
      cell->push_back(c);
    }
  }
  if (delimiter == ' ' && n > 1 && cell->empty()) --n;
  cells.resize(n);
  for (std::string& text : cells) {
    const std::string_view inner = trimmed(text);
    if (inner.size() != text.size()) text = std::string(inner);
  }
}

// "12:03:11.123 -> 356,323" cut at the arrow, where a time stands before it.
bool cut_at_arrow(const std::string& text, std::string& time, std::string& rest) {
  const std::size_t arrow = text.find("->");
  if (arrow == std::string::npos) return false;
  const std::string before(trimmed(std::string_view(text).substr(0, arrow)));
  if (!to_time(before)) return false;
  time = before;
  rest = std::string(trimmed(std::string_view(text).substr(arrow + 2)));
  return true;
}

// Text for VR drivers: letters, or letters in brackets, each with or without a number behind it. The numbers
// of A to E, in the order of the fingers; false where the text is something else.
bool read_keyed(std::string_view text, std::array<std::string, 5>& value) {
  for (std::string& v : value) v.clear();
  std::size_t i = 0;
  while (i < text.size()) {
    std::string key;
    if (text[i] == '(') {
      const std::size_t close = text.find(')', i);
      if (close == std::string_view::npos) return false;
      key = text.substr(i + 1, close - i - 1);
      i = close + 1;
    } else {
      key = text[i++];
    }
    if (key.empty() || !std::ranges::all_of(key, [](unsigned char c) { return std::isupper(c) != 0; }))
      return false;
    std::size_t end = i;
    while (end < text.size() && std::isdigit(static_cast<unsigned char>(text[end])) != 0) ++end;
    if (key.size() == 1 && key[0] <= 'E')
      value[static_cast<std::size_t>(key[0] - 'A')] = text.substr(i, end - i);
    i = end;
  }
  return !value[0].empty() && !value[1].empty();
}

// label:value, label:value, ... as the Arduino IDE's plotter takes it, separated by commas, tabs or blanks. A label begins
// with a letter. False where the text is something else.
bool read_labelled(const std::string& text, std::vector<std::string>& label,
                   std::vector<std::string>& value) {
  label.clear();
  value.clear();
  std::size_t at = text.find_first_not_of(", \t");
  while (at != std::string::npos) {
    const std::size_t colon = text.find(':', at);
    const std::string name(trimmed(std::string_view(text).substr(at, std::min(colon, text.size()) - at)));
    const bool is_label = !name.empty() && std::isalpha(static_cast<unsigned char>(name.front())) != 0 &&
                          name.find_first_of(",\"") == std::string::npos;
    if (colon == std::string::npos || !is_label) return false;
    const std::size_t begin = text.find_first_not_of(" \t", colon + 1);
    const std::size_t end = std::min(text.find_first_of(", \t", begin), text.size());
    label.push_back(name);
    value.push_back(begin == std::string::npos ? "" : text.substr(begin, end - begin));
    if (!value.back().empty() && !to_number(value.back())) return false;
    at = text.find_first_not_of(", \t", end);
  }
  return !label.empty();
}

bool is_time_name(const std::string& column, std::optional<double>& unit_s) {
  const NameAndUnit cut = cut_name(column);
  unit_s = seconds_in(cut.unit);
  static constexpr std::array kNames = {"t",       "time",        "timestamp", "datetime",
                                        "date",    "clock",       "elapsed",   "zeit",
                                        "uhrzeit", "zeitstempel", "timems",    "elapsedtime"};
  if (std::ranges::any_of(kNames, [&](const char* n) { return cut.name == n; })) {
    if (cut.name == "timems") unit_s = 1e-3;
    return cut.unit.empty() || unit_s.has_value();
  }
  // A column called by its unit: millis, micros, ms, "seconds".
  static constexpr std::array kUnits = {"millis", "millis()", "micros", "micros()",   "ms",
                                        "us",     "seconds",  "sec",    "timemillis", "timemicros"};
  if (!cut.unit.empty() || std::ranges::none_of(kUnits, [&](const char* n) { return cut.name == n; }))
    return false;
  unit_s = seconds_in(cut.name.starts_with("time") ? cut.name.substr(4) : cut.name);
  return true;
}

const char* spelt(char delimiter) {
  switch (delimiter) {
    case ';':
      return "semicolons";
    case '\t':
      return "tabs";
    case ' ':
      return "blanks";
    default:
      return "commas";
  }
}

}  // namespace

CsvReader::CsvReader(std::istream& stream, std::string source, const CsvOptions& options)
    : lines_(stream), source_(std::move(source)), holes_(options.holes) {
  if (!options.time_unit.empty() && !seconds_in(options.time_unit)) {
    throw InputError(fmt::format("unknown unit of time \"{}\"; known: s, ms, us, ns", options.time_unit));
  }
  read_layout();
  read_units();
  find_time(options);
  find_columns(options.columns);
}

void CsvReader::fail(const std::string& what) const {
  throw InputError(fmt::format("{}: row {}: {}", source_, line_.number, what));
}

// The next line that holds something, its time cut off where the log has arrows.
bool CsvReader::next_line(Line& line) {
  if (!ahead_.empty()) {
    line = std::move(ahead_.back());
    ahead_.pop_back();
    return true;
  }
  while (lines_.next(line.text)) {
    const std::string_view inner = trimmed(line.text);
    if (inner.empty()) continue;
    if (inner.front() == '#') {
      const std::size_t text = inner.find_first_not_of("# ");
      if (text != std::string_view::npos) comment_ = inner.substr(text);
      continue;
    }
    line.number = lines_.number();
    line.time.clear();
    (void)cut_at_arrow(line.text, line.time, line.text);
    return true;
  }
  return false;
}

// line_ into cells_.
void CsvReader::split_line() {
  if (layout_ == Layout::table) return split(line_.text, delimiter_, cells_);
  if (layout_ == Layout::labelled) return split_labelled();
  std::array<std::string, 5> value;
  if (!read_keyed(trimmed(line_.text), value)) value.fill("");
  cells_.assign(value.begin(), value.end());
}

// In the order of the first line's labels; a torn line is none.
void CsvReader::split_labelled() {
  std::vector<std::string> label;
  std::vector<std::string> value;
  cells_.clear();
  if (!read_labelled(line_.text, label, value)) return;
  cells_.assign(header_.size(), "");
  for (std::size_t i = 0; i < label.size(); ++i) {
    const auto column = std::ranges::find(header_, label[i]);
    if (column == header_.end()) fail(fmt::format("\"{}\" is no label of the first row", label[i]));
    cells_[static_cast<std::size_t>(column - header_.begin())] = value[i];
  }
}

// line_ will be read once more.
void CsvReader::put_back() { ahead_.push_back(line_); }

// The delimiter under which the first two lines have the same number of cells; else the one with most cells.
void CsvReader::find_delimiter(const Line& first, const std::optional<Line>& second) {
  if (delimiter_given_) return;
  std::vector<std::string> a;
  std::vector<std::string> b;
  std::size_t most = 1;
  for (const char c : {';', '\t', ',', ' '}) {
    split(first.text, c, a);
    if (second) split(second->text, c, b);
    if (a.size() > 1 && second && a.size() == b.size()) {
      delimiter_ = c;
      return;
    }
    if (c != ' ' && a.size() > most) {
      most = a.size();
      delimiter_ = c;
    }
  }
}

// A log that a terminal began to write in the middle of a line, or below a greeting of the board: one cell of
// digits, or of several words, above lines that agree on more cells. A single word may be a column's name.
void CsvReader::leave_out_fragment() {
  const std::string_view text = trimmed(line_.text);
  const bool digits = text.find_first_not_of("0123456789.-") == text.npos;
  if (!digits && text.find(' ') == text.npos) return;
  Line second;
  Line third;
  if (!next_line(second)) return;
  const bool more = next_line(third);
  if (more) {
    for (const char c : delimiter_given_ ? std::vector{delimiter_} : std::vector{';', '\t', ','}) {
      std::vector<std::string> a;
      std::vector<std::string> b;
      split(second.text, c, a);
      split(third.text, c, b);
      if (a.size() < 2 || a.size() != b.size()) continue;
      if (text.find(c) != text.npos) break;  // a header: what follows holds decimal commas besides
      notes_.push_back(fmt::format("{}: row {} (\"{}\") does not fit what follows and is left out", source_,
                                   line_.number, io::start_of(line_.text, kLongestExcerpt)));
      line_ = std::move(second);
      ahead_.push_back(std::move(third));
      return;
    }
    ahead_.push_back(std::move(third));
  }
  ahead_.push_back(std::move(second));
}

void CsvReader::read_layout() {
  if (!next_line(line_)) throw InputError(fmt::format("{}: is empty", source_));
  if (lower(line_.text).starts_with("sep=") && line_.text.size() == 5) {
    delimiter_ = line_.text[4];
    delimiter_given_ = true;
    if (!next_line(line_)) throw InputError(fmt::format("{}: is empty", source_));
  }
  leave_out_fragment();
  const std::string comment = comment_;
  arrow_ = !line_.time.empty();
  std::array<std::string, 5> value;
  if (read_keyed(trimmed(line_.text), value)) layout_ = Layout::keyed;
  if (layout_ == Layout::keyed && !arrow_) {
    throw InputError(
        fmt::format("{}: has no times; record with time stamps, as 12:03:11.123 -> A356B323...", source_));
  }
  std::vector<std::string> label;
  std::vector<std::string> number;
  if (layout_ == Layout::table && read_labelled(line_.text, label, number) &&
      std::ranges::none_of(number, &std::string::empty)) {
    layout_ = Layout::labelled;
    header_ = label;
  }
  std::optional<Line> second;
  if (Line line; next_line(line)) second = std::move(line);
  if (layout_ == Layout::table) find_delimiter(line_, second);
  if (second) ahead_.push_back(std::move(*second));
  comment_ = comment;
  read_header();
}

void CsvReader::read_header() {
  if (layout_ == Layout::keyed) {
    header_ = {"thumb", "index", "middle", "ring", "pinky"};
    notes_.push_back(fmt::format("{}: text for VR drivers: A to E are thumb to pinky", source_));
    has_header_ = false;
    return put_back();
  }
  if (layout_ == Layout::labelled) return put_back();  // the labels name the columns
  split_line();
  if (!arrow_ && delimiter_ == ' ' && cells_.size() > 1 && to_time(cells_[0] + " " + cells_[1])) {
    fail("date and clock are separated like columns; quote them, or separate the columns with commas");
  }
  while (cells_.size() > 1 && cells_.back().empty()) cells_.pop_back();
  header_ = cells_;
  has_header_ =
      !std::ranges::all_of(cells_, [&](const std::string& c) { return c.empty() || parse(c) || to_time(c); });
  if (!has_header_) {
    put_back();
    has_header_ = comment_is_header(comment_);
  }
  for (std::size_t i = 0; i < header_.size(); ++i) {
    if (!has_header_ || header_[i].empty()) header_[i] = fmt::format("column{}", i + 1);
  }
  if (has_header_) return;
  notes_.push_back(fmt::format("{}: has no header: the columns are called {} to {} in their order{}", source_,
                               header_.front(), header_.back(), arrow_ ? "" : ", the first is the time"));
}

// As NumPy writes it: # t_s,index,middle
bool CsvReader::comment_is_header(const std::string& comment) {
  std::vector<std::string> names;
  split(comment, delimiter_, names);
  if (comment.empty() || names.size() != header_.size() || to_time(names.front())) return false;
  header_ = names;
  return true;
}

// A row below the header that holds units instead of numbers.
void CsvReader::read_units() {
  for (const std::string& name : header_) header_units_.push_back(unit_of(name));
  if (!next_line(line_)) throw InputError(fmt::format("{}: has a header but no data", source_));
  split_line();
  const auto is_unit = [](const std::string& cell) { return known_unit(cell) || seconds_in(cell); };
  const auto fits = [&](const std::string& cell) { return is_unit(cell) || cell.empty() || cell == "-"; };
  const bool units = layout_ == Layout::table && has_header_ && cells_.size() <= header_.size() &&
                     std::ranges::any_of(cells_, is_unit) && std::ranges::all_of(cells_, fits);
  if (!units) return put_back();
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    if (is_unit(cells_[i])) header_units_[i] = known_unit(cells_[i]).value_or(cells_[i]);
  }
  notes_.push_back(fmt::format("{}: row {} is taken as a row of units", source_, line_.number));
}

// The first column that is called a time and holds one in the first row.
void CsvReader::find_time(const CsvOptions& options) {
  if (!next_line(line_)) throw InputError(fmt::format("{}: has a header but no data", source_));
  split_line();
  put_back();
  std::optional<double> unit_s;
  const auto holds_time = [&](std::size_t i) {
    return i < cells_.size() && (to_time(cells_[i]).has_value() || parse(cells_[i]).has_value());
  };
  for (std::size_t i = 0; i < header_.size() && !arrow_; ++i) {
    std::optional<double> stated_s;
    if (has_header_ ? !is_time_name(header_[i], stated_s) : i > 0) continue;
    if (time_place_ && (!holds_time(i) || holds_time(*time_place_))) continue;
    time_place_ = i;
    unit_s = stated_s ? stated_s : seconds_in(header_units_[i]);
  }
  if (!time_place_ && !arrow_ && layout_ == Layout::labelled) {
    throw InputError(
        fmt::format("{}: has no times: {}; record with time stamps, as 12:03:11.123 -> {}:{}, or "
                    "print t_ms:{{millis()}} as well",
                    source_, fmt::join(header_, ", "), header_.front(), cells_.front()));
  }
  if (!time_place_ && !arrow_) {
    throw InputError(
        fmt::format("{}: no time column (t_s, time, Time(ms), timestamp ...): name it t_s or time_ms; "
                    "there are: {}",
                    source_, fmt::join(header_, ", ")));
  }
  const auto asked = seconds_in(options.time_unit);
  if (asked && unit_s && *asked != *unit_s) {
    notes_.push_back(fmt::format("{}: column \"{}\" states its unit itself: --time-unit is not for it",
                                 source_, header_[*time_place_]));
  }
  time_unit_s_ = unit_s.value_or(asked.value_or(1));
}

std::size_t CsvReader::place_of(const std::string& name) const {
  const auto it = std::ranges::find(header_, name);
  if (it == header_.end()) {
    throw InputError(
        fmt::format("{}: no column \"{}\"; there are: {}", source_, name, fmt::join(header_, ", ")));
  }
  if (std::find(it + 1, header_.end(), name) != header_.end()) {
    throw InputError(fmt::format("{}: column \"{}\" occurs twice: rename one of them", source_, name));
  }
  return static_cast<std::size_t>(it - header_.begin());
}

// Without any wanted: those that hold a number in the first row, which find_time() has looked at.
void CsvReader::find_columns(const std::vector<std::string>& wanted) {
  const auto take = [&](std::size_t place) {
    columns_.push_back(header_[place]);
    units_.push_back(header_units_[place]);
    places_.push_back(place);
  };
  for (const std::string& name : wanted) take(place_of(name));
  for (std::size_t i = 0; wanted.empty() && i < std::min(header_.size(), cells_.size()); ++i) {
    if (time_place_ != i && (parse(cells_[i]) || is_hole(cells_[i]))) take(place_of(header_[i]));
  }
  if (!columns_.empty()) return;
  for (std::size_t i = 0; i < std::min(header_.size(), cells_.size()); ++i) {
    if (time_place_ != i) {
      fail(fmt::format("no column of numbers: \"{}\" holds \"{}\", which is none", header_[i],
                       io::start_of(cells_[i], kLongestExcerpt)));
    }
  }
  fail("no column beside the time");
}

// With a decimal comma only where commas do not separate.
std::optional<CsvReader::Parsed> CsvReader::parse(std::string_view text) const {
  if (const auto value = to_number(text)) return Parsed{*value, text.find('.') != text.npos ? '.' : char()};
  if (delimiter_ == ',' || text.find(',') == text.npos) return std::nullopt;
  std::string with_point(text);
  std::ranges::replace(with_point, ',', '.');
  const auto value = to_number(with_point);
  if (!value) return std::nullopt;
  return Parsed{*value, ','};
}

double CsvReader::checked(const Parsed& parsed, const std::string& column, const std::string& text) {
  if (!is_measurement(parsed.value)) {
    fail(fmt::format("column \"{}\": {} is not a measurement; mend or remove the row", column, text));
  }
  if (parsed.decimal != 0 && decimal_ != 0 && parsed.decimal != decimal_) {
    fail(fmt::format(
        "column \"{}\": \"{}\": some numbers have a decimal point and some a decimal comma; use one", column,
        text));
  }
  if (parsed.decimal != 0) decimal_ = parsed.decimal;
  return parsed.value;
}

bool CsvReader::is_hole(const std::string& cell) const { return holes_ && is_missing(cell); }

double CsvReader::number(std::size_t cell, const std::string& column) {
  const std::string& text = cells_[cell];
  if (is_hole(text)) return std::numeric_limits<double>::quiet_NaN();
  const auto parsed = parse(text);
  if (!parsed) {
    fail(fmt::format("column \"{}\": \"{}\" is not a number; mend or remove the row", column,
                     io::start_of(text, kLongestExcerpt)));
  }
  return checked(*parsed, column, text);
}

double CsvReader::time(const std::string& text) {
  const std::string& column = time_place_ ? header_[*time_place_] : line_.time;
  const auto parsed = parse(text);
  if (!parsed && !to_time(text) && to_time(text + ".0")) {
    fail(fmt::format(
        "column \"{}\": \"{}\" may be hours and minutes, or minutes and seconds; write it as 0:{}", column,
        text, text));
  }
  const auto found =
      parsed ? std::optional(Time{TimeFormat::number, checked(*parsed, column, text)}) : to_time(text);
  if (!found) {
    fail(fmt::format(
        "column \"{}\": \"{}\" is no time (seconds, 12:03:11.123 or 2026-05-01T12:03:11); mend or remove "
        "the row",
        column, io::start_of(text, kLongestExcerpt)));
  }
  if (!time_format_) {
    time_format_ = found->format;
    if (found->format == TimeFormat::clock) wrap_s_ = kDay_s;
    if (found->format == TimeFormat::minutes) wrap_s_ = kHour_s;
    if (found->format == TimeFormat::number && time_unit_s_ < 1) wrap_s_ = kCounter * time_unit_s_;
  }
  if (found->format != *time_format_) {
    fail(fmt::format("column \"{}\": \"{}\" is written otherwise than the times before", column, text));
  }
  if (found->format == TimeFormat::slashed && is_ambiguous_date(text)) {
    fail(fmt::format("column \"{}\": \"{}\" can be read as two dates; write it as 2026-05-01", column, text));
  }
  const double seconds = found->format == TimeFormat::number ? found->value * time_unit_s_ : found->value;
  if (!is_measurement(seconds)) fail(fmt::format("column \"{}\": {} is no time", column, text));
  return seconds;
}

// Rows that a restarting board leaves behind. Tells nothing of rows that are wrong otherwise.
bool CsvReader::is_torn() {
  if (layout_ == Layout::keyed) return cells_[0].empty() || line_.time.empty();
  if (arrow_ && line_.time.empty()) return true;  // a line without a time of its own
  while (cells_.size() > header_.size() && cells_.back().empty()) cells_.pop_back();
  const auto not_a_number = [&](std::size_t place) {
    return place >= cells_.size() || (!parse(cells_[place]) && !is_hole(cells_[place]));
  };
  const bool odd = cells_.size() != header_.size() || std::ranges::any_of(places_, not_a_number);
  if (odd && has_header_ && line_.text.find(header_.front() + delimiter_) != std::string::npos) {
    return true;  // the header again, whole or with half a row before it
  }
  if (cells_.size() > header_.size()) {
    fail(
        fmt::format("{} cells, the header has {}{}", cells_.size(), header_.size(),
                    delimiter_ == ',' ? "; decimal commas need another separator, such as a semicolon" : ""));
  }
  return cells_.size() < header_.size() || (time_place_ && is_missing(cells_[*time_place_]));
}

// A row that fills other columns of a file, or in which a mark was not seen.
bool CsvReader::is_unmeasured() const {
  return !holes_ && std::ranges::any_of(places_, [&](std::size_t at) { return is_missing(cells_[at]); });
}

void CsvReader::leave_out() {
  if (torn_++ == 0) first_torn_ = line_.number;
  const double forgiven = static_cast<double>(kTornRows) + kTornShare * static_cast<double>(rows_);
  if (static_cast<double>(torn_) > forgiven) {
    throw InputError(fmt::format(
        "{}: row {}: {} of the first {} rows are torn: too short, or without a time; mend or remove them",
        source_, first_torn_, torn_, rows_ + torn_));
  }
}

bool CsvReader::next(Row& row) {
  return seconds_.next(
      row, [this](Row& read) { return read_row(read); }, source_);
}

bool CsvReader::read_row(Row& row) {
  for (;;) {
    if (!next_line(line_)) return false;
    split_line();
    const bool torn = is_torn();
    if (!torn && !is_unmeasured()) break;
    if (lines_.cut_off() && ahead_.empty()) return false;
    if (torn) {
      leave_out();
    } else {
      if (unmeasured_++ == 0) first_unmeasured_ = line_.number;
    }
  }
  ++rows_;
  row.line = line_.number;
  row.t_s = time(arrow_ ? line_.time : cells_[*time_place_]);
  row.value.resize(places_.size());
  for (std::size_t i = 0; i < places_.size(); ++i) row.value[i] = number(places_[i], columns_[i]);
  return true;
}

std::vector<std::string> CsvReader::notes() const {
  std::vector<std::string> out = notes_;
  const auto say = [&](const std::string& what) { out.push_back(fmt::format("{}: {}", source_, what)); };
  if (lines_.is_utf16()) say("is read as UTF-16");
  if (lines_.saw_latin1()) say("is not UTF-8 and is read as Latin-1");
  if (delimiter_ != ',' && layout_ == Layout::table)
    say(fmt::format("{} separate the columns", spelt(delimiter_)));
  if (seconds_.per_second() > 0) {
    say(fmt::format("the times are whole seconds: the rows of each, {} in most, are spread evenly over it",
                    seconds_.per_second()));
  }
  if (decimal_ == ',') say("commas in numbers are decimal commas");
  if (torn_ > 0) {
    say(fmt::format("{} row(s) are too short or without a time and were left out, the first is row {}", torn_,
                    first_torn_));
  }
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
  CsvReader reader(stream, source, {columns, ""});
  return read(reader);
}

Recording read_csv(const std::filesystem::path& path, const std::vector<std::string>& columns,
                   const std::string& time_unit) {
  io::require_readable(path);
  std::ifstream file(path, std::ios::binary);
  CsvReader reader(file, path.string(), {columns, time_unit});
  Recording recording = read(reader);
  if (file.bad()) throw InputError(fmt::format("{}: reading failed", path.string()));
  return recording;
}

std::vector<std::string> columns_of(const std::filesystem::path& path, const std::string& time_unit,
                                    bool holes) {
  io::require_readable(path);
  std::ifstream file(path, std::ios::binary);
  return CsvReader(file, path.string(), {{}, time_unit, holes}).columns();
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
