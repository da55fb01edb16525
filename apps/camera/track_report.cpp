#include "apps/camera/track_report.hpp"

#include <array>
#include <cmath>

#include "host/camera/video.hpp"
#include "host/io/io.hpp"
#include "host/report/gnuplot.hpp"
#include "host/report/html.hpp"

namespace flexor::filming {

using namespace report;
namespace {

constexpr std::size_t kMostPoints = 4000;
constexpr std::array<const char*, 4> kQuality = {"good", "doubtful", "hidden", "lost"};
constexpr std::array<const char*, 7> kColours = {"#0072B2", "#E69F00", "#009E73", "#CC79A7",
                                                 "#D55E00", "#56B4E9", "#8a8a00"};

std::string base64(std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    unsigned v = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      v = v << 8U | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    }
    for (unsigned k = 0; k < 4; ++k) out += i + k > bytes.size() ? '=' : kDigits[v >> (18 - 6 * k) & 63U];
  }
  return out;
}

// Every so many rows, so that an hour is drawn as quickly as a minute.
std::string draw(const Tracked& r, const std::filesystem::path& csv) {
  Gnuplot g;
  const std::string file = g.data_file(csv);
  const std::size_t n = r.summary.angles.size();
  g.begin("angles", 120 + 130 * static_cast<int>(n) + 90);
  const std::size_t every = 1 + r.summary.frames / kMostPoints;
  g.add("set datafile separator ','");
  g.add("set multiplot layout {},1 margins 0.11,0.97,0.06,0.97 spacing 0,0.025", n + 1);
  g.add("set xrange [{}:{}]; set key off; set format x ''", r.summary.from_s,
        std::max(r.summary.to_s, r.summary.from_s + 0.1));
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t column = 2 + 3 * k;
    g.add("set ylabel {} noenhanced; set label 1 'deg' at graph 0.005,0.92 tc rgb '#888888'",
          gnuplot_text(r.summary.angles[k].name));
    // Three or four labels on the axis, whatever the range.
    const double range = std::max(1.0, r.summary.angles[k].max_deg - r.summary.angles[k].min_deg);
    const double decade = std::pow(10, std::floor(std::log10(range)));
    g.add("set ytics {}", decade * (range / decade > 5 ? 2.5 : range / decade > 2 ? 1.0 : 0.5));
    // What is lost has no place; what is not good is grey.
    g.add(
        "plot {0} every {1} using 1:(${4}<3?${2}-2*${3}:1/0):(${4}<3?${2}+2*${3}:1/0) with filledcurves lc "
        "rgb "
        "'#cccccc' fs transparent solid 0.5, '' every {1} using 1:(${4}<3?${2}:1/0) with lines lw 1 lc rgb "
        "'#999999', "
        "'' every {1} using 1:(${4}==0?${2}:1/0) with lines lw 2 lc rgb '{5}'",
        file, every, column, column + 1, column + 2, kColours[k % kColours.size()]);
  }
  g.add("set format x '%g'; set xlabel 'time, s'; set yrange [-0.3:3.3]; unset label 1");
  g.add("set ytics ('good' 0, 'doubtful' 1, 'hidden' 2, 'lost' 3); set ylabel 'worst'");
  std::string worst = "0";
  for (std::size_t k = 0; k < n; ++k) worst = fmt::format("max({},${})", worst, 4 + 3 * k);
  g.add("max(a,b) = a > b ? a : b");
  g.add("plot {} every {} using 1:({}) with steps lw 2 lc rgb '#D55E00'", file, every, worst);
  g.add("unset multiplot");
  g.run();
  return g.svg("angles");
}

void add_summary(Page& page, const Tracked& r) {
  const camera::Summary& s = r.summary;
  const double share =
      s.frames > 0 ? 100.0 * static_cast<double>(s.labelled) / static_cast<double>(s.frames) : 0;
  page.add("<div class='cards'>");
  page.add("<div class='card'><b>{:.1f} %</b>of {} frames show every mark</div>", share, s.frames);
  double se = 0;
  for (const camera::AngleSummary& a : s.angles) se = std::max(se, a.mean_se_deg);
  page.add("<div class='card'><b>{:.2f} deg</b>standard error of the least certain angle, on average</div>",
           se);
  page.add("<div class='card plain'><b>{}</b>stretch(es) in which some angle is unsure</div>",
           s.unsure_stretches);
  page.add("<div class='card plain'><b>{}</b>frame(s) missing by the video's own clock</div></div>",
           s.dropped);
  if (!r.warnings.empty()) {
    page.add("<div class='warnings'>");
    for (const std::string& w : r.warnings) page.add("<p>{}</p>", escape(w));
    page.add("</div>");
  }
}

