#include "host/recording/line_format.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "host/io/io.hpp"
#include "host/recording/unit.hpp"
#include "runtime/link/opengloves.hpp"

namespace flexor::recording {
namespace {

bool is_letter(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; }

// Keys with or without a number and nothing else: a header such as A0,A1 is none.
bool is_keyed(std::string_view text) {
  bool is_key = false;
  for (const char c : text) {
    if (!link::glove_text::is_key(c) && !(is_key && link::glove_text::is_digit(c))) return false;
    is_key = true;
  }
  return is_key;
}

// Two fingers or more, or one beside a joystick: "A0" alone is a column's name.
bool read_keyed(std::string_view text, Cells& cells) {
  if (!is_keyed(text) || text.size() >= UINT16_MAX) return false;
  const std::string line = std::string(text) + '\n';
  link::GloveLine read;
  const auto parsed = link::parse_gloves(line.data(), static_cast<std::uint16_t>(line.size()), read);
  const auto add = [&](std::string label, std::uint16_t value) {
    cells.label.push_back(std::move(label));
    cells.value.push_back(std::to_string(value));
  };
  for (std::size_t i = 0; i < kFingers.size(); ++i) {
    if (read.has[i]) add(fmt::format("{}_count", kFingers[i]), read.values.flexion[i]);
    for (std::size_t k = 0; k < link::kGlovePlaces; ++k) {
      if (read.has_joint[i][k]) add(fmt::format("{}_joint{}_count", kFingers[i], k + 1), read.joint[i][k]);
    }
  }
  const bool is_frame =
      parsed == link::GloveParse::ok || (parsed == link::GloveParse::no_fingers && cells.label.size() > 1);
  cells.layout = Layout::keyed;
  return is_frame || parsed == link::GloveParse::information;
}

constexpr std::string_view kOpen = "[<(";
constexpr std::string_view kClose = "]>)";
constexpr std::string_view kMarks = ":,;|";  // behind a time in brackets
constexpr std::string_view kGaps = " \t,;|";

// Without terminals' colours, bars around a table, and what Python and MATLAB print around bytes and lists.
void unwrap(std::string& line) {
  for (std::size_t at = line.find('\x1b'); at != line.npos; at = line.find('\x1b')) {
    const auto end = std::find_if(line.begin() + static_cast<std::ptrdiff_t>(at), line.end(), is_letter);
    line.erase(line.begin() + static_cast<std::ptrdiff_t>(at), end == line.end() ? end : end + 1);
  }
  std::string_view text = trimmed(line);
  if ((text.starts_with("b'") && text.ends_with('\'')) || (text.starts_with("b\"") && text.ends_with('"'))) {
    text = text.substr(2, text.size() - 3);
    while (text.ends_with("\\r") || text.ends_with("\\n")) text.remove_suffix(2);
    text = line = std::string(text);
  }
  text.remove_suffix(text.ends_with("];") ? 1 : 0);
  const std::size_t kind = text.size() < 2 ? 4 : std::string_view("[<(|").find(text.front());
  const bool is_row = kind < 4 && kind == std::string_view("]>)|").find(text.back());
  const std::string_view inner = is_row ? trimmed(text.substr(1, text.size() - 2)) : "";
  const bool is_list = inner.find_first_of("-.0123456789") == 0 &&
                       inner.find_first_of("[]()<>") == inner.npos &&
                       inner.find_first_of(kGaps) != inner.npos;
  if (is_list || (is_row && kind == 3)) line = std::string(inner);
}

constexpr const char* kLevels =
    "i w e d v inf wrn err dbg info warn warning error debug trace";  // of loggers

bool has_labels(std::string_view text, std::size_t least) {
  Cells cells;
  return !text.empty() && is_letter(text.front()) && read_labelled(text, cells) &&
         cells.label.size() >= least;
}

// How far a clock goes from the front, perhaps behind a date and before AM, a zone or a year; or seconds since 1970. 0: there is none.
std::size_t time_end(std::string_view text) {
  const std::size_t digits = std::min(text.find_first_not_of("0123456789."), text.size());
  const bool is_number =
      digits < text.size() && kGaps.find(text[digits]) != kGaps.npos && to_number(text.substr(0, digits));
  std::size_t out = is_number ? digits : 0;
  const std::size_t colon = std::min(text.find(':'), text.size());
  const bool has_gap =
      colon < 30 && (text.find_first_of(" \t", colon) != text.npos || std::ranges::any_of(text, is_letter));
  std::size_t end = has_gap ? text.find_first_of(kGaps, colon) : text.npos;
  for (int k = 0; k < 3 && end != text.npos; ++k, end = text.find_first_of(kGaps, end + 1)) {
    const std::size_t mark = text[end - 1] == ':' ? end - 1 : end;
    if (to_time(text.substr(0, mark))) out = mark;
    // What stands behind a separator is another cell, but for milliseconds behind Python's comma.
    const std::size_t next = text.find_first_of(kGaps, end + 1);
    const bool has_comma =
        next != text.npos && text[next] == ' ' && text.substr(0, end).find('.') == text.npos;
    if (text[end] != ' ' && !has_comma) break;
  }
  return out;
}

struct Prefix {
  std::string_view rest;
  std::string_view time = {};
  bool is_sure = false;  // for a time may be a cell
  bool is_logged = false;
  bool has_tag = false;
  void drop(std::size_t n) { rest = trimmed(rest.substr(std::min(n, rest.size()))); }
  bool has_time_and(std::string_view marks) const { return !time.empty() && rest.find_first_of(marks) == 0; }
};

void take_arrow(Prefix& p) {
  for (const std::string_view arrow : {"->", " > "}) {
    const std::size_t at = p.rest.find(arrow);
    if (!p.time.empty() || at == p.rest.npos || (arrow != "->" && p.rest.find(':') == p.rest.npos)) continue;
    std::string_view before = trimmed(p.rest.substr(0, at));
    if (before.starts_with('[') && before.ends_with(']')) before = before.substr(1, before.size() - 2);
    if (!to_time(before)) continue;
    p.time = before;
    p.is_sure = true;
    p.drop(at + arrow.size());
  }
}

bool take_part(Prefix& p) {
  const std::size_t bracket = kOpen.find(p.rest.front());
  const std::size_t close = bracket == kOpen.npos ? p.rest.npos : p.rest.find(kClose[bracket]);
  const std::string_view word =
      !is_letter(p.rest.front()) ? "" : p.rest.substr(0, p.rest.find_first_of(" \t([:"));
  const std::string_view after = trimmed(p.rest.substr(word.size()));
  if (close != p.rest.npos) {
    const std::string_view inner = trimmed(p.rest.substr(1, close - 1));
    const std::string_view time = inner.substr(inner.starts_with("0 ") ? 2 : 0);  // days, of Tera Term
    const std::size_t next = std::min(p.rest.find_first_not_of(' ', close + 1), p.rest.size() - 1);
    const bool is_cell = to_number(time) && kMarks.find(p.rest[next]) != kMarks.npos;  // (1), 0.02, 300
    const bool is_time = p.time.empty() && !is_cell && to_time(time);
    p.has_tag = p.has_tag || is_one_of(inner, kLevels);
    p.is_logged = p.is_logged || p.has_tag;
    if (!is_time && !(p.is_logged && inner.find_first_of("-.0123456789") != 0)) return false;
    if (is_time) p.time = time;
    p.is_sure = true;
    p.drop(close + 1);
    while (p.has_time_and(kMarks) || (!p.time.empty() && p.rest.starts_with("- "))) p.drop(1);
  } else if (is_one_of(word, kLevels) && p.rest[std::min(word.size(), p.rest.size() - 1)] != '\t' &&
             (word.size() > 1 ? !after.empty() : after.starts_with('(')) && !has_labels(p.rest, 2)) {
    p.is_logged = true;
    if (!after.starts_with(':') && p.rest.find_first_of(":=0123456789") == p.rest.npos)
      return false;  // names
    p.has_tag = word.size() == 1;
    p.drop(word.size() + (after.starts_with(':') ? 1 : 0));
  } else if (const std::size_t end = p.time.empty() ? time_end(p.rest) : 0; end > 0) {
    p.time = p.rest.substr(0, end);
    const std::size_t next = p.rest.find_first_not_of(" :", end);
    p.is_sure = p.rest.substr(end).starts_with(": ") ||
                (p.rest[end] != '\t' && p.time.find(' ') != p.time.npos && next != p.rest.npos &&
                 kMarks.find(p.rest[next]) == kMarks.npos && p.rest[next] != '\t');
    p.drop(end);
    const std::size_t last = p.rest.rfind(" - ");
    if (p.rest.starts_with("- ") && last != p.rest.npos && std::ranges::any_of(p.rest, is_letter)) {
      p.is_logged = true;  // Python: - glove - INFO -
      p.drop(last + 3);
    }
  } else {
    return false;
  }
  return true;
}

}  // namespace

bool split(std::string_view line, char separator, std::vector<std::string>& cells) {
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
    const bool separates = separator == ' ' ? c == ' ' || c == '\t' : c == separator;
    if (quoted && c == '"' && i + 1 < line.size() && line[i + 1] == '"') {
      cell->push_back('"');
      ++i;
    } else if (c == '"' && (quoted || trimmed(*cell).empty())) {
      quoted = !quoted;
    } else if (separates && !quoted) {
      if (separator != ' ' || !cell->empty()) cell = &next_cell();
    } else {
      cell->push_back(c);
    }
  }
  if (separator == ' ' && n > 1 && cell->empty()) --n;
  cells.resize(n);
  for (std::string& text : cells) {
    const std::string_view inner = trimmed(text);
    if (inner.size() != text.size()) text = std::string(inner);
  }
  return quoted;
}

