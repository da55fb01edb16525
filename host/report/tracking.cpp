#include <algorithm>
#include <array>
#include <cmath>

#include "host/io/io.hpp"
#include "host/report/jobs.hpp"
#include "host/report/page.hpp"

namespace flexor::report {
namespace {

constexpr std::size_t kMostRows = 4000;
constexpr std::array<const char*, 4> kQuality = {"good", "doubtful", "hidden", "lost"};
constexpr std::array<const char*, 7> kAngleColours = {"#0072B2", "#E69F00", "#009E73", "#CC79A7",
                                                      "#D55E00", "#56B4E9", "#999933"};

// Three or four labels on the axis, whatever the range.
double tic_step(double range) {
  const double decade = std::pow(10, std::floor(std::log10(range)));
  return decade * (range / decade > 5 ? 2.5 : range / decade > 2 ? 1.0 : 0.5);
}

// The CSV is drawn as it is, every so many rows: an hour takes no longer than a minute.
void angles(Gnuplot& g, const Saved& saved) {
  const Json& r = saved.results();
  const std::string file = g.data_file(saved.folder() / "angles.csv");
  const std::size_t n = r.at("angles").size();
  g.begin("angles", 120 + 120 * static_cast<int>(n) + 90);
  const std::size_t every = 1 + r.at("frames").get<std::size_t>() / kMostRows;
  const double from_s = r.at("from_s").get<double>();
  g.add("set datafile separator ','");
  g.add("set multiplot layout {},1 margins 0.17,0.97,{:.3f},0.98 spacing 0,0.025", n + 1,
        50.0 / (210 + 120 * static_cast<double>(n)));
  g.add("set xrange [{}:{}]; set key off; set format x ''", from_s,
        std::max(r.at("to_s").get<double>(), from_s + 0.1));
  std::size_t k = 0;
  for (const auto& angle : r.at("angles").items()) {
    const std::size_t column = 2 + 3 * k;
    g.add("set ylabel {} noenhanced; set label 1 'deg' at graph 0.005,0.92 tc rgb '#888888'",
          gnuplot_text(angle.key()));
    g.add("set ytics {}", tic_step(std::max(1.0, angle.value().at("max_deg").get<double>() -
                                                     angle.value().at("min_deg").get<double>())));
    // What is lost has no place; what is not good is grey.
    g.add(
        "plot {0} every {1} using 1:(${4}<3?${2}-2*${3}:1/0):(${4}<3?${2}+2*${3}:1/0) with filledcurves lc "
        "rgb '#cccccc' fs transparent solid 0.5, '' every {1} using 1:(${4}<3?${2}:1/0) with lines lw 1 lc "
        "rgb "
        "'#999999', '' every {1} using 1:(${4}==0?${2}:1/0) with lines lw 2 lc rgb '{5}'",
        file, every, column, column + 1, column + 2, kAngleColours[k % kAngleColours.size()]);
    ++k;
  }
  g.add("set format x '%g'; set xlabel 'time (s)'; set yrange [-0.3:3.3]; unset label 1");
  g.add("set ytics ('good' 0, 'doubtful' 1, 'hidden' 2, 'lost' 3); set ylabel 'worst'");
  std::string worst = "0";
  for (std::size_t i = 0; i < n; ++i) worst = fmt::format("max({},${})", worst, 4 + 3 * i);
  g.add("max(a,b) = a > b ? a : b");
  g.add("plot {} every {} using 1:({}) with steps lw 2 lc rgb '#D55E00'", file, every, worst);
  g.add("unset multiplot");
}

void frame_summary(Page& page, const Json& r) {
  const auto frames = r.at("frames").get<double>();
  double error_deg = 0;
  for (const auto& angle : r.at("angles").items())
    error_deg = std::max(error_deg, number_or_nan(angle.value().at("standard_error_deg")));
  page.cards({{fmt::format("{:.1f} %", frames > 0 ? 100 * r.at("frames_labelled").get<double>() / frames : 0),
               fmt::format("of {:.0f} frames show every mark", frames)},
              {fmt::format("{:.2f}°", error_deg), "standard error of the least certain angle, on average"},
              {fmt::format("{}", r.at("unsure_stretches").get<std::size_t>()),
               "stretch(es) in which some angle is unsure", true},
              {fmt::format("{}", r.at("frames_dropped").get<std::size_t>()),
               "frame(s) missing by the video's own clock", true}});
  const auto warnings = r.at("warnings").get<std::vector<std::string>>();
  if (!warnings.empty()) page.warnings(warnings);
}

void angle_table(Page& page, const Json& r) {
  TableBlock t{"Range, error and quality of each angle",
               {"angle", "from", "to", "standard error", "good", "doubtful", "hidden", "lost"},
               {},
               {}};
  for (const auto& [name, a] : r.at("angles").items()) {
    std::vector<std::string> row = {name, fmt::format("{:.1f}°", a.at("min_deg").get<double>()),
                                    fmt::format("{:.1f}°", a.at("max_deg").get<double>()),
                                    fmt::format("{:.2f}°", a.at("standard_error_deg").get<double>())};
    for (const char* quality : kQuality)
      row.push_back(fmt::format("{}", a.at(fmt::format("frames_{}", quality)).get<std::size_t>()));
    t.rows.push_back(std::move(row));
  }
  page.heading("Each angle");
  page.table(t);
  page.paragraph(fmt::format(
      "Good: every mark measured. Doubtful: measured, but marks touch, a bone has an odd length or the joint "
      "is "
      "outside its range. Hidden: a mark was not to be seen for at most {} frames; the angle comes from the "
      "motion before and after. Lost: not known, the last value is repeated.",
      r.at("most_hidden_frames").get<int>()));
}

void unsure_table(Page& page, const Json& r) {
  page.heading("Where it is unsure");
  if (r.at("unsure").empty()) {
    page.good("Nowhere.");
    return;
  }
  TableBlock t{"Unsure stretches", {"from", "to", "frames", "at worst"}, {}, {}};
  for (const Json& u : r.at("unsure")) {
    t.rows.push_back({fmt::format("{:.3f} s", u.at("from_s").get<double>()),
                      fmt::format("{:.3f} s", u.at("to_s").get<double>()),
                      fmt::format("{}", u.at("frames").get<std::size_t>()),
                      kQuality.at(u.at("quality").get<std::size_t>())});
  }
  page.table(t);
  const auto all = r.at("unsure_stretches").get<std::size_t>();
  if (all > t.rows.size()) page.paragraph(fmt::format("And {} more.", all - t.rows.size()));
}

}  // namespace

void render_tracking(const Saved& saved) {
  const Json& r = saved.results();
  Gnuplot g;
  angles(g, saved);
  g.run();
  Page page("Angles from " + std::filesystem::path(saved.text("video")).filename().string());
  frame_summary(page, r);
  const Figure figure{
      "angles", "Over time",
      "Coloured: good. Grey: unsure. The band is two standard errors wide on either side. Below: the worst "
      "quality of any angle."};
  page.figure(figure, g, saved.folder());
  const auto frame = saved.folder() / "frame.jpg";
  if (std::filesystem::exists(frame)) {
    page.picture(
        {"frame", "One frame", "Marks, bones and angles as they were found, drawn over the picture."},
        io::read_file(frame));
  }
  angle_table(page, r);
  unsure_table(page, r);
  const auto lens = saved.text("lens");
  page.paragraph(fmt::format(
      "{} x {} pixels, {} frames from {:.3f} to {:.3f} s. Tracked at {:.0f} frames a second, decoding and "
      "drawing left out. "
      "Joint file {}, {}. flexor {}.",
      r.at("width").get<int>(), r.at("height").get<int>(), r.at("frames").get<std::size_t>(),
      r.at("from_s").get<double>(), r.at("to_s").get<double>(),
      r.at("frames").get<double>() / std::max(1e-9, r.at("tracking_s").get<double>()), saved.text("joints"),
      lens.empty() ? "no lens calibration" : "lens " + lens, saved.text("version")));
  io::write_file(saved.folder() / "report.html", page.html());
}

}  // namespace flexor::report