void add_tables(Page& page, const camera::Summary& s) {
  page.add(
      "<h2>Each angle</h2><div class='scroll'><table><tr><th>angle</th><th>from</th><th>to</th><th>standard "
      "error</th><th>good</th><th>doubtful</th><th>hidden</th><th>lost</th></tr>");
  for (const camera::AngleSummary& a : s.angles) {
    page.add(
        "<tr><td>{}</td><td>{:.1f} deg</td><td>{:.1f} deg</td><td>{:.2f} deg</td><td>{}</td><td>{}</td><td>{}"
        "</td><td>{}</td></tr>",
        escape(a.name), a.min_deg, a.max_deg, a.mean_se_deg, a.frames[0], a.frames[1], a.frames[2],
        a.frames[3]);
  }
  page.add(
      "</table></div><p>Good: every mark measured. Doubtful: measured, but marks touch, a bone has an odd "
      "length or "
      "the joint is outside its range. Hidden: a mark was not to be seen for at most {} frames; the angle "
      "comes "
      "from the motion before and after. Lost: not known, the last value is repeated.</p>",
      camera::kMaxHidden);
  page.add("<h2>Where it is unsure</h2>");
  if (s.unsure.empty()) {
    page.add("<p class='good'>Nowhere.</p>");
    return;
  }
  page.add("<div class='scroll'><table><tr><th>from</th><th>to</th><th>frames</th><th>at worst</th></tr>");
  for (const camera::Unsure& u : s.unsure) {
    page.add("<tr><td>{:.3f} s</td><td>{:.3f} s</td><td>{}</td><td>{}</td></tr>", u.from_s, u.to_s, u.frames,
             kQuality[static_cast<std::size_t>(u.worst)]);
  }
  page.add("</table></div>");
  if (s.unsure_stretches > s.unsure.size()) {
    page.add("<p>and {} more.</p>", s.unsure_stretches - s.unsure.size());
  }
}

}  // namespace

void write_track_report(const Tracked& r, const TrackRequest& request, const std::filesystem::path& csv,
                        const camera::Picture& labelled, const std::filesystem::path& folder) {
  const std::string figure = draw(r, csv);
  io::make_folder(folder);
  io::write_file(folder / "angles.svg", figure);
  Page page;
  page.add(
      "<!doctype html><html lang='en'><head><meta charset='utf-8'><title>{0}</title><meta name='viewport' "
      "content='width=device-width'><style>{1}</style></head><body><h1>Angles from {0}</h1>",
      escape(request.video.filename().string()), kStyle);
  add_summary(page, r);
  page.add(
      "<h2>Over time</h2><figure>{}<figcaption>Coloured: good. Grey: unsure. The band is two standard errors "
      "wide on "
      "either side. Below: the worst quality of any angle.</figcaption></figure>",
      figure);
  if (!labelled.empty()) {
    camera::write_picture(folder / "frame.jpg", labelled);
    page.add(
        "<h2>One frame</h2><figure><img alt='marks, bones and angles drawn over a frame' style='width:100%' "
        "src='data:image/jpeg;base64,{}'></figure>",
        base64(io::read_file(folder / "frame.jpg")));
  }
  add_tables(page, r.summary);
  page.add(
      "<p>{} x {} pixels, {} frames from {:.3f} to {:.3f} s. Tracked at {:.0f} frames a second, decoding and "
      "drawing "
      "left out. Joint file {}, {}. flexor {}</p></body></html>",
      r.width, r.height, r.summary.frames, r.summary.from_s, r.summary.to_s,
      static_cast<double>(r.summary.frames) / std::max(1e-9, r.tracking_s), escape(request.joints.string()),
      request.lens.empty() ? std::string("no lens calibration") : "lens " + escape(request.lens.string()),
      FLEXOR_VERSION);
  io::write_file(folder / "report.html", page.text());
}

}  // namespace flexor::filming
