#include "host/report/drawing.hpp"

#include <fmt/format.h>

#include "host/io/json.hpp"

namespace flexor::report {
namespace {

std::string path_of(const std::vector<std::pair<double, double>>& points) {
  std::string out;
  for (const auto& [x, y] : points) out += fmt::format("{}{:g},{:g}", out.empty() ? "M" : " L", x, y);
  return out;
}

}  // namespace

std::string escape_html(std::string_view text) {
  return escaped(io::to_utf8(text),
                 {{'&', "&amp;"}, {'<', "&lt;"}, {'>', "&gt;"}, {'"', "&quot;"}, {'\'', "&apos;"}});
}

void Drawing::line(const std::vector<std::pair<double, double>>& points, const std::string& colour,
                   double width) {
  body_ += fmt::format(
      "<path d=\"{}\" stroke=\"{}\" stroke-width=\"{:g}\" fill=\"none\" stroke-linejoin=\"round\"/>\n",
      path_of(points), colour, width);
}

void Drawing::area(const std::vector<std::pair<double, double>>& points, const std::string& colour) {
  body_ += fmt::format("<path d=\"{} Z\" fill=\"{}\"/>\n", path_of(points), colour);
}

void Drawing::box(double x, double y, double width, double height, const std::string& colour,
                  const std::string& fill) {
  body_ += fmt::format(
      "<rect x=\"{:g}\" y=\"{:g}\" width=\"{:g}\" height=\"{:g}\" rx=\"3\" fill=\"{}\" stroke=\"{}\" "
      "stroke-width=\"2\"/>\n",
      x, y, width, height, fill, colour);
}

void Drawing::dot(double x, double y, double radius, const std::string& fill, const std::string& colour) {
  body_ += fmt::format(
      "<circle cx=\"{:g}\" cy=\"{:g}\" r=\"{:g}\" fill=\"{}\" stroke=\"{}\" stroke-width=\"2\"/>\n", x, y,
      radius, fill, colour);
}

void Drawing::text(double x, double y, const std::string& words, const char* anchor,
                   const std::string& colour, int size) {
  body_ +=
      fmt::format("<text x=\"{:g}\" y=\"{:g}\" text-anchor=\"{}\" fill=\"{}\" font-size=\"{}\">{}</text>\n",
                  x, y, anchor, colour, size, escape_html(words));
}

std::string Drawing::svg(const Figure& figure, int width, int height) const {
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" "
      "font-family=\"sans-serif\" role=\"img\" aria-labelledby=\"{2}_title\" aria-describedby=\"{2}_desc\">\n"
      "<title id=\"{2}_title\">{3}</title><desc id=\"{2}_desc\">{4}</desc>\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"#ffffff\"/>\n{5}</svg>\n",
      width, height, escape_html(figure.name), escape_html(figure.title), escape_html(figure.caption), body_);
}

}  // namespace flexor::report
