#include "host/recording/table.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <set>
#include <utility>

#include "host/io/io.hpp"
#include "host/recording/unit.hpp"

namespace flexor::recording {
namespace {

using Kind = Problem::Kind;

constexpr std::size_t kLongestExcerpt = 40;  // of a cell in a message
constexpr double kForgivenRows = 5;          // that are malformed, and
constexpr double kForgivenShare = 0.1;
constexpr std::size_t kTitles = 40;    // lines in which the first row of numbers is looked for
constexpr std::size_t kLiveRows = 20;  // of look-ahead where rows come as they are made, and
constexpr std::size_t kRows = 60'000;  // of a file: what gives nothing for ten minutes at 100 Hz is dead
constexpr std::size_t kStandingRows = 1000;  // in which a clock stands
constexpr double kShort_s = 2;               // of a step: a longer one also skips what is no minute
constexpr const char* kClock = "clock";      // --segment: it starts again
constexpr const char* kNoData = "has a header but no data";
constexpr double kHour_s = 3600;

std::string excerpt(std::string_view text) { return io::start_of(text, kLongestExcerpt); }

bool has_fraction(std::string_view number) { return number.find_first_of(".,") != number.npos; }

// What a file that is no text is, by how it begins, with the mend; nothing of text.
const char* binary_kind(std::string_view line) {
  static constexpr std::array<std::pair<std::string_view, const char*>, 12> kKinds = {
      {{"{", "JSON: write its fields as the columns of CSV"},
       {"<?xml", "XML: write its table as CSV"},
       {"<html", "HTML: write its table as CSV"},
       {"<!doctype html", "HTML: write its table as CSV"},
       {"%pdf", "a PDF: export the table as CSV"},
       {"version https://git-lfs", "a pointer of Git LFS: git lfs pull"},
       {"matlab ", "a MATLAB file: writetable(T, \"log.csv\") in MATLAB"},
       {"\xC2\x89hdf", "an HDF5 or MATLAB file: write its table as CSV"},
       {"\xC2\x89", "no text: export it as CSV"},
       {"pk\x03\x04", "an Excel workbook or a ZIP archive: save the sheet as CSV"},
       {"\xC3\x90\xC3\x8F\x11", "an old Excel workbook: save the sheet as CSV"},
       {"\x1F\xC2\x8B", "compressed: gunzip it"}}};
  const std::string first = lower(line.substr(0, kLongestExcerpt));
  const auto* const kind =
      std::ranges::find_if(kKinds, [&](const auto& k) { return first.starts_with(k.first); });
  if (kind != kKinds.end()) return kind->second;
  if (first == "[" || first.starts_with("[{")) return kKinds[0].second;
  const bool is_text = std::ranges::none_of(
      line.substr(0, 200), [](unsigned char c) { return c < ' ' && c != '\t' && c != '\r' && c != '\f'; });
  return is_text ? nullptr : "no text: export it as CSV";
}

// More numbers than words, and at least so many; of 300,5 400,2 the commas separate nothing.
bool is_row(const std::vector<std::string>& cells, char separator, std::size_t fewest) {
  const auto is_two = [](std::string_view cell) {
    const std::size_t blank = std::min(cell.find(' '), cell.size());
    return to_number(cell.substr(0, blank)) && to_number(trimmed(cell.substr(blank))) && !to_time(cell);
  };
  if (separator == ',' && std::ranges::any_of(cells, is_two)) return false;
  const std::size_t numbers = count_cells(cells, separator).numbers;
  return numbers >= fewest && 2 * numbers > cells.size();
}

void cut_blanks(std::vector<std::string>& cells, std::size_t least) {
  while (cells.size() > least && cells.back().empty()) cells.pop_back();
}

// Without the empty ones at the end that are more than so many.
std::vector<std::string> cells_of(std::string_view text, char separator, std::size_t least = SIZE_MAX) {
  std::vector<std::string> out;
  split(text, separator, out);
  cut_blanks(out, least);
  return out;
}

// Vicon's, below which rows a second stand.
bool is_section_title(std::vector<std::string> cells) {
  static constexpr std::array kSections = {"Devices", "Model Outputs", "Trajectories", "Joints", "Segments"};
  cut_blanks(cells, 1);
  return cells.size() == 1 && std::ranges::count(kSections, cells[0]) > 0;
}

// What each column of the lines that came is. They are copied: more may be needed.
class Finder : public TableState {
 public:
  explicit Finder(const TableState& known) : TableState(known) {}

  // Only lines that say for sure what they are make a live log's columns; but what begins as a table without rows is one.
  bool is_strict() const { return is_port() || (is_pipe() && !has_ended_ && ahead_.size() <= kTitles); }

  bool is_enough() const {
    Cells cells;
    if (has_labview_header() && !has_ended_)
      return labview_titles() > 0 && at(labview_titles() + 1) != nullptr;
    return !is_strict() || find_labels(cells) || find_first_row();
  }

  void settle() {
    for (const auto stage :
         {&Finder::find_layout, &Finder::read_header, &Finder::read_units, &Finder::find_time}) {
      if (!problem_) (this->*stage)();
    }
    if (!problem_ && !is_port()) require_one_log();
    if (!problem_ && !options_.time.segments.empty()) find_segments(options_.time.segments);
    if (!problem_) choose(options_.columns);
    is_settled_ = !problem_;
  }

  void choose(const std::vector<std::string>& columns) {
    columns_.clear();
    units_.clear();
    places_.clear();
    left_out_.clear();
    const auto take = [&](std::optional<std::size_t> place) {
      if (!place) return;
      columns_.push_back(header_[*place]);
      units_.push_back(header_units_[*place]);
      places_.push_back(*place);
    };
    for (const std::string& name : columns) take(place_of(name));
    if (!columns.empty()) return;
    for (const std::size_t place : columns_of_numbers()) take(is_port() ? place : place_of(header_[place]));
    if (!columns_.empty()) return;
    split_line(at(0)->text);
    const std::size_t i = time_place_ == 0U ? 1 : 0;
    if (i >= std::min(header_.size(), cells_.size()) || time_place_ == i)
      return refuse(Kind::no_column, "no column beside the time", at(0)->number);
    const std::string detail = fmt::format(
        "no column of numbers: \"{}\" holds \"{}\"; write numbers alone, and their unit into the name, as "
        "index_V",
        header_[i], excerpt(cells_[i]));
    refuse(Kind::no_column, detail, at(0)->number);
  }

  // Of several sections in a file another may have what was asked for.
  bool may_be_elsewhere() const { return is_section_ && problem_ && problem_->kind == Kind::no_column; }
  bool must_wait() const { return !has_ended_ && (wants_more_ || (is_port() && problem_)); }

 private:
  std::size_t most_ahead() const { return is_live() ? kLiveRows : kRows; }

  struct FirstRow {
    std::size_t place;
    char separator;
  };
  struct Clock {
    std::size_t place;
    int rank;
    std::optional<double> unit_s;
  };

  void find_layout() {
    const char* kind = is_port() || at(0) == nullptr ? nullptr : binary_kind(at(0)->text);
    if (kind != nullptr) return refuse(Kind::not_text, fmt::format("is {}", kind));
    if (at(0) != nullptr && at(0)->text.size() == 5 && lower(at(0)->text).starts_with("sep="))
      separator_ = ahead_[first_++].text[4];
    Cells cells;
    while (at(0) != nullptr && read_labelled(at(0)->text, cells) && cells.label.empty())
      ++first_;  // what a VR driver's glove is
    if (at(0) == nullptr) return refuse(Kind::empty, "is empty");
    if (has_labview_header()) {
      separator_ = separator_of(at(1) != nullptr ? at(1)->text : "\t");
      leave_out_titles(labview_titles());
      if (at(0) == nullptr) return refuse(Kind::empty, kNoData);
    }
    cut_prefix_names();
    if (const auto labels = find_labels(cells)) {
      leave_out_titles(*labels);
      layout_ = cells.layout;
      header_ = cells.label;
    } else if (const auto row = find_first_row()) {
      separator_ = row->separator;
      first_row_ = first_ + row->place;
      leave_out_titles(row->place > 0 ? header_above(row->place) : 0);
    } else if (separator_ == 0) {
      separator_ = separator_of(at(0)->text, at(1) != nullptr ? at(1)->text : "-");
    }
    arrow_ = !at(0)->time.empty();
  }

