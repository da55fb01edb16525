// Figures by gnuplot, from C++ data.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include "host/io/json.hpp"
#include "host/io/process.hpp"

namespace flexor::report {

// Any text as a text of gnuplot's: in single quotes it reads nothing into it but its end, which a doubled
// quote is not. A line break would end the command, and bytes that are not UTF-8 would make the figure no
// XML; both are shown as a space and a question mark. Goes with `noenhanced`, so that _ and ^ are shown.
inline std::string gnuplot_text(std::string_view text) {
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

// The same for the label of a tic, which gnuplot takes for a format.
inline std::string gnuplot_tic(std::string_view text) {
  std::string out;
  for (const char c : text) out += c == '%' ? std::string("%%") : std::string(1, c);
  return gnuplot_text(out);
}

// One gnuplot process draws all figures; each writes into a folder of its own that is removed at the end.
class Gnuplot {
 public:
  template <class... Args>
  void add(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(script_), format, std::forward<Args>(args)...);
    script_.push_back('\n');
  }

  // The figure's commands follow; as SVG of that many pixels, or PDF of the same shape.
  void begin(const std::string& name, int height, int width = 960, bool pdf = false) {
    add("reset");
    if (pdf) {
      add("set terminal pdfcairo size {:.2f}in,{:.2f}in font 'Helvetica,9' background '#ffffff'",
          width / 110.0, height / 110.0);
    } else {
      add("set terminal svg size {},{} dynamic font 'Helvetica,14' name 'flexor_{}' background '#ffffff'",
          width, height, name);
    }
    add("set output {}", gnuplot_text(std::filesystem::absolute(folder_.path() / name).string()));
    add("set grid lc rgb '#dddddd'; set border 3 lc rgb '#666666'; set tics nomirror; set key above");
  }

  // A named block of rows; each call of `row` gives one line, empty lines break the curve.
  void data(const std::string& name, std::size_t rows, const std::function<std::string(std::size_t)>& row) {
    add("${} << EOD", name);
    for (std::size_t i = 0; i < rows; ++i) add("{}", row(i));
    add("EOD");
  }

  // A file as gnuplot is to name it, whatever its own name: a name that begins with < would be a command.
  std::string data_file(const std::filesystem::path& path) const {
    const std::filesystem::path link = folder_.path() / "data";
    std::filesystem::create_symlink(std::filesystem::absolute(path), link);
    return gnuplot_text(std::filesystem::absolute(link).string());
  }

  void run() const {
    const std::filesystem::path script = folder_.path() / "script";
    io::write_file(script, {script_.data(), script_.size()});
    if (io::find_program("gnuplot").empty())
      throw io::JobError("gnuplot is missing, no figure can be drawn: script/bootstrap installs it");
    const io::ProcessResult result = io::run_process({"gnuplot", script.string()}, folder_.path());
    if (result.status == 0) return;
    std::string reason = result.err.empty() ? "no output" : result.err;
    std::ranges::replace(reason, '\n', ' ');
    throw io::JobError(fmt::format("gnuplot could not draw the figures: {}", reason.substr(0, 200)));
  }

  std::string bytes(const std::string& name) const {
    if (!std::filesystem::exists(folder_.path() / name))
      throw io::JobError("gnuplot could not draw the figures, and says nothing: does it run?");
    return io::read_file(folder_.path() / name);
  }

  std::string svg(const std::string& name) const {
    const std::string text = bytes(name);
    return io::to_utf8(text.substr(text.find("<svg")));  // it names the files that were plotted
  }

 private:
  io::TemporaryFolder folder_;
  fmt::memory_buffer script_;
};

}  // namespace flexor::report
