#include <algorithm>
#include <array>
#include <cmath>

#include "host/io/io.hpp"
#include "host/report/kinds.hpp"

namespace flexor::report {
namespace {

constexpr std::size_t kMostRows = 4000;
constexpr std::array<const char*, 4> kQuality = {"good", "doubtful", "hidden", "lost"};
constexpr std::array<const char*, 7> kAngleColours = {"#0072B2", "#E69F00", "#009E73", "#CC79A7",
                                                      "#D55E00", "#56B4E9", "#999933"};

// Every so many rows: an hour takes no longer than a minute. What is lost has no place; what is not good is grey.
Chart angles_chart(const Saved& saved) {
  const Json& r = saved.results();
  const Columns table = saved.columns("angles.csv");
  const std::size_t rows = table.at("t_s").size();
  const std::size_t step = 1 + rows / kMostRows;
  const auto every = [&](const std::string& column, auto&& change) {
    std::vector<double> out;
    for (std::size_t i = 0; i < rows; i += step) out.push_back(change(i, table.at(column)[i]));
    return out;
  };
  const std::vector<double> t_s = every("t_s", [](std::size_t, double v) { return v; });
  Chart chart{
      {"angles", "Over time", "Coloured: good. Grey: unsure, and two standard errors on either side.", true},
      "time (s)",
      {}};
  chart.panel_px = 150;
  for (const auto& angle : r.at("angles").items()) {
    const std::string& name = angle.key();
    const auto& quality = table.at(name + "_quality");
    const auto& error = table.at(name + "_se_deg");
    const auto known = [&](double errors, double worst_quality) {
      return every(name + "_deg", [&, errors, worst_quality](std::size_t i, double v) {
        return quality[i] <= worst_quality ? v + errors * error[i] : NAN;
      });
    };
    const char* colour = kAngleColours[chart.panels.size() % kAngleColours.size()];
    chart.panels.push_back({name + " (deg)",
                            {{"", "#999999", t_s, known(-2, 2), Style::line, 0.6},
                             {"", "#999999", t_s, known(2, 2), Style::line, 0.6},
                             {"", "#999999", t_s, known(0, 2), Style::line, 1},
                             {"", colour, t_s, known(0, 0), Style::line, 2}}});
  }
  return chart;
}

void unsure_table(Page& page, const Json& r) {
  page.heading("Where it is unsure");
  if (r.at("unsure").empty()) return page.good("Nowhere.");
  page.table(table_of(
      "Unsure stretches", r.at("unsure"),
      {{"from", "/from_s", "{:.3f} s"},
       {"to", "/to_s", "{:.3f} s"},
       {"frames", "/frames"},
       {"at worst", [](const Json& u) { return kQuality.at(u.at("quality").get<std::size_t>()); }}}));
  const auto all = r.at("unsure_stretches").get<std::size_t>();
  const std::size_t shown = r.at("unsure").size();
  if (all > shown) page.paragraph(fmt::format("And {} more.", all - shown));
}

}  // namespace

void summarize_tracking(Page& page, const Json& r) {
  const auto frames = r.at("frames").get<double>();
  double error_deg = 0;
  for (const Json& angle : r.at("angles"))
    error_deg = std::max(error_deg, number_or_nan(angle.at("standard_error_deg")));
  page.cards({{fmt::format("{:.1f} %", frames > 0 ? 100 * r.at("frames_labelled").get<double>() / frames : 0),
               fmt::format("of {:.0f} frames show every mark", frames)},
              {fmt::format("{:.2f}°", error_deg), "standard error of the least certain angle, on average"},
              {fmt::format("{}", r.at("unsure_stretches").get<std::size_t>()),
               "stretches in which some angle is unsure", true},
              {fmt::format("{}", r.at("frames_dropped").get<std::size_t>()),
               "frames missing by the video's own clock", true}});
  const auto warnings = r.at("warnings").get<std::vector<std::string>>();
  if (!warnings.empty()) page.warnings(warnings);
  page.heading("Each angle");
  page.table(table_of("Range, error and quality of each angle", r.at("angles"),
                      {{"from", "/min_deg", "{:.1f}°"},
                       {"to", "/max_deg", "{:.1f}°"},
                       {"standard error", "/standard_error_deg", "{:.2f}°"},
                       {"good", "/frames_good"},
                       {"doubtful", "/frames_doubtful"},
                       {"hidden", "/frames_hidden"},
                       {"lost", "/frames_lost"}},
                      "angle"));
  page.paragraph(fmt::format(
      "{} x {} pixels, {:.3f} to {:.3f} s, tracked at {:.0f} frames a second, decoding and drawing left out.",
      r.at("width").get<int>(), r.at("height").get<int>(), r.at("from_s").get<double>(),
      r.at("to_s").get<double>(), frames / std::max(1e-9, r.at("tracking_s").get<double>())));
}

void render_tracking(const Saved& saved) {
  const Json& r = saved.results();
  Page page("Angles from " + std::filesystem::path(saved.text("video")).filename().string());
  summarize_tracking(page, r);
  page.paragraph(fmt::format(
      "Good: every mark measured. Doubtful: measured, but marks touch, a bone has an odd length or the joint "
      "is outside its range. Hidden: a mark was not to be seen for at most {} frames; the angle comes from "
      "the motion before and after. Lost: not known, the last value is repeated.",
      r.at("most_hidden_frames").get<int>()));
  page.chart(angles_chart(saved));
  if (std::filesystem::exists(saved.folder() / "frame.jpg"))
    page.picture(
        {"frame", "One frame", "Marks, bones and angles as they were found, drawn over the picture."},
        saved.read("frame.jpg"));
  unsure_table(page, r);
  const auto lens = saved.text("lens");
  page.paragraph(fmt::format("Joint file {}, {}.", saved.text("joints"),
                             lens.empty() ? "no lens calibration" : "lens " + lens));
  page.write(saved);
}

}  // namespace flexor::report