  bool has_labview_header() const {
    return at(0) != nullptr && at(0)->text.starts_with("LabVIEW Measurement");
  }

  // The lines down to the second mark of an end; 0: it has not come.
  std::size_t labview_titles() const {
    int ends = 0;
    std::size_t i = 0;
    for (; at(i) != nullptr && ends < 2; ++i)
      ends += at(i)->text.find("***End_of_Header***") != std::string::npos ? 1 : 0;
    return ends == 2 ? i : 0;
  }

  // What names the clock and the level before the rows, where theirs was cut off them: Date Time flex above 2026-05-01 12:03:11 430
  void cut_prefix_names() {
    const auto is_cut_row = [](const Line& line) {
      const char c = separator_of(line.text);
      return !line.time.empty() && count_cells(cells_of(line.text, c), c).numbers > 0;
    };
    std::size_t row = 1;
    while (row < kTitles && at(row) != nullptr && !is_cut_row(*at(row))) ++row;
    if (at(row) == nullptr || row == kTitles) return;
    Line& names = ahead_[first_ + row - 1];
    const char separator = separator_of(names.text);
    while (cells_of(names.text, separator).size() > cells_of(at(row)->text, separator).size()) {
      const std::size_t end = names.text.find_first_of(" \t,;");
      if (end == names.text.npos || !names_prefix(names.text.substr(0, end))) return;
      names.text.erase(0, names.text.find_first_not_of(" \t,;", end));
      names.time = at(row)->time;
    }
  }

  std::string_view separators() const {
    return separator_ != 0 ? std::string_view(&separator_, 1) : kSeparators;
  }

  // The first line of labels that one of the next two has, too, or the first line; at a port the newest, whatever it began with.
  std::optional<std::size_t> find_labels(Cells& cells) const {
    Cells next;
    const auto has_same = [&](std::size_t i) {
      return at(i) != nullptr && read_labelled(at(i)->text, next) && next.label == cells.label;
    };
    for (std::size_t i = 0; !is_port() && i < kTitles && at(i) != nullptr; ++i) {
      const bool are_labels = read_labelled(at(i)->text, cells) && !cells.label.empty();
      if (are_labels && std::ranges::none_of(cells.value, is_missing) && (has_same(i + 1) || has_same(i + 2)))
        return i;
    }
    const std::size_t i = is_port() ? ahead_.size() - first_ - 1 : 0;
    if (at(i) == nullptr || !read_labelled(at(i)->text, cells) || cells.label.empty()) return std::nullopt;
    const bool may_be_title = cells.label.size() == 1 && at(i)->time.empty();
    if (may_be_title && (i == 0 || !has_same(i - 1))) return std::nullopt;  // nRows=3
    const bool is_row = is_port() ? !std::ranges::all_of(cells.value, is_missing)
                                  : std::ranges::none_of(cells.value, is_missing);
    return is_row ? std::optional(i) : std::nullopt;
  }

  // The first of two rows of numbers that have as many cells as each other, and the separator; else the first of two lines that
  // have, whatever they hold. None: there are no such lines.
  std::optional<FirstRow> find_first_row() const {
    std::optional<FirstRow> of_words;
    for (std::size_t i = 0; i < kTitles && at(i + 1) != nullptr; ++i) {
      const Line& second = *at(i + 1);
      const bool takes_one = !second.time.empty() || is_port();
      for (const char c : separators()) {
        std::vector<std::string> b = cells_of(second.text, c);
        const std::vector<std::string> a = cells_of(at(i)->text, c, b.size());
        cut_blanks(b, a.size());
        if (a.size() != b.size() || (a.size() < 2 && (!takes_one || c != ','))) continue;
        const auto is_data = [&](const std::vector<std::string>& cells, std::size_t row) {
          return is_row(cells, c, takes_one ? 1 : 2) || is_under_header(cells, c, row);
        };
        const bool is_names = i == 0 && a.size() > 1 && is_header(a, c) && !is_greeting(a);
        if ((is_names || is_data(a, i)) && is_data(b, i + 1)) return FirstRow{i, c};
        if (i == 0 && a.size() > 1 && !of_words) of_words = FirstRow{0, c};
      }
    }
    return is_strict() ? row_under_names() : of_words;
  }

  // Whether the cells that are filled are numbers, few as they may be, below a header of as many cells and a row of units.
  bool is_under_header(const std::vector<std::string>& cells, char separator, std::size_t row) const {
    if (has_word(cells, separator) || std::ranges::all_of(cells, is_missing)) return false;
    for (std::size_t i = row; i-- > row - std::min<std::size_t>(row, 3);) {
      const std::vector<std::string> names = cells_of(at(i)->text, separator, cells.size());
      if (names.size() == cells.size() && is_header(names, separator)) return true;
    }
    return false;
  }

  // The newest line, if it has a number for each of the names above it, which only greetings precede, or in the comment.
  std::optional<FirstRow> row_under_names() const {
    const std::size_t last = ahead_.size() - first_ - 1;
    for (const char c : separators()) {
      const std::vector<std::string> row = cells_of(at(last)->text, c);
      if (!is_row(row, c, 1)) continue;
      if (last == 0 && row.size() > 1 && cells_of(at(0)->comment, c).size() == row.size() &&
          is_row(row, c, 2))
        return FirstRow{0, c};
      std::vector<std::string> names;
      for (std::size_t i = 0; i < last && names.size() < 2; ++i) names = cells_of(at(i)->text, c, row.size());
      if (names.size() > 1 && names.size() == row.size() && is_header(names, c) && !is_greeting(names))
        return FirstRow{last, c};
    }
    return std::nullopt;
  }

  // The nearest line above the rows that has as many cells, or the one right above, unless it is a greeting.
  std::size_t header_above(std::size_t row) const {
    const std::size_t width = cells_of(at(row)->text, separator_).size();
    for (std::size_t i = row; i-- > 0;) {
      const std::vector<std::string> names = cells_of(at(i)->text, separator_);
      const bool is_above = i + 1 == row;
      const bool is_odd =
          names.size() == 1
              ? !is_above || (is_port() && at(i)->time.empty()) || names[0].find(' ') != std::string::npos
              : names.size() != width && !names_any(names) && at(i)->text.find(':') != std::string::npos;
      const bool is_no_header = is_odd || (is_greeting(names) && !names_any(names));
      const bool fits = names.size() <= width && 2 * names.size() > width;
      const auto is_number = [&](const auto& cell) {  // but the time at which a header came
        const auto time = time_in(cell, separator_);
        return time && (&cell != &names[0] || time->format == TimeFormat::number || names.size() < width);
      };
      if (!is_no_header && (fits || is_above) && !(is_units_row(names) && i > 0) &&
          std::ranges::none_of(names, is_number) && !std::ranges::all_of(names, is_missing))
        return i;
    }
    return row;
  }

  static bool names_any(const std::vector<std::string>& cells) {
    return std::ranges::any_of(
        cells, [](const auto& cell) { return read_time_name(cell).is_time || !unit_of(cell).empty(); });
  }

