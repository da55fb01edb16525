#include "host/report/experiment_figures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "host/io/json.hpp"
#include "host/report/colours.hpp"

namespace flexor::report {
namespace {

constexpr const char* kReference = "#222222";
constexpr std::size_t kFingers = 5;

// A trace, finger by finger.
struct Trace {
  std::vector<double> t_s;
  std::vector<std::vector<double>> finger_deg;
  std::vector<std::vector<double>> hand_deg;
};

class Drawing {
 public:
  Drawing(const Saved& saved, const Experiment& experiment, Paper paper)
      : saved_(saved), experiment_(experiment), colour_(colours_of(experiment.compensators)), g_(paper) {
    for (const auto& finger : experiment.cell(0, 0).at("finger_error_deg_s").items())
      fingers_.push_back(finger.key());
  }

  void errors() {
    const std::size_t n = experiment_.compensators.size();
    const double floor = axis_floor();
    g_.begin("errors", 360 + 22 * static_cast<int>((n + 2) / 2));
    for (std::size_t c = 0; c < n; ++c) {
      g_.data(fmt::format("errors{}", c), experiment_.motions.size(), [&](std::size_t m) {
        const Json& cell = experiment_.cell(m, c);
        const double at =
            static_cast<double>(m) + (static_cast<double>(c) + 0.5) * 0.8 / static_cast<double>(n) - 0.4;
        return fmt::format("{} {} {} {}", at, mean(cell), whisker(cell, floor),
                           number_or_nan(cell.at("published_deg_s")));
      });
    }
    std::string tics;
    for (std::size_t m = 0; m < experiment_.motions.size(); ++m) {
      tics +=
          fmt::format("{}{} {}", m == 0 ? "" : ", ",
                      gnuplot_tic(io::start_of(experiment_.motions[m].at("name").get<std::string>(), 18)), m);
    }
    g_.add(
        "set logscale y; set ylabel 'total error E_T (deg s)' noenhanced; set xtics ({}) noenhanced rotate "
        "by -35",
        tics);
    g_.add("set xrange [-0.6:{}]; set key maxcols 2", static_cast<double>(experiment_.motions.size()) - 0.4);
    g_.add("set boxwidth {}; set style fill solid 0.85 noborder; set yrange [{}:*]",
           0.8 / static_cast<double>(n) * 0.92, floor);
    g_.add("{}", bars());
    done("errors", "Total error",
         "Mean over all trials, with its 95 % interval; dots: the published averages. The scale is "
         "logarithmic.");
  }

  // Trial 0 of motion m, compensator by compensator.
  void motion(std::size_t m) {
    const std::vector<Trace> traces = traces_of(m);
    for (std::size_t c = 0; c < traces.size(); ++c) {
      const Trace& t = traces[c];
      g_.data(fmt::format("run{}_{}", m, c), t.t_s.size(), [&](std::size_t k) {
        std::string row = fmt::format("{:.3f}", t.t_s[k]);
        for (std::size_t i = 0; i < fingers_.size(); ++i)
          row += fmt::format(" {:.1f} {:.1f}", t.finger_deg[i][k], t.hand_deg[i][k]);
        return row;
      });
    }
    series(m, traces, false);
    series(m, traces, true);
    postures(m);
  }

  // As SVG or PDF, in the order in which they were drawn.
  std::vector<DrawnFigure> finish() {
    g_.run();
    std::vector<DrawnFigure> out;
    for (const Figure& f : figures_) {
      DrawnFigure& drawn = out.emplace_back(DrawnFigure{f, {}, {}, g_.undrawn()});
      if (g_.paper() == Paper::pdf) {
        drawn.pdf = g_.bytes(f.name);
      } else {
        drawn.svg = g_.svg(f.name);
      }
    }
    return out;
  }

 private:
  static double mean(const Json& cell) { return cell.at("total_error_deg_s").at("mean").get<double>(); }

  void done(const std::string& name, const std::string& title, const std::string& caption) {
    figures_.push_back({name, title, caption});
  }

  std::string figure_title(std::size_t m) const {
    return (experiment_.motions.at(m).at("gesture").is_null() ? "" : "Gesture ") + experiment_.title(m);
  }

  std::string bars() const {
    const std::size_t n = experiment_.compensators.size();
    std::string plot = "plot ";
    bool any_published = false;
    for (std::size_t c = 0; c < n; ++c) {
      plot += fmt::format(
          "$errors{0} using 1:2 with boxes lc rgb '{1}' title {2} noenhanced, "
          "$errors{0} using 1:3:(0):4 with vectors nohead lc rgb '#444444' lw 1.2 notitle, ",
          c, colour_[c], gnuplot_text(experiment_.compensators[c]));
      any_published = any_published || !experiment_.cell(0, c).at("published_deg_s").is_null();
    }
    for (std::size_t c = 0; c < n; ++c) {
      plot += fmt::format("$errors{} using 1:5 with points pt 7 ps 0.6 lc rgb '#000000' {}{}", c,
                          c == 0 && any_published ? "title 'published'" : "notitle", c + 1 == n ? "" : ", ");
    }
    return plot;
  }

