#include "host/recording/line_format.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "host/io/io.hpp"
#include "host/recording/time.hpp"
#include "host/recording/unit.hpp"
#include "runtime/link/opengloves.hpp"

namespace flexor::recording {
namespace {

constexpr std::array kFingers = {"thumb", "index", "middle", "ring", "pinky"};

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
  for (const char c : {';', '\t', ',', ' '}) {
    split(first, c, a);
    if (!second.empty()) split(second, c, b);
    if (a.size() > 1 && (second.empty() || a.size() == b.size())) return c;
    if (a.size() <= most || c == ' ') continue;
    most = a.size();
    out = c;
  }
  return out;
}

bool cut_at_arrow(std::string& line, std::string& time) {
  const std::string_view text = trimmed(line);
  const auto take = [&](std::size_t end, std::size_t next) {
    std::string_view before = trimmed(text.substr(0, end));
    if (before.starts_with('[') && before.ends_with(']')) before = before.substr(1, before.size() - 2);
    if (!to_time(before)) return false;
    time = std::string(before);
    line = std::string(trimmed(text.substr(std::min(next, text.size()))));
    return true;
  };
  if (const std::size_t at = text.find("->"); at != text.npos && take(at, at + 2)) return true;
  if (text.find(':') == text.npos) return false;
  if (const std::size_t at = text.find(" > "); at != text.npos && take(at, at + 3)) return true;
  // A time of day, perhaps behind a date, a blank, and a list of numbers between commas.
  const std::size_t blank = text.find_first_of(" \t", text.find(':'));
  const std::size_t list = std::min(text.find_first_not_of(" \t", blank), text.size());
  const bool is_list = std::isdigit(static_cast<unsigned char>(text[std::min(list, text.size() - 1)])) != 0 &&
                       text.find(',') > list && text.find(',') != text.npos &&
                       text.substr(list).find('\t') == text.npos && text.substr(list).find(';') == text.npos;
  return is_list && take(blank, list);
}

bool read_labelled(std::string_view line, Cells& cells) {
  cells = {};
  const std::string_view text = trimmed(line);
  if (read_keyed(text, cells)) return true;
  cells = {Layout::labelled, {}, {}};
  bool has_number = false;
  constexpr std::string_view kGaps = " \t,;|";
  const char mark = text.find(':') == text.npos && std::ranges::count(text, '=') > 1 ? '=' : ':';
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

std::optional<Number> read_number(std::string_view cell, char separator) {
  if (const auto value = to_number(cell)) return Number{*value, cell.find('.') != cell.npos ? '.' : char()};
  if (separator == ',' || cell.find(',') == cell.npos) return std::nullopt;
  const std::size_t last = cell.find_last_of(".,");
  const char decimal = cell[last];
  std::string whole(cell.substr(0, last));
  const std::size_t thousands = whole.find_first_of(".,");
  for (std::size_t i = thousands; i < whole.size(); i += 3) {  // 1.013,5 or 1,013.5
    if (whole[i] == decimal || i + 3 >= whole.size()) return std::nullopt;
    whole.erase(i, 1);
  }
  const auto value = to_number(fmt::format("{}.{}", whole, cell.substr(last + 1)));
  if (!value) return std::nullopt;
  return Number{*value, decimal};
}

bool is_number_or_time(const std::string& cell, char separator) {
  return read_number(cell, separator) || to_time(cell);
}

bool has_word(const std::vector<std::string>& cells, char separator) {
  return std::ranges::any_of(cells, [separator](const std::string& cell) {
    return !is_missing(cell) && !is_number_or_time(cell, separator);
  });
}

bool is_header(const std::vector<std::string>& cells, char separator) {
  return std::ranges::none_of(cells, [separator](const std::string& cell) {
    return is_missing(cell) || is_number_or_time(cell, separator);
  });
}

bool is_time_name(std::string_view column, std::optional<double>& unit_s) {
  const NameAndUnit cut = cut_name(column);
  unit_s = seconds_in(cut.unit);
  static constexpr std::array kNames = {
      "t",           "time",    "timestamp",     "datetime",     "date",
      "clock",       "elapsed", "elapsedtime",   "zeit",         "uhrzeit",
      "zeitstempel", "timems",  "elapsedtimein", "relativetime", "lsltimestamp"};
  if (std::ranges::any_of(kNames, [&](const char* n) { return cut.name == n; })) {
    if (cut.name == "timems") unit_s = 1e-3;
    return cut.unit.empty() || unit_s.has_value();
  }
  // A column called by its unit: millis, micros, ms, "seconds".
  if (!cut.unit.empty() || cut.name.size() < 2 || cut.name == "min") return false;
  unit_s = seconds_in(cut.name.starts_with("time") ? cut.name.substr(4) : cut.name);
  return unit_s.has_value();
}

bool is_units_row(const std::vector<std::string>& cells) {
  const auto is_unit = [](const std::string& cell) { return known_unit(cell) || seconds_in(cell); };
  const auto in_brackets = [](const std::string& cell) {
    return cell.starts_with('[') || cell.starts_with('(');
  };
  return std::ranges::any_of(cells, is_unit) && std::ranges::all_of(cells, [&](const std::string& cell) {
           return is_unit(cell) || cell.empty() || cell == "-" || in_brackets(cell);
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
