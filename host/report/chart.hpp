// Curves and points over one axis, panel below panel. A page draws them in the reader's browser (chart.mjs), where they can be zoomed;
// gnuplot draws the same description as files of their own.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace flexor::report {

struct Figure {
  std::string name;  // file name without its ending
  std::string title;
  std::string caption;
  bool wide = false;  // as wide as the page
};

enum class Style { line, points, steps, intervals };

// Points in any order; NaN breaks a line.
struct Series {
  std::string name;  // empty: not in the key
  std::string colour;
  std::vector<double> x;
  std::vector<double> y;
  Style style = Style::line;
  double width = 1.5;
  bool dashed = false;
};

// A vertical line at each place that has an interval.
Series intervals(const std::string& colour, const std::vector<double>& x, const std::vector<double>& low,
                 const std::vector<double>& high);

struct Panel {
  std::string label;
  std::vector<Series> series;
  double least = std::numeric_limits<double>::quiet_NaN();
  double most = std::numeric_limits<double>::quiet_NaN();
  bool is_logarithmic = false;
};

struct Chart {
  Figure figure;
  std::string x_label;
  std::vector<Panel> panels;
  std::vector<std::pair<double, double>> shaded = {};  // stretches of x
  std::vector<std::string> x_names = {};               // of x = 0, 1, ...
  int panel_px = 200;
};

// For chart.mjs. Texts are the user's: no `<` stays in them.
std::string to_json(const Chart& chart);

// The same text with some letters written as they have to be where it goes.
std::string escaped(std::string_view text, std::initializer_list<std::pair<char, std::string_view>> letters);

// Any text as a text of gnuplot's: in single quotes it reads nothing into it but its end, which a doubled
// quote is not. A line break would end the command, and bytes that are not UTF-8 would make the figure no
// XML; both are shown as a space and a question mark. Goes with `noenhanced`, so that _ and ^ are shown.
std::string gnuplot_text(std::string_view text);

// NAME.svg and NAME.pdf of each chart, on white paper. Throws io::InputError where gnuplot is missing or fails.
void draw_files(const std::vector<Chart>& charts, const std::filesystem::path& folder);

}  // namespace flexor::report