  void leave_out_titles(std::size_t count) {
    if (count == 0) return;
    const std::size_t begin = first_;
    bool is_storage = false;  // OpenSim's
    for (; first_ < begin + count; ++first_) {
      ahead_[first_].is_title = true;
      std::string text = lower(trimmed(ahead_[first_].text));
      std::erase_if(text, [](char c) { return c == ' ' || c == '\t'; });
      is_storage = is_storage || text.starts_with("version=");
      take_rate(rate_in(text));
      if (text == "indegrees=yes") title_unit_ = "deg";
      if (text == "indegrees=no" || (text == "endheader" && is_storage && title_unit_.empty()))
        title_unit_ = "rad";  // as OpenSim reads what says nothing
      const std::vector<std::string>& cells =
          titles_.emplace_back(cells_of(text.empty() ? text : ahead_[first_].text, separator_, 0));
      if (titles_.size() > 1) read_title(titles_[titles_.size() - 2], cells);
    }
    note(count == 1
             ? fmt::format("row {} (\"{}\") does not fit what follows and is left out", ahead_[begin].number,
                           excerpt(ahead_[begin].text))
             : fmt::format("rows {} to {} are titles", ahead_[begin].number, ahead_[first_ - 1].number));
  }

  // Of a title such as FREQUENCY 100, OutputRate: 60Hz, in lower case without blanks; 0: it states none.
  static double rate_in(std::string_view title) {
    title.remove_prefix(std::min(title.find_first_not_of('/'), title.size()));
    const std::size_t end = std::min(title.find_first_of(":=,;.([0123456789"), title.size());
    if (!is_one_of(title.substr(0, end),
                   "fs frequency samplingfrequency samplingrate samplerate outputrate updaterate framerate"))
      return 0;
    title.remove_prefix(std::min(title.find_first_not_of(":=,;([hz])", end), title.size()));
    if (title.ends_with("hz")) title.remove_suffix(2);
    return to_number(title).value_or(0);
  }

  // One that is given goes before. False: it is none.
  bool take_rate(double rate_hz) {
    const bool is_rate = rate_hz > 0 && std::isfinite(rate_hz);
    if (is_rate && options_.time.log_rate_hz == 0) frame_rate_hz_ = rate_hz;
    return is_rate;
  }

  // By the row above it: OpenSim's .trc has the unit of all positions below "Units", Vicon the rows a second below a section.
  void read_title(const std::vector<std::string>& above, const std::vector<std::string>& cells) {
    const auto place = static_cast<std::size_t>(std::ranges::find(above, "Units") - above.begin());
    if (place < std::min(above.size(), cells.size())) title_unit_ = cells[place];
    if (cells.size() > 1 && cells[0] == "Y_Unit_Label") title_unit_ = known_unit(cells[1]).value_or("");
    if (cells.size() > 1 && cells[0] == "Delta_X") take_rate(1 / to_number(cells[1]).value_or(0));
    if (cells.size() == 1 && is_section_title(above))
      is_section_ |= take_rate(to_number(cells[0]).value_or(0));
  }

  void read_header() {
    if (layout_ == Layout::keyed) note("text for VR drivers: A to E are thumb to pinky");
    if (layout_ != Layout::table) return;  // the labels name the columns
    split_line(at(0)->text);
    std::size_t width = 1;  // of the rows: the last cell of the first may be missing
    for (std::size_t k = 0; k < kStandingRows && at(k) != nullptr; ++k) {
      const std::size_t cells = cells_of(at(k)->text, separator_, 1).size();
      if (cells <= cells_.size()) width = std::max(width, cells);
    }
    if (cells_.front() == "X_Value" && cells_.back() == "Comment") cells_.pop_back();
    cut_blanks(cells_, width);
    header_ = cells_;
    has_header_ = has_word(cells_, separator_);
    if (has_header_ && (is_row(cells_, separator_, 1) || is_greeting(cells_) || repeats_words()) &&
        !names_any(cells_) &&
        at(1) != nullptr) {  // not its header: a row that has a word, or half of one, or a greeting
      has_header_ = false;
      if (!has_word(cells_of(at(1)->text, separator_), separator_)) leave_out_titles(1);
    }
    if (has_header_) {
      ++first_;
      find_clock();
      cut_noise(header_[0]);
      if (time_in(header_[0], separator_)) header_[0] = "time";
      name_by_titles();
    } else {
      has_header_ = comment_is_header(at(0)->comment);
    }
    has_index_ = has_header_ && header_[0].empty() && options_.time.log_rate_hz == 0;
    for (std::size_t i = 0; i < header_.size(); ++i)
      if (!has_header_ || header_[i].empty()) header_[i] = fmt::format("column{}", i + 1);
    if (!has_header_)
      note(fmt::format("has no header: the columns are called column1 to column{} in their order",
                       header_.size()));
  }

  // Of three columns, unless each is all of the time in a unit of its own.
  void find_clock() {
    static constexpr std::array kParts = {"h hh hr hour hours", "m mm min mins minute minutes",
                                          "s ss sec secs second seconds"};
    const auto is_part = [](const std::string& name, const char* part) {
      return is_one_of(name.substr(name.find_last_of("_ .") + 1), part);
    };
    const auto is_clock = [this](const std::string& cell) {
      const auto time = time_in(cell, separator_);
      return time && time->format == TimeFormat::clock;
    };
    const auto at_hour = std::search(header_.begin(), header_.end(), kParts.begin(), kParts.end(), is_part);
    if (at_hour == header_.end()) return;
    wants_more_ |= at(1) == nullptr;
    clock_place_ = at_hour - header_.begin();
    if (!std::ranges::all_of(cells_ahead(*clock_place_), is_clock)) return clock_place_.reset();
    note(fmt::format("\"{}\" are one time", fmt::join(at_hour, at_hour + 3, "\", \"")));
    header_.erase(at_hour + 1, at_hour + 3);
    header_[*clock_place_] = "time";
  }

  // Whether the next row has the same words among its numbers: A0 300 A1 310
  bool repeats_words() const {
    const auto next = at(1) != nullptr ? cells_of(at(1)->text, separator_) : std::vector<std::string>();
    const auto fits = [&](const std::string& cell, const std::string& below) {
      return cell == below || (time_in(cell, separator_) && time_in(below, separator_));
    };
    return !is_header(cells_, separator_) && std::ranges::equal(cells_, next, fits);
  }

  // Bytes that a line caught before its board began to send are Latin-1 or control characters; a name that states a time or a unit
  // stands behind the last of them.
  void cut_noise(std::string& name) {
    std::size_t begin = 0;
    for (std::size_t i = 0; i < name.size(); ++i) {
      const auto c = static_cast<unsigned char>(name[i]);
      const bool is_latin1 = i > 0 && c >= 0x80 && (name[i - 1] == '\xC2' || name[i - 1] == '\xC3');
      if (c < ' ' || c == 0x7F || is_latin1) begin = i + 1;
    }
    const std::string rest = name.substr(begin);
    const bool is_name = read_time_name(rest).is_time || (is_port() && !unit_of(rest).empty());
    if (begin == 0 || !is_name) return;
    note(fmt::format("what stands before \"{}\" in the header is noise and is left out", excerpt(rest)));
    name = rest;
  }

  // Whether a row of titles, such as IDs, tells the same columns apart as the names above it do.
  static bool repeats(const std::vector<std::string>& title, const std::vector<std::string>& above) {
    bool tells = false;
    if (title.size() != above.size()) return false;
    for (std::size_t i = 0; i + 1 < title.size(); ++i) {
      const bool differs = above[i] != above[i + 1];
      if (!above[i].empty() && differs != (title[i] != title[i + 1])) return false;
      tells = tells || (!above[i].empty() && differs);
    }
    return tells;
  }

