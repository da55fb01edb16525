#include <algorithm>
#include <cmath>

#include "host/io/io.hpp"
#include "host/report/colours.hpp"
#include "host/report/jobs.hpp"
#include "host/report/page.hpp"

namespace flexor::report {
namespace {

// "0.64 (0.42 to 0.94)"; median, 5 and 95 % quantile.
std::string with_quantiles(const Json& interval, int decimals) {
  if (interval.is_null()) return "-";
  return fmt::format("{:.{}f} ({:.{}f} to {:.{}f})", interval.at("median").get<double>(), decimals,
                     interval.at("low").get<double>(), decimals, interval.at("high").get<double>(), decimals);
}

std::vector<std::string> compensators_of(const Json& r) {
  std::vector<std::string> out;
  for (const Json& h : r.at("headlines")) out.push_back(h.at("compensator").get<std::string>());
  return out;
}

const Json* ratio_to_hw(const Json& headline) {
  const Json& ratios = headline.at("mean_ratio_to");
  return ratios.contains("published-hw") ? &ratios.at("published-hw") : nullptr;
}

bool has_ratios(const Json& r) {
  return std::ranges::any_of(r.at("headlines"), [](const Json& h) { return ratio_to_hw(h) != nullptr; });
}

void ratio_figure(Gnuplot& g, const Json& r) {
  const std::vector<std::string> names = compensators_of(r);
  const std::vector<std::string> colour = colours_of(names);
  g.begin("ratios", 120 + 34 * static_cast<int>(names.size()));
  std::string tics;
  std::string plot = "plot NaN notitle";
  std::size_t row = 0;
  for (std::size_t c = 0; c < names.size(); ++c) {
    const Json* ratio = ratio_to_hw(r.at("headlines")[c]);
    if (ratio == nullptr) continue;
    tics += fmt::format("{}{} {}", row == 0 ? "" : ", ", gnuplot_tic(names[c]), row);
    g.data(fmt::format("bar{}", c), 1, [&](std::size_t) {
      return fmt::format("{} {} {} {}", ratio->at("median").get<double>(), row,
                         ratio->at("low").get<double>(), ratio->at("high").get<double>());
    });
    plot += fmt::format(", $bar{0} using 1:2:3:4 with xerrorbars pt 7 ps 1 lw 3 lc rgb '{1}' notitle", c,
                        colour[c]);
    ++row;
  }
  g.add("set logscale x; set xlabel 'error relative to published HW'; set ytics ({}) noenhanced", tics);
  g.add("set xtics (0.25, 0.5, 1, 2, 4, 8, 16); set yrange [{}:-0.6]; set lmargin 22",
        static_cast<double>(row) - 0.4);
  g.add("set arrow from 1, graph 0 to 1, graph 1 nohead lc rgb '#999999' dt 2");
  g.add("{}", plot);
}

void headline_table(Page& page, const Json& r) {
  TableBlock t{"Geometric mean over the gestures, relative to published HW",
               {"compensator", "median (5 to 95 % of laboratories)", "laboratories in which it is better"},
               {},
               {}};
  for (const Json& h : r.at("headlines")) {
    const Json* ratio = ratio_to_hw(h);
    if (ratio == nullptr) continue;
    t.rows.push_back(
        {h.at("compensator").get<std::string>(), with_quantiles(*ratio, 2),
         fmt::format("{:.0f} %",
                     100 * h.at("share_of_laboratories_below").at("published-hw").get<double>())});
  }
  page.table(t);
}

void cell_table(Page& page, const Json& r) {
  TableBlock t{"Total error in degree-seconds, median (5 to 95 % of laboratories)",
               {"gesture, compensator", "error", "published", "relative to published HW"},
               {},
               {}};
  for (const Json& cell : r.at("cells")) {
    const Json& gesture = cell.at("gesture");
    const double published = number_or_nan(cell.at("published_deg_s"));
    t.rows.push_back({fmt::format("{}, {}", gesture.is_string() ? gesture.get<std::string>() : gesture.dump(),
                                  cell.at("compensator").get<std::string>()),
                      with_quantiles(cell.at("total_error_deg_s"), 0),
                      std::isnan(published) ? "-" : fmt::format("{:.0f}", published),
                      with_quantiles(cell.value("ratio_to_published_hw", Json(nullptr)), 2)});
  }
  page.heading("Gesture by gesture");
  page.table(t);
}

void laboratory_shapes(Page& page, const Json& shapes) {
  TableBlock t{
      "What the article says of the curves", {"gesture, what", "here", "laboratories that agree"}, {}, {}};
  for (const Json& s : shapes) {
    t.rows.push_back({fmt::format("{}, {}", s.at("gesture").get<int>(), s.at("what").get<std::string>()),
                      with_quantiles(s.at("value_deg"), 1) + "°",
                      fmt::format("{:.0f} %", 100 * s.at("share_of_laboratories_that_agree").get<double>())});
  }
  if (!t.rows.empty()) page.table(t);
}

}  // namespace

void render_ensemble(const Saved& saved) {
  const Json& r = saved.results();
  Gnuplot g;
  const bool compares = has_ratios(r);  // where the published compensator took part
  if (compares) {
    ratio_figure(g, r);
    g.run();
  }
  saved.go_on();
  Page page("Glove to bionic hand, in the laboratories that the article leaves plausible");
  page.paragraph(fmt::format(
      "{} laboratories, drawn by how well they agree with the published averages of gestures 1 to 4. In "
      "each, the glove is worn and recorded once, compensators are fitted to that recording, and the "
      "gestures are played.",
      r.at("laboratories").get<std::size_t>()));
  const Json& distance = r.at("log_rms");
  page.cards({{with_quantiles(distance.at("gestures_1_to_4"), 2),
               "distance from the published table on gestures 1 to 4"},
              {with_quantiles(distance.at("gestures_5_and_6"), 2),
               "the same on gestures 5 and 6, which the draw did not use", true}});
  if (compares) {
    headline_table(page, r);
    const Figure figure{"ratios", "Compensators in all laboratories",
                        "Dots: the median. Bars: from 5 to 95 % of the laboratories. Left of the dashed line "
                        "is better than the "
                        "published Hammerstein-Wiener compensator."};
    page.figure(figure, g, saved.folder());
  }
  cell_table(page, r);
  page.heading("Shapes");
  laboratory_shapes(page, r.at("shapes"));
  const Json& chains = r.at("ensemble");
  page.paragraph(fmt::format(
      "{} Markov chains, largest R-hat {:.3f}, smallest effective sample {:.0f}, seed {}; flexor {}.",
      chains.at("chains").get<int>(), chains.at("worst_r_hat").get<double>(),
      chains.at("least_effective").get<double>(), chains.at("seed").get<std::uint64_t>(),
      saved.text("version")));
  io::write_file(saved.folder() / "report.html", page.html());
}

}  // namespace flexor::report
