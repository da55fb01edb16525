#include "host/report/chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/io/process.hpp"

namespace flexor::report {
namespace {

constexpr const char* kStyles[] = {"line", "points", "steps", "intervals"};
constexpr const char* kEndings[] = {"svg", "pdf"};

// Five digits are more than a picture shows. What is not finite becomes null, here and elsewhere.
Json rounded(const std::vector<double>& values, int digits) {
  Json out = Json::array();
  for (const double v : values) out.push_back(std::stod(fmt::format("{:.{}g}", v, digits)));
  return out;
}

// A line of gnuplot's script.
template <class... Args>
void add(std::string& script, fmt::format_string<Args...> format, Args&&... args) {
  script += fmt::format(format, std::forward<Args>(args)...) + "\n";
}

// The label of a tic is a format of gnuplot's.
std::string tics(const std::vector<std::string>& names) {
  std::string out;
  for (std::size_t i = 0; i < names.size(); ++i)
    out += fmt::format("{}{} {}", i == 0 ? "" : ", ", gnuplot_text(escaped(names[i], {{'%', "%%"}})), i);
  return out;
}

std::string range(double least, double most) {
  const auto end = [](double v) { return std::isnan(v) ? std::string("*") : fmt::format("{}", v); };
  return fmt::format("[{}:{}]", end(least), end(most));
}

void begin(std::string& script, const Chart& chart, const std::filesystem::path& file) {
  const std::size_t n = chart.panels.size();
  const auto height = static_cast<double>(90 + static_cast<int>(n) * chart.panel_px);
  add(script, "reset");
  file.extension() == ".pdf"
      ? add(script, "set terminal pdfcairo size 4.7in,{:.2f}in font 'Helvetica,9' background '#ffffff'",
            height / 110)
      : add(script,
            "set terminal svg size 520,{:.0f} dynamic font 'Helvetica,14' name '{}' background '#ffffff'",
            height, chart.figure.name);
  add(script, "set output {}", gnuplot_text(std::filesystem::absolute(file).string()));
  add(script, "set grid lc rgb '#dddddd'; set border 3 lc rgb '#666666'; set tics nomirror");
  if (!chart.x_names.empty()) add(script, "set xtics ({}) noenhanced rotate by -35", tics(chart.x_names));
  const double foot = chart.x_names.empty() ? 55 : 110;
  add(script, "set multiplot layout {},1 margins 0.14,0.96,{:.3f},{:.3f} spacing 0,0.03", n, foot / height,
      1 - 40 / height);
  for (const auto& [from, to] : chart.shaded)
    add(script,
        "set object rectangle from first {:.3f}, graph 0 to first {:.3f}, graph 1 fc rgb '#e8e8e8' fs solid "
        "noborder behind",
        from, to);
}

void add_panel(std::string& script, const Panel& panel, bool is_last, const Chart& chart) {
  std::string plot;
  for (std::size_t s = 0; s < panel.series.size(); ++s) {
    const Series& series = panel.series[s];
    add(script, "$data{} << EOD", s);
    for (std::size_t i = 0; i < series.x.size(); ++i)
      add(script, "{}",
          std::isfinite(series.y[i]) ? fmt::format("{:.10g} {:.6g}", series.x[i], series.y[i]) : "");
    add(script, "EOD");
    const std::string title =
        series.name.empty() ? "notitle" : fmt::format("title {} noenhanced", gnuplot_text(series.name));
    const std::string look =
        series.style == Style::points
            ? fmt::format("points pt 7 ps {:.2f}", series.width / 5)
            : fmt::format("{} lw {}{}", series.style == Style::steps ? "histeps" : "lines", series.width,
                          series.dashed ? " dt 2" : "");
    plot += fmt::format("{}$data{} using 1:2 with {} lc rgb '{}' {}", s == 0 ? "plot " : ", ", s, look,
                        series.colour, title);
  }
  add(script, "set ylabel {} noenhanced; set yrange {}", gnuplot_text(panel.label),
      range(panel.least, panel.most));
  add(script, "{}", panel.is_logarithmic ? "set logscale y" : "unset logscale y");
  if (!is_last) add(script, "set format x ''; unset xlabel");
  if (is_last) add(script, "set format x '%g'; set xlabel {} noenhanced", gnuplot_text(chart.x_label));
  add(script, "{}",
      &panel == &chart.panels.front() ? "set key at screen 0.98,0.995 right top maxrows 2 samplen 1.5"
                                      : "unset key");
  if (!plot.empty()) add(script, "{}", plot);
}

// The same data are the same bytes: a PDF has the date.
void forget_date(const std::filesystem::path& file) {
  constexpr std::string_view kDate = "/CreationDate (D:";
  std::string bytes = io::read_file(file);
  if (const auto at = bytes.find(kDate); at != std::string::npos)
    bytes.replace(at + kDate.size(), 14, "20000101000000");
  io::write_file(file, bytes);
}

}  // namespace

Series intervals(const std::string& colour, const std::vector<double>& x, const std::vector<double>& low,
                 const std::vector<double>& high) {
  Series out{"", colour, {}, {}, Style::intervals};
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!std::isfinite(low[i]) || !std::isfinite(high[i])) continue;
    out.x.insert(out.x.end(), {x[i], x[i], x[i]});
    out.y.insert(out.y.end(), {low[i], high[i], NAN});
  }
  return out;
}

