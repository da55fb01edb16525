// One page for all reports: blocks of plain text, tables and figures, put into one template with one style.
//
// Texts are plain; the template escapes them. Order, headings and names are such that a screen reader reads what an
// eye sees; the style is for a phone first, light or dark as the reader's machine is.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "host/report/gnuplot.hpp"

namespace flexor::report {

// & < > " ' as HTML and XML want them; bytes that are not UTF-8 as question marks.
std::string escape_html(std::string_view text);

struct Card {
  std::string value;
  std::string label;
  bool plain = false;  // a baseline or a count, not the result
};

struct TableBlock {
  std::string caption;
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;  // the first cell names the row
  std::vector<std::size_t> marked;             // rows that stand out
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
  void code(const std::string& text);
  // A list of its own; `name` is what a screen reader calls it.
  void links(const std::string& name, const std::vector<Link>& links);
  // Figures that follow one another stand side by side where there is room. Without `svg` the page says once that its
  // figures are missing, and why.
  void figure(const Figure& figure, const std::string& svg, const std::string& undrawn = {});
  // What `drawn` holds of that name, also as NAME.svg in `folder`.
  void figure(const Figure& figure, const Gnuplot& drawn, const std::filesystem::path& folder);
  void picture(const Figure& figure, std::string_view jpeg);
  // What follows until end_details() opens on a click.
  void begin_details(const std::string& summary);
  void end_details();

  std::string html() const;

 private:
  using Json = nlohmann::ordered_json;
  void add(const char* kind, Json content);

  std::string title_;
  Json blocks_ = Json::array();
  std::string details_;  // summary, while open
  Json inner_ = Json::array();
  bool lacks_figures_ = false;  // and says so
};

}  // namespace flexor::report
