// One page for all reports: blocks of plain text, tables and figures, put into one template with one style.
//
// Texts are plain, and are escaped here. Order, headings and names are such that a screen reader reads what an
// eye sees; the style is for a phone first, light or dark as the reader's machine is.
#pragma once

#include <fmt/format.h>

#include <string>
#include <string_view>
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
  void end_details();

  std::string html() const;
  // With the field's words and the version at its end; and its drawings and charts as files of their own where the reader wants them.
  void write(const Saved& saved, const std::string& file = "report.html");

 private:
  void add(const std::string& html);  // after the figures before it
  void add_figure(const Figure& figure, const std::string& html);

  std::string title_;
  std::string body_;
  bool has_figures_ = false;  // at its end, which others may join
  std::vector<Chart> charts_;
  std::vector<std::pair<std::string, std::string>> drawings_;  // name, SVG
};

}  // namespace flexor::report
