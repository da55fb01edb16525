// Figures by gnuplot, from C++ data.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <string>

#include "host/deploy/process.hpp"
#include "host/io/io.hpp"

namespace flexor::experiment {

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
    add("set output '{}'", (folder_.path() / name).string());
    add("set grid lc rgb '#dddddd'; set border 3 lc rgb '#666666'; set tics nomirror; set key above");
  }

  // A named block of rows; each call of `row` gives one line, empty lines break the curve.
  void data(const std::string& name, std::size_t rows, const std::function<std::string(std::size_t)>& row) {
    add("${} << EOD", name);
    for (std::size_t i = 0; i < rows; ++i) add("{}", row(i));
    add("EOD");
  }

  void run() const {
    const std::filesystem::path script = folder_.path() / "script";
    io::write_file(script, {script_.data(), script_.size()});
    deploy::ProcessResult result{.status = 1, .out = "no such program", .err = ""};
    if (!deploy::find_program("gnuplot").empty()) result = deploy::run_process({"gnuplot", script.string()});
    if (result.status == 0) return;
    std::string reason = result.err + result.out;
    std::ranges::replace(reason, '\n', ' ');
    throw io::JobError(fmt::format(
        "gnuplot could not draw the figures (is it installed? script/bootstrap): {}", reason.substr(0, 200)));
  }

  std::string bytes(const std::string& name) const { return io::read_file(folder_.path() / name); }

  std::string svg(const std::string& name) const {
    const std::string text = bytes(name);
    return text.substr(text.find("<svg"));
  }

 private:
  io::TemporaryFolder folder_;
  fmt::memory_buffer script_;
};

}  // namespace flexor::experiment
