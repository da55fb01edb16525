// One page for all reports: blocks of plain text, tables and figures, put into one template with one style.
//
// Texts are plain, and are escaped here. Order, headings and names are such that a screen reader reads what an
// eye sees; the style is for a phone first, light or dark as the reader's machine is.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "host/report/drawing.hpp"
#include "host/report/saved.hpp"

namespace flexor::report {

struct Card {
  std::string value;
  std::string label;
  bool plain = false;  // a baseline or a count, not the result
};

struct TableBlock {
  std::string caption;
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;  // the first cell names the row
  std::vector<std::size_t> marked = {};        // rows that stand out
  bool is_text = false;                        // words, no figures
};

// Of a table whose rows are JSON objects.
struct Column {
  std::string title;
  std::function<std::string(const Json& row)> cell;
  // The member at `path`, "/holdout/rmse_deg": a number by `format`, a text as it is; "-" where there is none.
  Column(std::string name, const std::string& path, const char* format = "{}");
  Column(std::string name, std::function<std::string(const Json&)> of)
      : title(std::move(name)), cell(std::move(of)) {}
};
// A row for each of `rows`; of an object the first column is called `title` and has its keys. A column in which no row has
// anything is left out. Marked: where `chosen` is true.
TableBlock table_of(const std::string& caption, const Json& rows, const std::vector<Column>& columns,
                    const std::string& title = "");

// Every figure of some scores (score::Score), each under its name; null: there is none.
TableBlock scores_table(const std::string& caption, const std::vector<std::pair<std::string, Json>>& scores);

// Of a report's own pages, which lie in one folder.
struct Link {
  std::string file;  // a name that the program chose, never a text from a log
  std::string label;
};

class Page {
 public:
  explicit Page(std::string title) : title_(std::move(title)) {}

  void heading(const std::string& text);
  void paragraph(const std::string& text);
  void good(const std::string& text);  // all is well
  void warnings(const std::vector<std::string>& lines);
  void cards(const std::vector<Card>& cards);
  void table(const TableBlock& table);
  void steps(const std::vector<std::string>& lines);  // numbered
  // A list of its own; `name` is what a screen reader calls it.
  void links(const std::string& name, const std::vector<Link>& links);
  // Figures that follow one another stand side by side where there is room.
  void chart(Chart chart);
  void drawing(const Figure& figure, const std::string& svg);
  void picture(const Figure& figure, std::string_view jpeg);
  // What follows until end_details() opens on a click.
  void begin_details(const std::string& summary);
  void end_details() { add("</details>\n"); }

  std::string html() const;
  // Its headings, paragraphs, cards, steps and tables for a terminal of 80 columns.
  const std::string& text() const { return text_; }
  // With the field's words and the version at its end; and its drawings and charts as files of their own where the reader wants them.
  void write(const Saved& saved, const std::string& file = "report.html");

 private:
  void add(const std::string& html);  // after the figures before it
  void add_figure(const Figure& figure, const std::string& html);

  std::string title_;
  std::string body_;
  std::string text_;
  bool has_figures_ = false;  // at its end, which others may join
  std::vector<Chart> charts_;
  std::vector<std::pair<std::string, std::string>> drawings_;  // name, SVG
};

}  // namespace flexor::report