  // The foot of the logarithmic axis: 5 deg s, less where a bar would not be seen above that.
  double axis_floor() const {
    double floor = 5;
    for (const Json& cell : experiment_.results.at("cells")) {
      if (mean(cell) > 0) floor = std::min(floor, mean(cell) / 2);
    }
    return floor;
  }

  // Foot and height of an interval; what lies below the axis's foot is cut off, since it has no logarithm.
  static std::string whisker(const Json& cell, double floor) {
    const double half = number_or_nan(cell.at("total_error_deg_s").at("ci95"));
    if (std::isnan(half)) return "NaN NaN";
    const double foot = std::max(mean(cell) - half, floor);
    return fmt::format("{} {}", foot, mean(cell) + half - foot);
  }

  std::vector<Trace> traces_of(std::size_t m) const {
    std::vector<Trace> out;
    for (const Json& trace : experiment_.motions.at(m).at("traces")) {
      Columns columns = saved_.columns(trace.at("file").get<std::string>());
      Trace& t = out.emplace_back();
      t.t_s = columns.at("t_s");
      if (t.t_s.size() < 2 || t.t_s.size() != out.front().t_s.size()) {
        throw io::InputError(fmt::format("{}: ends after {} rows: it was cut off; run the job again",
                                         (saved_.folder() / trace.at("file").get<std::string>()).string(),
                                         t.t_s.size()));
      }
      for (const std::string& finger : fingers_) {
        t.finger_deg.push_back(columns.at(finger + "_finger_deg"));
        t.hand_deg.push_back(columns.at(finger + "_hand_deg"));
      }
    }
    return out;
  }

  // At most half a dozen numbers on the axis of a finger's errors.
  static int tic_step(const std::vector<Trace>& traces, std::size_t finger) {
    double largest = 0;
    for (const Trace& t : traces) {
      for (std::size_t k = 0; k < t.t_s.size(); ++k)
        largest = std::max(largest, std::abs(t.finger_deg[finger][k] - t.hand_deg[finger][k]));
    }
    return largest > 50 ? 40 : largest > 25 ? 20 : largest > 10 ? 10 : 5;
  }

  // Five fingers below one another: angles over the reference, or what is left between them.
  void series(std::size_t m, const std::vector<Trace>& traces, bool error) {
    const std::string name = fmt::format("{}_{}", error ? "error" : "response", m + 1);
    constexpr int kHeight = 900;
    g_.begin(name, kHeight);
    const std::size_t lines_of_key = (traces.size() + 2) / 2;  // two names in each, the finger's among them
    g_.add("set multiplot layout 5,1 margins 0.13,0.98,0.08,{} spacing 0,0.025",
           1 - (18 * static_cast<double>(lines_of_key) + 12) / kHeight);
    for (std::size_t i = 0; i < fingers_.size(); ++i) {
      g_.add("set ylabel {} offset 1,0 noenhanced; set xrange [0:{}]; set ytics {}",
             gnuplot_text(fingers_[i] + " (deg)"), experiment_.motions.at(m).at("duration_s").get<double>(),
             error ? tic_step(traces, i) : 30);
      g_.add("{}", i + 1 < fingers_.size() ? "set format x ''; unset xlabel"
                                           : "set format x '%g'; set xlabel 'time (s)'");
      g_.add("{}", i == 0
                       ? fmt::format("set key at screen 0.98,0.995 right top vertical maxrows {} samplen 1.5",
                                     lines_of_key)
                       : "unset key");
      g_.add("{}", curves(m, i, error));
    }
    g_.add("unset multiplot");
    done(name, figure_title(m) + (error ? ": error" : ": response"),
         error ? "Finger minus hand, the same trial."
               : "One trial, as the cameras saw it: the finger, and the hand with each compensator.");
  }

  std::string curves(std::size_t m, std::size_t finger, bool error) const {
    const std::size_t reference = 2 + 2 * finger;
    std::string plot =
        error ? std::string("plot 0 with lines lc rgb '#999999' notitle")
              : fmt::format("plot $run{}_0 using 1:{} with lines lw 3 lc rgb '{}' title 'finger'", m,
                            reference, kReference);
    for (std::size_t c = 0; c < experiment_.compensators.size(); ++c) {
      const std::string value =
          error ? fmt::format("(${}-${})", reference, reference + 1) : fmt::format("{}", reference + 1);
      plot += fmt::format(", $run{}_{} using 1:{} with lines lw 1.6 lc rgb '{}' title {} noenhanced", m, c,
                          value, colour_[c], gnuplot_text(experiment_.compensators[c]));
    }
    return plot;
  }