char separator_of(std::string_view first, std::string_view second) {
  std::vector<std::string> a;
  std::vector<std::string> b;
  char out = second.empty() ? ' ' : ',';
  std::size_t most = 1;
  for (const char c : kSeparators) {
    split(first, c, a);
    if (!second.empty()) split(second, c, b);
    if (a.size() > 1 && (second.empty() || a.size() == b.size())) return c;
    if (a.size() <= most || c == ' ') continue;
    most = a.size();
    out = c;
  }
  return out;
}

void cut_prefix(std::string& line, std::string& time) {
  unwrap(line);
  const bool has_gap = line.find_first_of(" \t[>'\"") != line.npos || std::ranges::any_of(line, is_letter);
  if (!has_gap || line.find_first_of(":,=>'\"([<") == line.npos) return;  // 0.05,356 or 0.05 356
  Prefix p{trimmed(line)};
  take_arrow(p);
  while (!p.rest.empty() && take_part(p)) {
  }
  if (p.has_time_and(":") || (p.has_time_and(kMarks) && has_labels(trimmed(p.rest.substr(1)), 1))) p.drop(1);
  const bool is_list = p.rest.find_first_of("-.0123456789") == 0 && p.rest.find(',') != p.rest.npos &&
                       p.rest.find_first_of("\t;") == p.rest.npos;
  const bool is_dated_list = is_list && is_epoch(to_number(p.time).value_or(kFirstEpoch_s));
  if (!p.time.empty() && !p.rest.empty() &&
      (p.is_sure || p.is_logged || is_dated_list || has_labels(p.rest, 1))) {
    const std::size_t tag = std::min(p.rest.find(": "), p.rest.size() - 1);
    const std::string_view tagged = trimmed(p.rest.substr(tag + 1));
    const bool is_source = is_letter(p.rest.front()) && p.rest.find_first_of(",;\t|") > tag &&  // RX: 300,310
                           tagged.find_first_of("-.0123456789") == 0 && !has_labels(p.rest, 1);
    if (is_source || (p.is_logged && !tagged.empty() && (p.has_tag || has_labels(tagged, 1))))
      p.drop(tag + 2);
    time = std::string(p.time);
    const bool is_ms = p.is_logged && p.time.find_first_not_of("0123456789") == p.time.npos;
    if (is_ms) time = time.size() > 3 ? time.insert(time.size() - 3, ".") : fmt::format("0.{:0>3}", time);
    line = std::string(p.rest);
  }
  unwrap(line);
}

