#include "host/report/gnuplot.hpp"

#include <algorithm>
#include <regex>

#include "host/io/json.hpp"
#include "host/io/process.hpp"
#include "host/report/page.hpp"

namespace flexor::report {

std::string gnuplot_text(std::string_view text) {
  std::string out = "'";
  for (std::size_t i = 0; i < text.size();) {
    const auto lead = static_cast<unsigned char>(text[i]);
    const std::size_t bytes = lead < 0x80 ? 1 : lead >= 0xf0 ? 4 : lead >= 0xe0 ? 3 : 2;
    const auto continues = [](char c) { return (static_cast<unsigned char>(c) & 0xc0U) == 0x80; };
    const std::string_view tail = text.substr(i + 1, bytes - 1);
    if ((lead >= 0x80 && lead < 0xc2) || lead > 0xf4 || tail.size() + 1 < bytes ||
        !std::ranges::all_of(tail, continues)) {
      out += '?';
      ++i;
      continue;
    }
    if (lead == '\'') out += '\'';
    if (lead < 0x20 || lead == 0x7f) {
      out += ' ';
    } else {
      out += text.substr(i, bytes);
    }
    i += bytes;
  }
  return out + "'";
}

std::string gnuplot_tic(std::string_view text) {
  std::string out;
  for (const char c : text) out += c == '%' ? std::string("%%") : std::string(1, c);
  return gnuplot_text(out);
}

std::string gnuplot_missing() {
  return io::find_program("gnuplot").empty() ? "gnuplot is missing (script/bootstrap installs it)" : "";
}

void Gnuplot::begin(const std::string& name, int height, int width) {
  add("reset");
  if (paper_ == Paper::pdf) {
    constexpr double kPixelsPerInch = 110;
    add("set terminal pdfcairo size {:.2f}in,{:.2f}in font 'Helvetica,9' background '#ffffff'",
        width / kPixelsPerInch, height / kPixelsPerInch);
  } else {
    add("set terminal svg size {},{} dynamic font 'Helvetica,14' name '{}' background '#ffffff'", width,
        height, name);
  }
  add("set output {}", gnuplot_text(std::filesystem::absolute(folder_.path() / name).string()));
  add("set grid lc rgb '#dddddd'; set border 3 lc rgb '#666666'; set tics nomirror; set key above");
}

void Gnuplot::data(const std::string& name, std::size_t rows,
                   const std::function<std::string(std::size_t)>& row) {
  add("${} << EOD", name);
  for (std::size_t i = 0; i < rows; ++i) add("{}", row(i));
  add("EOD");
}

std::string Gnuplot::data_file(const std::filesystem::path& path) const {
  const std::filesystem::path link = folder_.path() / "data";
  std::filesystem::create_symlink(std::filesystem::absolute(path), link);
  return gnuplot_text(std::filesystem::absolute(link).string());
}

void Gnuplot::run() {
  const std::filesystem::path script = folder_.path() / "script";
  io::write_file(script, {script_.data(), script_.size()});
  if (undrawn_ = gnuplot_missing(); !undrawn_.empty()) return;
  // Neither the reader's own settings nor the time zone, which a PDF carries, change a figure.
  const io::ProcessResult result = io::run_process(
      {"/usr/bin/env", "TZ=UTC", "gnuplot", "--default-settings", script.string()}, folder_.path());
  if (result.status == 0) return;
  std::string reason = result.err.empty() ? "no output" : result.err;
  std::ranges::replace(reason, '\n', ' ');
  undrawn_ = fmt::format("gnuplot could not draw them: {}", io::to_utf8(reason.substr(0, 200)));
}

std::string Gnuplot::bytes(const std::string& name) const {
  if (!undrawn_.empty() || !std::filesystem::exists(folder_.path() / name)) return {};
  std::string out = io::read_file(folder_.path() / name);
  // The same data are the same bytes: an SVG names the file that was plotted, a PDF the date.
  const std::string here = std::filesystem::absolute(folder_.path()).string() + "/";
  for (auto at = out.find(here); at != std::string::npos && paper_ == Paper::svg; at = out.find(here, at))
    out.erase(at, here.size());
  constexpr std::string_view kDate = "/CreationDate (D:";
  const auto at = out.find(kDate);
  if (paper_ == Paper::pdf && at != std::string::npos) out.replace(at + kDate.size(), 14, "20000101000000");
  return out;
}

std::string Gnuplot::svg(const std::string& name) const {
  const std::string text = bytes(name);
  const auto element = text.find("<svg");
  return element == std::string::npos ? "" : io::to_utf8(text.substr(element));
}

namespace {

// gnuplot's "rgb( 34,  34,  34)", "#FFFFFF" and "black" as variables of the page's style, with the colour itself where
// the style has none of that name.
std::string with_page_colours(const std::string& svg) {
  static const std::regex kColour(R"(rgb\( *(\d+), *(\d+), *(\d+)\)|="#([0-9A-Fa-f]{6})\"|="black")");
  std::string out;
  auto from = svg.cbegin();
  for (std::sregex_iterator it(svg.begin(), svg.end(), kColour), end; it != end; ++it) {
    out.append(from, (*it)[0].first);
    from = (*it)[0].second;
    if ((*it)[1].matched) {
      const std::string hex =
          fmt::format("{:02x}{:02x}{:02x}", std::stoi((*it)[1]), std::stoi((*it)[2]), std::stoi((*it)[3]));
      out += fmt::format("var(--c{0}, #{0})", hex);
    } else {
      std::string hex = (*it)[4].matched ? (*it)[4].str() : "222222";
      std::ranges::transform(hex, hex.begin(),
                             [](char c) { return c >= 'A' && c <= 'F' ? char(c + 32) : c; });
      out += fmt::format("=\"var(--c{0}, #{0})\"", hex);
    }
  }
  return out.append(from, svg.cend());
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + by.size()))
    text.replace(at, what.size(), by);
  return text;
}

}  // namespace

std::string for_page(std::string svg, const Figure& figure) {
  for (const char* id : {"gp", "textbox", "greybox"}) {
    svg = replaced(svg, fmt::format("id='{}", id), fmt::format("id='{}_{}", figure.name, id));
    svg = replaced(svg, fmt::format("#{}", id), fmt::format("#{}_{}", figure.name, id));
  }
  svg = replaced(svg, "id=\"gnuplot_canvas\"", fmt::format("id=\"{}_canvas\"", figure.name));
  svg = with_page_colours(svg);
  const auto names_end = svg.find("</desc>") + 7;
  const auto open_end = svg.find('>') + 1;
  const std::string names =
      fmt::format("\n<title id=\"{0}_title\">{1}</title><desc id=\"{0}_desc\">{2}</desc>", figure.name,
                  escape_html(figure.title), escape_html(figure.caption));
  std::string open = svg.substr(0, open_end);
  open.insert(4, fmt::format(" role=\"img\" aria-labelledby=\"{0}_title\" aria-describedby=\"{0}_desc\"",
                             figure.name));
  return open + names + svg.substr(names_end);
}

}  // namespace flexor::report