  // A hand seen a little from the side: palm below, a finger is three links in its own plane, bending towards the
  // viewer.
  void postures(std::size_t m) {
    const Json& motion = experiment_.motions.at(m);
    const Json& traces = motion.at("traces");
    const std::string name = fmt::format("posture_{}", m + 1);
    const std::size_t panels = traces.size() + 1;
    const std::size_t columns = std::min<std::size_t>(panels, 3);
    const std::size_t rows = (panels + columns - 1) / columns;
    g_.begin(name, static_cast<int>(240 * rows));
    for (std::size_t panel = 0; panel < panels; ++panel) {
      const std::vector<std::string> lines =
          hand_lines((panel == 0 ? motion : traces[panel - 1]).at("final_posture_deg"));
      g_.data(fmt::format("hand{}_{}", m, panel), lines.size(), [&](std::size_t k) { return lines[k]; });
    }
    g_.add(
        "unset border; unset tics; unset grid; unset key; set size ratio -1; set xrange [-2.1:1.7]; set "
        "yrange [-2.2:2.9]");
    g_.add("set multiplot layout {},{}", rows, columns);
    for (std::size_t panel = 0; panel < panels; ++panel) {
      g_.add("set title {} noenhanced",
             gnuplot_text(panel == 0 ? "finger (reference)" : experiment_.compensators[panel - 1]));
      g_.add(
          "plot $hand{0}_{1} index 0 using 1:2 with filledcurves closed fc rgb '#eeeeee' notitle, "
          "'' index 1 using 1:2 with lines lw 7 lc rgb '{2}' notitle, "
          "'' index 1 using 1:2 with points pt 7 ps 0.5 lc rgb '#ffffff' notitle",
          m, panel, panel == 0 ? kReference : colour_[panel - 1].c_str());
    }
    g_.add("unset multiplot");
    done(name, figure_title(m) + ": final posture",
         "The joints follow the MCP angle: PIP 3/4, DIP 2/3 of it, the thumb's IP one half.");
  }

  std::vector<std::string> hand_lines(const Json& posture_deg) const {
    constexpr double kBase[kFingers][2] = {
        {-1.25, -0.9}, {-0.9, 0.75}, {-0.3, 0.95}, {0.3, 0.85}, {0.85, 0.55}};
    constexpr double kLinks[kFingers][3] = {
        {0.75, 0.6, 0}, {0.95, 0.6, 0.45}, {1.05, 0.7, 0.45}, {0.95, 0.65, 0.45}, {0.7, 0.45, 0.4}};
    constexpr double kAway_deg[kFingers] = {55, 8, 2, -4, -11};  // from straight up, to the left
    std::vector<std::string> lines = {"-1.1 -2.1", "-1.25 -0.9", "-0.9 0.75", "-0.3 0.95", "0.3 0.85",
                                      "0.85 0.55", "0.95 -0.6",  "0.7 -2.1",  "",          ""};
    for (std::size_t i = 0; i < kFingers; ++i) {
      const auto joints_deg = posture_deg.at(fingers_[i]).get<std::array<double, 3>>();
      const double away = kAway_deg[i] * std::numbers::pi / 180;
      double x = kBase[i][0];
      double y = kBase[i][1];
      double flexion = 0;
      lines.push_back(fmt::format("{:.3f} {:.3f}", x, y));
      for (std::size_t link = 0; link < 3; ++link) {
        flexion += joints_deg[link] * std::numbers::pi / 180;
        const double along = kLinks[i][link] * std::cos(flexion);
        const double towards = kLinks[i][link] * std::sin(flexion);
        x += -along * std::sin(away) + 0.45 * towards;
        y += along * std::cos(away) - 0.3 * towards;
        lines.push_back(fmt::format("{:.3f} {:.3f}", x, y));
      }
      lines.emplace_back();
    }
    return lines;
  }

  const Saved& saved_;
  const Experiment& experiment_;
  std::vector<std::string> colour_;
  std::vector<std::string> fingers_;
  Gnuplot g_;
  std::vector<Figure> figures_;
};

}  // namespace

std::vector<DrawnFigure> draw_experiment(const Saved& saved, const Experiment& experiment) {
  std::vector<DrawnFigure> figures;
  for (const Paper paper : {Paper::svg, Paper::pdf}) {
    Drawing drawing(saved, experiment, paper);
    drawing.errors();
    for (std::size_t m = 0; m < experiment.motions.size(); ++m) drawing.motion(m);
    saved.go_on();
    std::vector<DrawnFigure> drawn = drawing.finish();
    saved.go_on();
    if (figures.empty()) {
      figures = std::move(drawn);
      continue;
    }
    for (std::size_t i = 0; i < figures.size(); ++i) figures[i].pdf = std::move(drawn[i].pdf);
  }
  return figures;
}

}  // namespace flexor::report