bool read_labelled(std::string_view line, Cells& cells) {
  cells = {};
  const std::string_view text = trimmed(line);
  if (read_keyed(text, cells)) return true;
  cells = {Layout::labelled, {}, {}};
  bool has_number = false;
  const char mark = text.find(':') == text.npos ? '=' : ':';
  // Where each piece between two gaps but blanks has one label, its value may be several words.
  const auto gaps =
      std::ranges::count_if(text, [&](char c) { return c != ' ' && kGaps.find(c) != kGaps.npos; });
  const auto marks = std::ranges::count(text, mark);
  const std::string_view separators = kGaps.substr(marks > 1 && marks == gaps + 1 ? 1 : 0);
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t colon = text.find(mark, at);
    const std::string_view label = trimmed(text.substr(at, std::min(colon, text.size()) - at));
    if (colon == text.npos || label.empty() || !is_letter(label.front()) ||
        label.find_first_of(",;|\"") != label.npos)
      return false;
    const std::size_t begin = std::min(text.find_first_not_of(" \t", colon + 1), text.size());
    const std::size_t end = std::min(text.find_first_of(separators, begin), text.size());
    const std::string_view value = trimmed(text.substr(begin, end - begin));
    const std::size_t word_end = std::min(value.find(' '), value.size());
    cells.label.emplace_back(label);
    cells.value.emplace_back(known_unit(value.substr(word_end)) ? value.substr(0, word_end) : value);
    has_number = has_number || is_missing(cells.value.back()) || to_number(cells.value.back());
    at = std::min(text.find_first_not_of(kGaps, end), text.size());
    const std::size_t word = std::min(text.find_first_of(kGaps, at), text.size());
    const std::size_t next = std::min(text.find_first_not_of(kGaps, word), text.size());
    if (known_unit(text.substr(at, word - at)) && !text.substr(next).starts_with(mark)) at = next;
  }
  return has_number;
}