  // Columns without a name, or of one name, get that of the nearest title that spans them.
  void name_by_titles() {
    const auto is_unique = [&](const std::string& name) {
      return !name.empty() && std::ranges::count(header_, name) == 1;
    };
    for (auto title = titles_.rbegin(); title != titles_.rend() && !std::ranges::all_of(header_, is_unique);
         ++title) {
      if (title->size() < 2 || title->size() > header_.size()) continue;
      if (title + 1 != titles_.rend() && repeats(*title, *(title + 1))) continue;
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
  bool comment_is_header(const std::string& comment) {
    const std::vector<std::string> names = cells_of(comment, separator_);
    if (comment.empty() || names.size() != header_.size() || to_time(names.front())) return false;
    header_ = names;
    find_clock();
    return true;
  }

  // A row below the header that holds units instead of numbers; else a title's.
  void read_units() {
    for (const std::string& name : header_) {
      const std::string ending = lower(name.substr(name.size() - std::min<std::size_t>(name.size(), 3)));
      const bool is_angle = !read_time_name(name).is_time && !is_one_of(ending, "_tx _ty _tz");
      const std::string unit = unit_of(name);
      header_units_.push_back(unit.empty() && is_angle ? title_unit_ : unit);
    }
    const bool may_have_row = layout_ == Layout::table && has_header_;
    const std::size_t end = may_have_row ? std::max(first_row_, first_ + 1) : first_;
    for (std::size_t i = first_; i < std::min(end, ahead_.size()); ++i) {
      split_line(ahead_[i].text);
      if (cells_.size() > header_.size() || !is_units_row(cells_)) continue;
      for (; first_ < i; ++first_) ahead_[first_].is_title = true;
      ++first_;
      for (std::size_t k = 0; k < cells_.size(); ++k)
        if (is_unit(cells_[k])) header_units_[k] = known_unit(cells_[k]).value_or(cells_[k]);
      note(fmt::format("row {} is taken as a row of units", ahead_[i].number));
    }
    if (at(0) == nullptr) refuse(Kind::empty, kNoData);
  }

  // A column's cells in the rows ahead, of which some may be too short.
  std::vector<std::string> cells_ahead(std::size_t place) {
    std::vector<std::string> out;
    for (std::size_t k = 0; k < kStandingRows && at(k) != nullptr; ++k) {
      split_line(at(k)->text);
      if (place < cells_.size()) out.push_back(cells_[place]);
    }
    return out;
  }

  TimeName time_name(std::size_t place) const {
    const bool is_index = place == 0 && (has_index_ || (!has_header_ && !is_port()));
    TimeName out = has_header_ && !is_index ? read_time_name(header_[place]) : TimeName{is_index};
    if (!out.unit_s) out.unit_s = seconds_in(header_units_[place]);
    return out;
  }

  // How likely a column is the time, the higher the likelier; none: it is not.
  std::optional<Clock> clock_in(std::size_t place, const std::vector<std::string>& first) {
    const auto [is_named, unit_s] = time_name(place);
    Clock out{place, 1, unit_s};
    const auto time = time_in(place < first.size() ? first[place] : "", separator_);
    const bool is_number = time && time->format == TimeFormat::number;
    if (!is_named && (!time || is_number || time->format == TimeFormat::days)) return std::nullopt;
    const std::vector<std::string> cells = cells_ahead(place);
    if (!time && frame_rate_hz_ > 0 && std::ranges::all_of(cells, is_missing)) return std::nullopt;
    if (!time) return out;
    const auto counts = [&](const auto& a, const auto& b) {
      const auto above = read_number(a, separator_);
      const auto below = read_number(b, separator_);
      return above && below && *below == *above + 1;
    };
    // The same for so long is no clock, but when a session began.
    const bool stands = cells.size() > 1 && std::ranges::count(cells, cells[0]) == std::ssize(cells);
    wants_more_ |= is_pipe() && stands && at(kStandingRows - 1) == nullptr;
    if (is_number && out.unit_s.value_or(1) == 1 && cells.size() > 1 &&
        std::ranges::adjacent_find(cells, std::not_fn(counts)) == cells.end()) {
      out.rank = out.unit_s || !options_.time.unit.empty() ? 3 : 2;
    } else if (!stands) {
      out.rank = place == 0 && has_index_ && is_number ? 3 : is_named ? 5 : 4;
    }
    return out;
  }

  // The column that is called a time and holds one in the first row, or that has times of day or dates.
  void find_time() {
    split_line(at(0)->text);
    const std::vector<std::string> first = cells_;
    const bool has_rate = options_.time.log_rate_hz > 0;
    std::optional<Clock> best;
    std::optional<Clock> other;  // that would do as well
    for (std::size_t i = 0; i < header_.size() && !arrow_; ++i) {
      std::optional<Clock> clock = clock_in(i, first);
      wants_more_ |= has_rate && at(1) == nullptr;
      if (!clock || (has_rate && (has_header_ ? clock->rank < 3 : clock->rank != 4))) continue;
      const bool are_stated = is_port() && best && best->unit_s && clock->unit_s;
      wants_more_ |= best && !are_stated && at(1) == nullptr;
      if (best && header_[i] == header_[best->place]) continue;  // as Delsys repeats X[s]
      if (!best || clock->rank > best->rank) std::swap(best, clock);
      if (clock && clock->rank > (best->rank > 3 ? 3 : 2)) other = clock;
    }
    const std::vector<std::string>& asked = options_.time.columns;
    if (const auto parted = asked.empty() || has(one_of(asked)) ? find_parted_time() : std::nullopt) {
      best = parted;
      other.reset();
    } else if (!asked.empty()) {
      const auto place = place_of(one_of(asked));
      if (!place && !has(one_of(asked)))
        problem_->detail += fmt::format("; each file takes the first that it has: --time-column {} {}",
                                        asked.front(), best ? header_[best->place] : "t_s");
      if (!place) return;
      const auto by_name = seconds_in(cut_name(header_[*place]).unit);
      arrow_ = false;
      best = clock_in(*place, first)
                 .value_or(Clock{*place, 0, by_name ? by_name : seconds_in(header_units_[*place])});
      other.reset();
    }
    choose_time(best, other);
    for (std::size_t i = 0; best && times_.other.empty() && i < header_.size(); ++i) {
      const bool has_unit = seconds_in(header_units_[i]) || seconds_in(cut_name(header_[i]).unit);
      if (i == best->place || is_of_time(i) || !has_unit || !course(i)) continue;
      times_.other = header_[i];
      if (header_[i] != kHostClock && disagree(best->place, i))
        note(fmt::format("\"{}\" is taken for the time and disagrees with \"{}\": --time-column takes that",
                         header_[best->place], header_[i]));
    }
    if (best && !best->unit_s && options_.time.unit.empty()) find_packed_clock();
  }

  // Of two columns that are one time, as stamp.sec and stamp.nanosec, or a clock of whole seconds and ms, that of the seconds.
  std::optional<Clock> find_parted_time() {
    for (std::size_t i = 0; i < header_.size() && !arrow_ && has_header_; ++i) {
      const auto [stem, second] = cut_unit(header_[i]);
      const auto [is_named, unit_s] = time_name(i);
      const bool is_clock = second != 1 && is_named && !unit_s;
      if ((second != 1 && !is_clock) ||
          (!options_.time.columns.empty() && header_[i] != one_of(options_.time.columns)))
        continue;
      const std::vector<std::string> seconds = cells_ahead(i);
      for (std::size_t j = 0; j < header_.size(); ++j) {
        const auto [part_stem, part_s] = cut_unit(header_[j]);
        if (part_s == 0 || part_s >= 1 || part_stem != (is_clock ? "" : stem)) continue;
        // tv_sec and tv_usec are one time; t_s and t_ms may both be all of it, and then the second never falls.
        const bool is_stamp = part_s < 1e-3 && lower(header_[i]).find("sec") != std::string::npos;
        if (!fits_part(seconds, cells_ahead(j), part_s, is_clock, is_stamp)) continue;
        wants_more_ |= is_pipe() && seconds.front() == seconds.back() && at(kStandingRows - 1) == nullptr;
        part_place_ = j;
        part_s_ = part_s;
        note(fmt::format("\"{}\" and \"{}\" are one time", header_[i], header_[j]));
        return Clock{i, 5, is_clock ? std::nullopt : std::optional(1.0)};
      }
    }
    return std::nullopt;
  }

  // What a name is before the unit of time at its end, and the seconds of this; 0: there is none.
  static std::pair<std::string, double> cut_unit(const std::string& column) {
    const std::size_t unit = column.find_last_of("._ ") + 1;
    return {lower(column.substr(0, unit)), seconds_in(column.substr(unit)).value_or(0)};
  }

  // Whether one column has whole seconds and the other what is left of them: it falls where they go on, where a few rows may show it.
  bool fits_part(const std::vector<std::string>& seconds, const std::vector<std::string>& parts,
                 double part_s, bool is_clock, bool is_stamp) const {
    bool falls = !is_clock && (is_stamp || (!seconds.empty() && is_epoch(to_number(seconds[0]).value_or(0))));
    double last = 0;
    for (std::size_t k = 0; k < std::min(seconds.size(), parts.size()); ++k) {
      const auto time = time_in(seconds[k], separator_);
      const auto part = read_number(parts[k], separator_);
      if (!time || is_clock == (time->format == TimeFormat::number) || time->value != std::floor(time->value))
        return false;
      if (!part || has_fraction(parts[k]) || *part < 0 || *part * part_s >= 1) return false;
      if (*part < last && seconds[k] == seconds[k - 1]) return false;
      falls = falls || *part < last;
      last = *part;
    }
    return falls && !seconds.empty();
  }

  // How far a column goes over the rows ahead, of many the second half, which a burst at the start is not in, and its longest step as
  // a share of that; none: it falls, stands or holds what is no time. In seconds where its unit is known.
  struct Course {
    double span = 0;
    double longest = 0;
    bool is_known = false;
  };
  std::optional<Course> course(std::size_t place) {
    Course out;
    std::optional<double> last;
    std::optional<double> unit_s = time_name(place).unit_s;
    const std::vector<std::string> cells = cells_ahead(place);
    for (std::size_t k = cells.size() > 20 ? cells.size() / 2 : 0; k < cells.size(); ++k) {
      if (is_missing(cells[k])) continue;
      const auto time = time_in(cells[k], separator_);
      if (!time || time->value < last.value_or(time->value)) return std::nullopt;
      if (time->format != TimeFormat::number) unit_s = 1;
      out.longest = std::max(out.longest, time->value - last.value_or(time->value));
      out.span += time->value - std::exchange(last, time->value).value_or(time->value);
    }
    out.longest /= out.span;
    out.span *= unit_s.value_or(1);
    out.is_known = unit_s.has_value();
    return out.span > 0 ? std::optional(out) : std::nullopt;
  }

  // Whether two clocks whose units are known run at rates that differ by more than a hundredth and a step.
  bool disagree(std::size_t a, std::size_t b) {
    const auto one = course(a);
    const auto other = course(b);
    if (!one || !other || !one->is_known || !other->is_known) return false;
    return std::abs(one->span / other->span - 1) > 0.01 + one->longest + other->longest;
  }

  const std::string& one_of(const std::vector<std::string>& asked) const {
    const auto named = std::ranges::find_if(asked, [this](const auto& name) { return has(name); });
    return named == asked.end() ? asked.front() : *named;
  }

  // By the clock only where no column is asked for that the file has: its counterpart may have one.
  void find_segments(const std::vector<std::string>& asked) {
    splits_by_clock_ = !has(one_of(asked)) && std::ranges::count(asked, kClock) > 0;
    if (!splits_by_clock_) segment_place_ = place_of(one_of(asked));
    if (!segment_place_) return;
    const std::vector<std::string> labels = cells_ahead(*segment_place_);
    const auto stands_above = [&](bool missing) {
      const auto is_pair = [&](const auto& a, const auto& b) {
        return !is_missing(a) && is_missing(b) == missing;
      };
      return std::ranges::adjacent_find(labels, is_pair) != labels.end();
    };
    labels_begin_ = stands_above(true) && !stands_above(false);
    if (labels_begin_)
      note(fmt::format("a label in \"{}\" begins a trial, which ends at the next", header_[*segment_place_]));
  }

  void choose_time(std::optional<Clock> best, const std::optional<Clock>& other) {
    if (!best && frame_rate_hz_ > 0) {
      options_.time.log_rate_hz = frame_rate_hz_;  // of Vicon's rows, of which a frame may have several
      const bool has_frames = header_.size() > 1 && header_[0] == "Frame" && header_[1] == "Sub Frame";
      std::vector<double> parts;
      for (const std::string& cell : has_frames ? cells_ahead(1) : cells_)
        if (const auto part = has_frames ? to_number(cell) : std::nullopt) parts.push_back(*part);
      if (!parts.empty()) frame_rows_ = std::ranges::max(parts) - std::ranges::min(parts) + 1;
    }
    if (best) time_place_ = best->place;
    times_.are_guessed = best && (!has_header_ || (has_index_ && best->place == 0));
    if (other) {
      const std::string both = fmt::format("columns \"{}\" and \"{}\" could both be the time",
                                           header_[best->place], header_[other->place]);
      if (!is_port() && (!has_header_ || disagree(best->place, other->place)))
        return refuse(Kind::ambiguous, both + ": say which: --time-column " + header_[best->place]);
      times_.other = header_[other->place];
      note(fmt::format("{}: \"{}\" is taken; the other: --time-column \"{}\"", both, time_column(),
                       times_.other));
    }
    require_time();
    const auto asked = seconds_in(options_.time.unit);
    if (asked && best && best->unit_s && *asked != *best->unit_s)
      note(fmt::format("column \"{}\" states its unit itself: --time-unit is not for it", time_column()));
    const auto since_1970 = best && !best->unit_s && !asked ? epoch_unit_s(best->place) : std::nullopt;
    times_.unit_s = (best ? best->unit_s : since_1970).value_or(asked.value_or(since_1970.value_or(1)));
    times_.is_unit_known = (best ? best->unit_s.has_value() : !arrow_) || asked || since_1970;
  }

  // Of a count in a unit so small that its seconds were not of our time.
  std::optional<double> epoch_unit_s(std::size_t place) {
    struct Epoch {
      double unit_s;
      double before_1970_s;
      const char* name;
    };
    static constexpr std::array<Epoch, 5> kEpochs = {{{1e-3, 0, "ms since 1970"},
                                                      {1e-6, 0, "us since 1970"},
                                                      {1e-9, 0, "ns since 1970"},
                                                      {1e-7, 11'644'473'600, "100 ns since 1601"},
                                                      {1e-7, 62'135'596'800, "100 ns since the year 1"}}};
    split_line(at(0)->text);
    const double number = place < cells_.size() ? read_number(cells_[place], separator_).value_or(0) : 0;
    for (const auto& [unit_s, before_1970_s, name] : kEpochs) {
      if (!is_epoch(number * unit_s - before_1970_s)) continue;
      note(fmt::format("\"{}\" is taken for {}", header_[place], name));
      time_zero_ = before_1970_s / unit_s;
      return unit_s;
    }
    return std::nullopt;
  }

  // Clocks as one number each. With milliseconds (120311123) two that are less than a second apart: what counts milliseconds is
  // soon none any more. Seconds (120311 or 120311.123) also count to 60 and beyond if they are no clocks, so a minute must pass
  // in a short step among the rows ahead, and nothing among them count further.
  void find_packed_clock() {
    const std::size_t place = *time_place_;
    std::optional<double> last_s;
    double ticks = 0;  // a second
    bool passes = false;
    for (std::size_t k = 0; k < most_ahead() && packed_ticks_ == 0; ++k) {
      wants_more_ |= at(k) == nullptr && !passes;
      if (at(k) == nullptr) break;
      split_line(at(k)->text);
      const auto number = place < cells_.size() ? read_number(cells_[place], separator_) : std::nullopt;
      if (!number && last_s) continue;
      if (!number) return;
      const std::size_t digits = cells_[place].find_first_not_of("0123456789");
      const std::size_t size = std::min(digits, cells_[place].size());
      const bool is_whole = digits == std::string::npos;
      if (ticks == 0) ticks = size == 5 || size == 6 ? 1 : is_whole && (size == 8 || size == 9) ? 1000 : 0;
      const auto clock_s = ticks > 0 ? to_packed_clock(*number / ticks) : std::nullopt;
      const double before_s = last_s.value_or(clock_s.value_or(0));
      if (!clock_s || *clock_s < before_s) return;
      if (ticks > 1 && last_s && *clock_s - before_s < 1) packed_ticks_ = ticks;
      if (ticks > 1 && last_s) break;
      passes |= *clock_s - before_s < kShort_s && std::floor(*clock_s / 60) > std::floor(before_s / 60);
      last_s = clock_s;
    }
    if (passes) packed_ticks_ = ticks;
    if (packed_ticks_ > 0)
      note(fmt::format("\"{}\" is a clock as one number: hours, minutes, seconds{}", header_[place],
                       ticks > 1 ? ", milliseconds" : ""));
  }

  // Of a column that gives the rows to gloves or fingers in turn, by words or by small numbers under such a name.
  void require_one_log() {
    for (std::size_t i = 0; i < header_.size(); ++i) {
      std::vector<std::string> cells = cells_ahead(i);
      const double rows = static_cast<double>(cells.size());
      const std::set<std::string> ids(cells.begin(), cells.end());
      const bool is_part = is_one_of(cut_name(header_[i]).name, "finger joint sensor channel field");
      const bool is_named =
          is_part || is_one_of(cut_name(header_[i]).name, "hand side glove device node board");
      const bool are_ids = !is_of_time(i) && std::ranges::all_of(ids, [&](const std::string& id) {
        return !is_missing(id) && (!time_in(id, separator_) || (is_named && id.size() == 1));
      });
      wants_more_ |= is_pipe() && are_ids && at(8) == nullptr;
      const auto turns = static_cast<double>(std::unique(cells.begin(), cells.end()) - cells.begin());
      if (!are_ids || rows < 8 || ids.size() > 10 || turns < (is_named ? 0.25 : 1) * rows) continue;
      refuse(Kind::ambiguous,
             fmt::format("the rows are of several in turn, by \"{}\" ({}): make a {} of each", header_[i],
                         listed({ids.begin(), ids.end()}), is_part ? "column (a pivot table)" : "file"));
    }
  }

  void require_time() {
    const bool is_asked = options_.time.log_rate_hz > 0;
    if (has_time() && is_asked) note("has times of its own: --log-rate is not for it");
    if (has_time() || is_asked || is_port()) return;
    refuse(Kind::no_time,
           fmt::format(
               "{}: {}; record with time stamps, as 12:03:11.123 -> ..., name a column t_s or time_ms, say "
               "which it is with --time-column, or give the rows a second: --log-rate 50",
               layout_ == Layout::table ? "no time column" : "has no times", listed(header_)));
  }

  std::optional<std::size_t> place_of(const std::string& name) {
    const auto it = std::ranges::find(header_, name);
    if (it == header_.end()) {
      std::vector<std::string> all = elsewhere_;
      all.insert(all.end(), header_.begin(), header_.end());
      refuse(Kind::no_column, fmt::format("no column \"{}\"; there are: {}", name, listed(all)));
    } else if (std::find(it + 1, header_.end(), name) != header_.end()) {
      refuse(Kind::no_column, fmt::format("column \"{}\" occurs twice: rename one of them", name));
    } else {
      return static_cast<std::size_t>(it - header_.begin());
    }
    return std::nullopt;
  }

  // A column is of numbers when more cells of the first rows that are not missing are numbers than words.
  std::vector<std::size_t> columns_of_numbers() {
    std::vector<std::optional<int>> more(header_.size());  // numbers than words; none: all are missing
    if (time_place_) more[*time_place_] = 0;
    if (part_place_) more[*part_place_] = 0;
    const auto are_known = [&] { return std::ranges::count(more, std::optional<int>()) == 0; };
    const std::size_t fewest = is_live() ? 1 : kLiveRows;
    std::size_t k = 0;
    for (; k < most_ahead() && (k < fewest || !are_known()) && at(k) != nullptr; ++k) {
      split_line(at(k)->text);
      for (std::size_t i = 0; i < std::min(header_.size(), cells_.size()); ++i) {
        if (is_missing(cells_[i]) || is_of_time(i) || (k >= fewest && more[i])) continue;
        more[i] = more[i].value_or(0) + (read_number(cells_[i], separator_) ? 1 : -1);
      }
    }
    wants_more_ |= !are_known() && !is_port() && k < most_ahead();
    std::vector<std::size_t> out;
    std::vector<std::string> left;
    for (std::size_t i = 0; i < header_.size(); ++i) {
      if (more[i] ? *more[i] > 0 : options_.holes == Holes::all) {
        out.push_back(i);
      } else if (!is_of_time(i) && (!more[i] || !header_units_[i].empty())) {
        left.push_back(header_[i]);
      }
    }
    left_out_ = left.empty() ? "" : listed(left);
    return out;
  }

  std::vector<std::vector<std::string>> titles_;
  std::size_t first_row_ = 0;  // that is one for sure
  bool has_index_ = false;     // its first column has no name, as pandas writes the index
  bool wants_more_ = false;
};

}  // namespace

// Into cells_, in the order of the header; none where the line is of another layout, or has a label of its own.
void TableState::split_line(const std::string& text) {
  if (layout_ == Layout::table) {
    split(text, separator_, cells_);
    if (clock_place_ && cells_.size() >= *clock_place_ + 3) {
      const auto hour = cells_.begin() + static_cast<std::ptrdiff_t>(*clock_place_);
      *hour += ":" + hour[1] + ":" + hour[2];
      cells_.erase(hour + 1, hour + 3);
    }
    found_ = cells_.size();
    if (order_.empty() || found_ != order_.size()) return;
    const std::vector<std::string> cells = cells_;
    for (std::size_t i = 0; i < found_; ++i)
      cells_[i] = cells[static_cast<std::size_t>(std::ranges::find(order_, header_[i]) - order_.begin())];
    return;
  }
  cells_.clear();
  new_label_.clear();
  found_ = 0;
  if (!read_labelled(text, labelled_) || labelled_.layout != layout_ || labelled_.label.empty()) return;
  found_ = labelled_.label.size();
  if (layout_ == Layout::keyed && found_ < header_.size()) return;  // a line that was cut
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

TableReader::TableReader(const TableOptions& options) : TableState(options) {
  if (!options_.time.unit.empty() && !seconds_in(options_.time.unit))
    refuse(Kind::option,
           fmt::format("unknown unit of time \"{}\"; known: s, ms, us, ns", options_.time.unit));
}

bool TableReader::push(Line& line) {
  const std::string_view inner = trimmed(line.text);
  if (inner.empty() || inner.front() == '#' || inner.starts_with("% ")) {
    const std::size_t text = inner.find_first_not_of("#% ");
    if (text != std::string_view::npos) comment_ = inner.substr(text);
    return false;
  }
  if (inner.find("---") != inner.npos && inner.find_first_not_of("+-=|: ") == inner.npos)
    return false;  // a rule
  line.comment = std::exchange(comment_, {});
  line.time.clear();
  line.is_title = false;
  cut_prefix(line.text, line.time);
  is_new_ = is_settled_ && ahead_.empty();
  std::swap(is_new_ ? line_ : ahead_.emplace_back(), line);
  try_settle();
  if (!is_settled_ && is_port() && ahead_.size() > kTitles) {
    ahead_.front().is_title = true;
    first_ = 1;
  }
  return true;
}

// On a copy: more lines may be needed, and a port's may be noise.
void TableReader::try_settle() {
  if (is_settled_ || problem_ || (!is_live() && !has_ended_ && ahead_.size() < next_try_)) return;
  Finder finder(*this);
  if (!finder.is_enough()) return;
  finder.settle();
  if (finder.may_be_elsewhere() && skip_section(finder.header())) return try_settle();
  if (finder.must_wait() || (finder.may_be_elsewhere() && !has_ended_)) {
    next_try_ = 2 * ahead_.size();
  } else {
    static_cast<TableState&>(*this) = std::move(finder);
  }
}

bool TableReader::skip_section(const std::vector<std::string>& header) {
  const auto begins = [](const Line& line) {
    return is_section_title({line.text.substr(0, line.text.find_last_not_of(",;\t ") + 1)});
  };
  const auto next = std::find_if(ahead_.begin() + 1, ahead_.end(), begins);
  if (next == ahead_.end()) return false;
  note(fmt::format("rows {} to {} are a section without the column", ahead_.front().number,
                   (next - 1)->number));
  elsewhere_.insert(elsewhere_.end(), header.begin(), header.end());
  ahead_.erase(ahead_.begin(), next);
  return true;
}

void TableReader::choose(const std::vector<std::string>& columns) {
  Finder finder(*this);
  finder.choose(columns);
  static_cast<TableState&>(*this) = std::move(finder);
}

// The names of the first header, perhaps in another order; the first one may be cut, or stand behind half a row. Those of another
// glove share some with it, or come when it was plugged in.
bool TableReader::is_header_again() {
  const bool has_labels = layout_ != Layout::table;
  std::vector<std::string> names = has_labels ? labelled_.label : cells_of(line_.text, separator_);
  if (has_labels ? new_label_.empty() : !has_header_ || !is_header(names, separator_)) return false;
  if (!to_number(names[0].substr(0, 1))) found_ = 0;  // 1;2;3 may be a row that is separated otherwise
  const bool shares = std::ranges::any_of(names, [this](const auto& name) { return has(name); });
  for (std::string& name : names) {  // in other capitals
    const auto own = std::ranges::find(header_, lower(name), lower);
    if (own != header_.end() && !has(name)) name = *own;
  }
  for (const std::string& name : header_) {
    const bool is_cut = names[0].ends_with(name) || name.ends_with(names[0]);
    if (is_cut && std::ranges::count(names, name) == 0) names[0] = name;
  }
  if (!has_labels && std::ranges::is_permutation(names, header_)) {
    order_ = names == header_ ? std::vector<std::string>() : names;
    other_.clear();
    ++headers_;
    return true;
  }
  if (names.size() > 1 && (is_fresh_ || shares)) other_ = names;
  return false;
}

// Whether the row is of the other header that came last.
bool TableReader::is_anothers() {
  const bool has_labels = layout_ != Layout::table;
  if (has_labels && new_label_.empty()) other_.clear();
  if (other_.empty() || (has_labels ? labelled_.label != other_ : has_word(cells_, separator_))) return false;
  const std::vector<std::string> other = std::exchange(other_, {});
  if (found_ != other.size()) return false;
  refusal_ = fmt::format("{}, and they were {}", fmt::join(other, ","), fmt::join(header_, ","));
  return true;
}

// Whether line_ has the header's cells. Without a reason it is what a restarting board leaves behind.
bool TableReader::is_whole(Problem& why) {
  if (line_.text.find('\0') != std::string::npos) return false;  // of a card that lost power
  cut_blanks(cells_, header_.size());
  if (cells_.size() > header_.size() && rows_.kept() == 0)
    why.detail =
        fmt::format("{} cells, the header has {}{}", cells_.size(), header_.size(),
                    separator_ == ',' ? "; decimal commas need another separator, such as a semicolon" : "");
  return cells_.size() == header_.size();
}

// Null: none. `last` is the number above it without a fraction, 0: there is none.
const char* TableReader::fault_of(const std::string& cell, double number, double& last) {
  const std::size_t point = cell.find_last_of(".,");
  const bool may_be_thousands = number >= 1 && point < 4 && cell.size() == point + 4;
  if (may_be_thousands && last >= 100 && number < last / 100 && std::abs(1000 * number - last) < last / 2)
    return "follows whole numbers a thousand times as large: leave out what separates the thousands";
  last = point == cell.npos ? number : 0;
  if (!is_measurement(number)) return "is not a measurement; mend or remove the row";
  if (point == cell.npos) return nullptr;
  if (decimal_ != 0 && cell[point] != decimal_ && !is_port())
    return "some numbers have a decimal point and some a decimal comma; use one";
  decimal_ = cell[point];
  return nullptr;
}

bool TableReader::read_values(std::vector<double>& value, Problem& why) {
  value.resize(places_.size());
  last_.resize(places_.size());
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const std::string& cell = cells_[places_[i]];
    value[i] = std::numeric_limits<double>::quiet_NaN();
    if (is_missing(cell)) continue;
    const auto number = read_number(cell, separator_);
    const std::size_t digits = cell.find_last_of("0123456789") + 1;
    const char* fault =
        number ? fault_of(cell, *number, last_[i])
        : digits > 0 && (known_unit(trimmed(cell.substr(digits))) || cell.ends_with('%'))
            ? "has its unit behind it; write numbers alone, and the unit into the column's name, as angle_deg"
            : "is not a number; mend or remove the row";
    if (fault != nullptr) {
      why.column = columns_[i];
      why.detail = fmt::format(fmt::runtime(number ? "{} {}" : "\"{}\" {}"), excerpt(cell), fault);
      return false;
    }
    value[i] = *number;
  }
  return true;
}

// By rows, or Vicon's frames.
bool TableReader::read_frame(double& t_s) {
  const auto frame = frame_rows_ > 0 ? to_number(cells_[0]) : std::nullopt;
  const auto part = frame ? to_number(cells_[1]) : std::nullopt;
  if (frame_rows_ > 0 && !part) return false;
  const double row = part ? *frame * frame_rows_ + *part : static_cast<double>(rows_.rows() + malformed_);
  if (part && !first_frame_) first_frame_ = row;
  t_s = (row - first_frame_.value_or(0)) / options_.time.log_rate_hz;
  return true;
}

// False with a reason, or without one where no time stands.
bool TableReader::read_time(double& t_s, Problem& why) {
  if (!has_time()) return read_frame(t_s);
  const std::string& text = arrow_ ? line_.time : cells_[*time_place_];
  if (is_missing(text)) return false;
  const auto refuse_it = [&](const std::string& what) {
    why.column = time_place_ ? header_[*time_place_] : line_.time;
    why.detail = fmt::format("\"{}\" {}", excerpt(text), what);
    return false;
  };
  std::optional<Time> found = time_in(text, separator_);
  if (!found && to_time(text + ".0"))
    return refuse_it("may be hours and minutes, or minutes and seconds; write it as 0:" + excerpt(text));
  bool is_number = found && found->format == TimeFormat::number;
  // Fractions, and seconds since 1970, are what they look like.
  if (is_number && !times_.is_unit_known) times_.is_unit_known = has_fraction(text) || is_epoch(found->value);
  if (packed_ticks_ > 0) {
    const auto clock_s = is_number ? to_packed_clock(found->value / packed_ticks_) : std::nullopt;
    if (!clock_s)
      return refuse_it(fmt::format(
          "is no clock as {} is 12:03:11.123, as the rows before; if it counts, add --time-unit {}",
          packed_ticks_ > 1 ? "120311123" : "120311.123", packed_ticks_ > 1 ? "ms" : "s"));
    found = Time{TimeFormat::clock, *clock_s};
    is_number = false;
  }
  if (!found)
    return refuse_it("is no time (seconds, 12:03:11.123 or 2026-05-01T12:03:11); mend or remove the row");
  const char* fault = is_number ? fault_of(text, found->value, last_time_) : nullptr;
  if (fault != nullptr) return refuse_it(fault);
  if (!time_format_ || is_port()) {
    time_format_ = found->format;
    times_.is_unit_known |= !is_number;
    if (found->format == TimeFormat::clock) times_.wrap_s = kDay_s;
    if (found->format == TimeFormat::minutes) times_.wrap_s = kHour_s;
  }
  const std::size_t point = text.find_last_of(".,");
  times_.are_uneven |= !is_number && point != text.npos && text.size() - point < 4;
  if (found->format != *time_format_) return refuse_it("is written otherwise than the times before");
  const bool is_month_first = found->format == TimeFormat::slashed && lower(text).find('m') != text.npos;
  if (is_month_first && !std::exchange(is_month_first_, true))
    note("dates with AM or PM are taken month first");
  if (found->is_ambiguous && !is_port()) return refuse_it("can be read as two dates; write it as 2026-05-01");
  t_s = is_number ? (found->value - time_zero_) * times_.unit_s : found->value;
  if (part_place_) {
    const auto part = read_number(cells_[*part_place_], separator_);
    if (!part) return false;
    if (*part * part_s_ < 1) t_s += *part * part_s_;  // else it is a clock of its own
  }
  return is_measurement(t_s) || refuse_it("is no time");
}

void TableReader::leave_out(const Problem& why) {
  if (malformed_++ == 0) first_malformed_ = why;
  too_long_ += cells_.size() > header_.size() ? 1 : 0;
  const double forgiven = kForgivenRows + kForgivenShare * static_cast<double>(rows_.kept());
  if (static_cast<double>(malformed_) <= forgiven || is_port()) return;
  const bool has_commas = 2 * too_long_ > malformed_ && separator_ == ',';
  const std::string detail = fmt::format(
      "{} of the first {} rows are malformed: too short or too long, without a time, or with text for a "
      "number; mend or remove them{}",
      malformed_, rows_.kept() + malformed_, has_commas ? "; decimal commas need another separator" : "");
  refuse(Kind::malformed, detail, first_malformed_.row);
}

TableReader::Take TableReader::take(Row& row) {
  if (problem_ || (ahead_.empty() && !is_new_) || (!is_settled_ && first_ == 0)) return Take::none;
  if (!std::exchange(is_new_, false)) {
    std::swap(line_, ahead_.front());
    ahead_.pop_front();
  }
  if (first_ > 0) {
    --first_;
    return line_.is_title ? Take::malformed : Take::aside;
  }
  split_line(line_.text);
  is_over_ = is_over_ || (is_section_ && is_section_title(cells_));
  if (is_over_ || !refusal_.empty() || is_anothers()) return Take::aside;
  const std::string* label =
      segment_place_ && *segment_place_ < cells_.size() ? &cells_[*segment_place_] : nullptr;
  const bool is_labelled = label != nullptr && !is_missing(*label);
  if (label != nullptr && !is_labelled && (!labels_begin_ || segments_ == 0)) return Take::aside;
  // Of logs beside each other one ends first.
  const auto is_blank = [this](std::size_t place) { return is_missing(cells_[place]); };
  if (time_place_ && cells_.size() == header_.size() && is_blank(*time_place_) &&
      std::ranges::all_of(places_, is_blank))
    return Take::aside;
  Problem why{Kind::cell, line_.number, "", ""};
  const auto is_none = [](double value) { return std::isnan(value); };
  const bool is_good = is_whole(why) && read_time(row.t_s, why) && read_values(row.value, why) &&
                       (!is_port() || has_time() || !std::ranges::all_of(row.value, is_none));
  if (is_good && rows_.keeps(row.value, line_.number)) {
    is_fresh_ = false;
    if (is_labelled && (std::exchange(segment_, *label) != *label || labels_begin_)) ++segments_;
    row.segment = segments_;
    row.line = line_.number;
    return Take::row;
  }
  if (line_.is_cut_off) return Take::aside;
  if (is_good) return Take::malformed;
  if (is_header_again()) return Take::aside;
  if (found_ == header_.size()) found_ = 0;
  const bool is_header = has_header_ && line_.text.find(header_.front() + separator_) != std::string::npos;
  if (!why.detail.empty() && !is_header && !is_live()) {
    problem_ = why;
  } else {
    leave_out(why);
  }
  return problem_ ? Take::none : Take::malformed;
}

bool HoleCounter::keeps(const std::vector<double>& value, std::size_t line) {
  std::size_t missing = 0;
  missing_.resize(value.size());
  for (std::size_t i = 0; i < value.size(); ++i) {
    const std::size_t holes = std::isnan(value[i]) ? 1 : 0;
    missing_[i] += holes;
    missing += holes;
  }
  const bool is_kept =
      holes_ == Holes::all || missing == 0 || (holes_ == Holes::some && missing < value.size());
  if (!is_kept && without_ == 0) first_without_ = line;
  ++(is_kept ? kept_ : without_);
  return is_kept;
}

std::vector<std::string> HoleCounter::notes(const std::vector<std::string>& columns) const {
  std::vector<std::string> out;
  std::vector<std::string> missing;
  for (std::size_t i = 0; i < missing_.size(); ++i) {
    if (missing_[i] > 0) missing.push_back(columns[i]);
    if (holes_ == Holes::some && missing_[i] > without_)
      out.push_back(fmt::format("{} of {} rows have no {}", missing_[i] - without_, kept_, columns[i]));
  }
  if (without_ > 0)
    out.push_back(fmt::format("{} of {} rows have no {} and were left out, the first is row {}", without_,
                              rows(), fmt::join(missing, " or "), first_without_));
  return out;
}

std::vector<std::string> TableReader::notes() const {
  std::vector<std::string> out = notes_;
  if (separator_ != ',' && layout_ == Layout::table) {
    static constexpr std::array kNames = {"semicolons", "tabs", "commas", "bars", "blanks"};
    const std::size_t kind = std::min(kSeparators.find(separator_), kNames.size() - 1);
    out.push_back(fmt::format("{} separate the columns", kNames.at(kind)));
  }
  if (!has_header_ && time_place_) out.push_back(fmt::format("{} is the time", header_[*time_place_]));
  if (!has_time()) out.push_back(fmt::format("{} rows are a second", options_.time.log_rate_hz));
  if (!title_unit_.empty())
    out.push_back(fmt::format("what states no unit is in {} by the titles", title_unit_));
  if (!left_out_.empty())
    out.push_back(fmt::format("without numbers, and left out: {}; a sensor among them is dead", left_out_));
  if (decimal_ == ',') out.push_back("commas in numbers are decimal commas");
  if (headers_ > 0) out.push_back(fmt::format("{} row(s) repeat the header", headers_));
  if (malformed_ > 0)
    out.push_back(fmt::format("{} row(s) are malformed and were left out, the first is row {}{}", malformed_,
                              first_malformed_.row, rows_.kept() > 0 ? "" : ": " + first_malformed_.detail));
  std::ranges::move(rows_.notes(columns_), std::back_inserter(out));
  return out;
}

}  // namespace flexor::recording
