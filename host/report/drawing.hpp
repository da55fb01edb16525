// A picture of lines, boxes and words as SVG. A page's style gives its neutral colours the page's own.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "host/report/chart.hpp"

namespace flexor::report {

inline constexpr const char* kInk = "#222222";
inline constexpr const char* kFaint = "#999999";
inline constexpr const char* kPaper = "#ffffff";
inline constexpr const char* kShade = "#eeeeee";

// & < > " ' as HTML and XML want them; bytes that are not UTF-8 as question marks.
std::string escape_html(std::string_view text);

class Drawing {
 public:
  void line(const std::vector<std::pair<double, double>>& points, const std::string& colour = kInk,
            double width = 2);
  void area(const std::vector<std::pair<double, double>>& points, const std::string& colour);
  void box(double x, double y, double width, double height, const std::string& colour = kInk,
           const std::string& fill = kPaper);
  void dot(double x, double y, double radius, const std::string& fill, const std::string& colour);
  void text(double x, double y, const std::string& words, const char* anchor = "middle",
            const std::string& colour = kInk, int size = 14);
  // The title and the caption are its name and description.
  std::string svg(const Figure& figure, int width, int height) const;

 private:
  std::string body_;
};

}  // namespace flexor::report