std::optional<double> read_number(std::string_view cell, char separator) {
  constexpr std::string_view kMinus = "\xE2\x88\x92";  // as in Swedish
  if (cell.starts_with(kMinus)) return read_number('-' + std::string(cell.substr(kMinus.size())), separator);
  const auto number = to_number(cell);
  if (number || separator == ',' || cell.find(',') == cell.npos) return number;
  const std::size_t last = cell.find_last_of(".,");
  const char decimal = cell[last];
  std::string whole(cell.substr(0, last));
  const std::size_t thousands = whole.find_first_of(".,");
  for (std::size_t i = thousands; i < whole.size(); i += 3) {  // 1.013,5 or 1,013.5
    if (whole[i] == decimal || i + 3 >= whole.size()) return std::nullopt;
    whole.erase(i, 1);
  }
  return to_number(fmt::format("{}.{}", whole, cell.substr(last + 1)));
}

std::optional<Time> time_in(std::string_view cell, char separator) {
  const auto number = is_packed_date(cell) ? std::nullopt : read_number(cell, separator);
  return number ? Time{TimeFormat::number, *number} : to_time(cell);
}

CellCounts count_cells(const std::vector<std::string>& cells, char separator) {
  CellCounts out;
  for (const std::string& cell : cells)
    if (!is_missing(cell)) ++(time_in(cell, separator) ? out.numbers : out.words);
  return out;
}

bool has_word(const std::vector<std::string>& cells, char separator) {
  return count_cells(cells, separator).words > 0;
}

bool is_header(const std::vector<std::string>& cells, char separator) {
  return count_cells(cells, separator).words == cells.size();
}

bool is_greeting(const std::vector<std::string>& cells) {
  constexpr const char* kWords =
      "ready started starting hello boot booting initialized connected calibrating version";
  return std::ranges::any_of(cells, [](std::string_view word) {
    word = word.substr(0, word.find_last_not_of(".,:!") + 1);
    const bool is_numbered = word.size() > 2 && word.find_first_not_of("0123456789.", 1) == word.npos;
    return is_one_of(word, kWords) ||
           (is_numbered && lower(word).starts_with('v') && word.find('.') != word.npos);
  });
}

TimeName read_time_name(std::string_view column) {
  constexpr const char* kNames =
      "t time times timestamps date datetime clock elapsed elapsedtime timems elapsedtimein relativetime "
      "systime systemtime sampletime localtime sensortime hosttime frametime logtime receivetime "
      "sampletimefine xvalue "
      "unixtime posixtime epochtime epoch epoc utc utctime timeelapsed secondselapsed timeunix zeit uhrzeit "
      "datum zeitstempel temps heure horodatage "
      "tiempo hora tempo ora tijd tid czas zaman masa waktu aika cas čas idő время Время 時間 時刻 时间 "
      "時間戳 时间戳 시간";
  const NameAndUnit cut = cut_name(column);
  const auto unit_s = cut.name == "timems" ? 1e-3 : seconds_in(cut.unit);
  if (cut.name.ends_with("stamp") || (cut.name == "x" && unit_s) || is_one_of(cut.name, kNames))
    return {cut.unit.empty() || unit_s, unit_s};
  if (!cut.unit.empty() || cut.name.size() < 2) return {false, unit_s};
  // A column called by its unit: millis, micros, ms, "seconds".
  const auto called_s = seconds_in(cut.name.starts_with("time") ? cut.name.substr(4) : cut.name);
  return {called_s && *called_s <= 1, called_s};
}

bool names_prefix(std::string_view column) {
  return read_time_name(column).is_time || is_one_of(column, "level severity") || is_one_of(column, kLevels);
}

bool is_units_row(const std::vector<std::string>& cells) {
  return std::ranges::any_of(cells, is_unit) && std::ranges::all_of(cells, [](std::string_view cell) {
           return is_unit(cell) || cell.empty() || cell == "-" || cell.starts_with('[') ||
                  cell.starts_with('(');
         });
}

std::string listed(const std::vector<std::string>& names) {
  constexpr std::size_t kMost = 12;
  constexpr std::size_t kLongest = 30;
  std::string out;
  for (std::size_t i = 0; i < std::min(kMost, names.size()); ++i)
    out += (i > 0 ? ", " : "") + io::start_of(names[i], kLongest);
  if (names.size() > kMost) out += fmt::format(", ... ({} in all)", names.size());
  return out;
}

}  // namespace flexor::recording