std::string to_json(const Chart& chart) {
  Json axes = Json::array();  // what several series share is written once
  std::vector<const std::vector<double>*> known;
  const auto axis_of = [&](const std::vector<double>& x) {
    const auto at = std::ranges::find_if(known, [&](const auto* k) { return *k == x; });
    const auto index = static_cast<std::size_t>(at - known.begin());
    if (at == known.end()) {
      known.push_back(&x);
      axes.push_back(rounded(x, 10));
    }
    return index;
  };
  Json panels = Json::array();
  for (const Panel& panel : chart.panels) {
    Json list = Json::array();
    for (const Series& s : panel.series) {
      list.push_back({{"name", io::to_utf8(s.name)},
                      {"colour", s.colour},
                      {"x", axis_of(s.x)},
                      {"y", rounded(s.y, 5)},
                      {"style", kStyles[static_cast<std::size_t>(s.style)]},
                      {"width", s.width},
                      {"dashed", s.dashed}});
    }
    panels.push_back({{"label", io::to_utf8(panel.label)},
                      {"least", panel.least},
                      {"most", panel.most},
                      {"log", panel.is_logarithmic},
                      {"series", std::move(list)}});
  }
  Json x_names = Json::array();
  for (const std::string& name : chart.x_names) x_names.push_back(io::to_utf8(name));
  const Json json = {{"label", io::to_utf8(chart.x_label)},
                     {"names", std::move(x_names)},
                     {"shaded", chart.shaded},
                     {"height", chart.panel_px},
                     {"axes", std::move(axes)},
                     {"panels", std::move(panels)}};
  return escaped(json.dump(), {{'<', "\\u003c"}});
}

std::string escaped(std::string_view text, std::initializer_list<std::pair<char, std::string_view>> letters) {
  std::string out;
  for (const char c : text) {
    const auto* const letter = std::ranges::find(letters, c, [](const auto& one) { return one.first; });
    out += letter == letters.end() ? std::string_view(&c, 1) : letter->second;
  }
  return out;
}

std::string gnuplot_text(std::string_view text) {
  std::string out = "'";
  for (const char c : io::to_utf8(std::string(text))) {
    if (c == '\'') out += '\'';
    const auto byte = static_cast<unsigned char>(c);
    out += byte < 0x20 || byte == 0x7f ? ' ' : c;
  }
  return out + "'";
}

void draw_files(const std::vector<Chart>& charts, const std::filesystem::path& folder) {
  if (charts.empty()) return;
  if (io::find_program("gnuplot").empty())
    throw io::InputError("gnuplot is missing (script/bootstrap installs it): it draws the files of --pdf");
  const io::TemporaryFolder drawn;
  std::string script;
  for (const Chart& chart : charts) {
    for (const char* ending : kEndings) {
      begin(script, chart, drawn.path() / (chart.figure.name + "." + ending));
      for (const Panel& panel : chart.panels) add_panel(script, panel, &panel == &chart.panels.back(), chart);
      add(script, "unset multiplot");
    }
  }
  add(script, "unset output");
  io::write_file(drawn.path() / "script", script);
  // Neither the reader's own settings nor the time zone, which a PDF carries, change a figure.
  const io::ProcessResult result = io::run_process(
      {"/usr/bin/env", "TZ=UTC", "gnuplot", "--default-settings", (drawn.path() / "script").string()},
      drawn.path());
  if (result.status != 0)
    throw io::InputError("gnuplot could not draw: " + io::to_utf8(result.err.substr(0, 200)));
  for (const Chart& chart : charts) {
    forget_date(drawn.path() / (chart.figure.name + ".pdf"));
    for (const char* ending : kEndings) {
      const std::string name = chart.figure.name + "." + ending;
      io::write_file(folder / name, io::read_file(drawn.path() / name));
    }
  }
}

}  // namespace flexor::report
