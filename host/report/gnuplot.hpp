// Figures by gnuplot, from C++ data: as files of their own on white paper, and as SVG for a page, which follows the
// page's colours and says its name and content to a screen reader.
#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "host/io/io.hpp"

namespace flexor::report {

struct Figure {
  std::string name;  // file name without its ending
  std::string title;
  std::string caption;
  bool wide = false;  // as large as it is drawn: it scrolls where the page is narrower
};

// Any text as a text of gnuplot's: in single quotes it reads nothing into it but its end, which a doubled
// quote is not. A line break would end the command, and bytes that are not UTF-8 would make the figure no
// XML; both are shown as a space and a question mark. Goes with `noenhanced`, so that _ and ^ are shown.
std::string gnuplot_text(std::string_view text);

// The same for the label of a tic, which gnuplot takes for a format.
std::string gnuplot_tic(std::string_view text);

// The figure inside a page: neutral colours become the page's, ids become the figure's own, and the title and the
// caption its name and description.
std::string for_page(std::string svg, const Figure& figure);

// Why nothing can be drawn on this machine; empty: gnuplot is there.
std::string gnuplot_missing();

enum class Paper { svg, pdf };

// One gnuplot process draws all figures; each writes into a folder of its own that is removed at the end.
class Gnuplot {
 public:
  // Wide enough for a phone: the letters keep their size there, and two stand side by side elsewhere.
  static constexpr int kWidth = 520;

  explicit Gnuplot(Paper paper = Paper::svg) : paper_(paper) {}

  Paper paper() const { return paper_; }

  template <class... Args>
  void add(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(script_), format, std::forward<Args>(args)...);
    script_.push_back('\n');
  }

  // The figure's commands follow; in pixels of the SVG, and a PDF of the same shape.
  void begin(const std::string& name, int height, int width = kWidth);

  // A named block of rows; each call of `row` gives one line, empty lines break the curve.
  void data(const std::string& name, std::size_t rows, const std::function<std::string(std::size_t)>& row);

  // A file as gnuplot is to name it, whatever its own name: a name that begins with < would be a command.
  std::string data_file(const std::filesystem::path& path) const;

  // Where gnuplot is missing or fails, there are no figures: undrawn() says why.
  void run();
  const std::string& undrawn() const { return undrawn_; }

  // What was drawn, as it is; empty where nothing was.
  std::string bytes(const std::string& name) const;

  // The element alone, or nothing.
  std::string svg(const std::string& name) const;

 private:
  Paper paper_;
  io::TemporaryFolder folder_;
  fmt::memory_buffer script_;
  std::string undrawn_;
};

}  // namespace flexor::report
