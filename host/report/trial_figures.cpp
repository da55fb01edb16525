#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>

#include "host/report/colours.hpp"
#include "host/report/gnuplot.hpp"
#include "host/report/trial_report.hpp"

namespace flexor::report {
namespace {

constexpr const char* kReference = "#222222";

// The first letters, none of them cut in two.
std::string shortened(const std::string& text) {
  std::size_t end = std::min<std::size_t>(text.size(), 18);
  while (end > 0 && end < text.size() && (static_cast<unsigned char>(text[end]) & 0xc0U) == 0x80) --end;
  return text.substr(0, end);
}

std::string title(const twin::Motion& motion) {
  return motion.number() > 0 ? fmt::format("Gesture {}, {}", motion.number(), motion.name()) : motion.name();
}

class Drawing {
 public:
  Drawing(const Plan& plan, const Result& result, bool pdf)
      : plan_(plan), result_(result), pdf_(pdf), colour_(colours_of(result.compensators)) {}

  void errors() {
    const std::size_t n = result_.compensators.size();
    const double floor = axis_floor();
    g_.begin("errors", 480, 960, pdf_);
    for (std::size_t c = 0; c < n; ++c) {
      g_.data(fmt::format("errors{}", c), result_.motions.size(), [&](std::size_t m) {
        const Cell& cell = result_.cell(m, c);
        const double at =
            static_cast<double>(m) + (static_cast<double>(c) + 0.5) * 0.8 / static_cast<double>(n) - 0.4;
        return fmt::format("{} {} {} {}", at, cell.total_deg_s.mean(), whisker(cell.total_deg_s, floor),
                           cell.published_deg_s ? fmt::format("{}", *cell.published_deg_s) : "NaN");
      });
    }
    std::string tics;
    for (std::size_t m = 0; m < result_.motions.size(); ++m) {
      tics += fmt::format("{}{} {}", m == 0 ? "" : ", ", gnuplot_tic(shortened(plan_.motions[m].name())), m);
    }
    g_.add(
        "set logscale y; set ylabel 'total error E_T (deg s)' noenhanced; set xtics ({}) noenhanced; set "
        "xrange "
        "[-0.6:{}]",
        tics, static_cast<double>(result_.motions.size()) - 0.4);
    g_.add("set boxwidth {}; set style fill solid 0.85 noborder; set yrange [{}:*]",
           0.8 / static_cast<double>(n) * 0.92, floor);
    std::string plot = "plot ";
    bool any_published = false;
    for (std::size_t c = 0; c < n; ++c) {
      plot += fmt::format(
          "$errors{0} using 1:2 with boxes lc rgb '{1}' title {2} noenhanced, "
          "$errors{0} using 1:3:(0):4 with vectors nohead lc rgb '#444444' lw 1.2 notitle, ",
          c, colour_[c], gnuplot_text(result_.compensators[c]));
      any_published = any_published || result_.cell(0, c).published_deg_s.has_value();
    }
    for (std::size_t c = 0; c < n; ++c) {
      plot += fmt::format("$errors{} using 1:5 with points pt 7 ps 0.9 lc rgb '#000000' {}{}", c,
                          c == 0 && any_published ? "title 'published'" : "notitle", c + 1 == n ? "" : ", ");
    }
    g_.add("{}", plot);
    done("errors", "Total error",
         "Mean over all trials, with its 95 % interval; dots: the published averages. The scale is "
         "logarithmic.");
  }

  // Trial 0 of motion m, compensator by compensator.
  void motion(std::size_t m, const std::vector<twin::Trial>& trials) {
    const twin::Motion& motion = plan_.motions[m];
    for (std::size_t c = 0; c < trials.size(); ++c) {
      const twin::Trial& t = trials[c];
      g_.data(fmt::format("run{}_{}", m, c), t.hand_deg[0].size(), [&](std::size_t k) {
        std::string row = fmt::format("{:.3f}", static_cast<double>(k) / plan_.parameters.camera_rate_hz);
        for (std::size_t i = 0; i < kFingers; ++i)
          row += fmt::format(" {:.1f} {:.1f}", t.glove_deg[i][k], t.hand_deg[i][k]);
        return row;
      });
    }
    series(m, motion, trials, false);
    series(m, motion, trials, true);
    postures(m, motion, trials);
  }

  std::vector<TrialFigure> finish() {
    if (plan_.stop != nullptr && plan_.stop->load()) throw io::Cancelled("stopped");
    g_.run();
    for (TrialFigure& f : figures_) (pdf_ ? f.pdf : f.svg) = pdf_ ? g_.bytes(f.name) : g_.svg(f.name);
    return std::move(figures_);
  }

 private:
  void done(const std::string& name, const std::string& figure_title, const std::string& caption) {
    figures_.push_back({name, figure_title, caption, {}, {}});
  }

  // The foot of the logarithmic axis: 5 deg s, less where a bar would not be seen above that.
  double axis_floor() const {
    double floor = 5;
    for (const Cell& cell : result_.cells) {
      const double mean = cell.total_deg_s.mean();
      if (mean > 0) floor = std::min(floor, mean / 2);
    }
    return floor;
  }

  // Foot and height of an interval; what lies below the axis's foot is cut off, since it has no logarithm.
  static std::string whisker(const Statistic& s, double floor) {
    const std::optional<double> half = s.ci95();
    if (!half) return "NaN NaN";
    const double foot = std::max(s.mean() - *half, floor);
    return fmt::format("{} {}", foot, s.mean() + *half - foot);
  }

  // At most half a dozen numbers on the axis of a finger's errors.
  static int tic_step(const std::vector<twin::Trial>& trials, std::size_t finger) {
    float largest = 0;
    for (const twin::Trial& t : trials) {
      for (std::size_t k = 0; k < t.hand_deg[finger].size(); ++k) {
        largest = std::max(largest, std::abs(t.glove_deg[finger][k] - t.hand_deg[finger][k]));
      }
    }
    return largest > 50 ? 40 : largest > 25 ? 20 : largest > 10 ? 10 : 5;
  }

  // Five fingers below one another: angles over the reference, or what is left between them.
  void series(std::size_t m, const twin::Motion& motion, const std::vector<twin::Trial>& trials, bool error) {
    const std::string name = fmt::format("{}_{}", error ? "error" : "response", m + 1);
    g_.begin(name, 900, 560, pdf_);
    g_.add("set multiplot layout 5,1 margins 0.12,0.98,0.08,0.925 spacing 0,0.025");
    for (std::size_t i = 0; i < kFingers; ++i) {
      g_.add("set ylabel '{} (deg)' offset 1,0; set xrange [0:{}]; set ytics {}", model::finger_names()[i],
             motion.duration_s(), error ? tic_step(trials, i) : 30);
      g_.add("{}",
             i + 1 < kFingers ? "set format x ''; unset xlabel" : "set format x '%g'; set xlabel 'time (s)'");
      g_.add("{}", i == 0 ? "set key at screen 0.98,0.995 right top horizontal maxrows 2 samplen 1.5"
                          : "unset key");
      std::string plot = "plot ";
      const std::size_t reference = 2 + 2 * i;
      if (error) {
        plot += "0 with lines lc rgb '#999999' notitle";
      } else {
        plot += fmt::format("$run{}_0 using 1:{} with lines lw 3 lc rgb '{}' title 'finger'", m, reference,
                            kReference);
      }
      for (std::size_t c = 0; c < plan_.compensators.size(); ++c) {
        const std::string value =
            error ? fmt::format("(${}-${})", reference, reference + 1) : fmt::format("{}", reference + 1);
        plot += fmt::format(", $run{}_{} using 1:{} with lines lw 1.6 lc rgb '{}' title {} noenhanced", m, c,
                            value, colour_[c], gnuplot_text(plan_.compensators[c].name));
      }
      g_.add("{}", plot);
    }
    g_.add("unset multiplot");
    done(name, title(motion) + (error ? ": error" : ": response"),
         error ? "Finger minus hand, the same trial."
               : "One trial, as the cameras saw it: the finger, and the hand with each compensator.");
  }

  // A hand seen a little from the side: palm below, a finger is three links in its own plane, bending towards
  // the viewer.
  void postures(std::size_t m, const twin::Motion& motion, const std::vector<twin::Trial>& trials) {
    const std::string name = fmt::format("posture_{}", m + 1);
    const std::size_t panels = trials.size() + 1;
    const std::size_t columns = std::min<std::size_t>(panels, 5);
    const std::size_t rows = (panels + columns - 1) / columns;
    g_.begin(name, static_cast<int>(300 * rows), 960, pdf_);
    for (std::size_t panel = 0; panel < panels; ++panel) {
      const twin::Trial& trial = trials[panel == 0 ? 0 : panel - 1];
      PerFinger angle{};
      for (std::size_t i = 0; i < kFingers; ++i) {
        angle[i] = static_cast<double>((panel == 0 ? trial.glove_deg : trial.hand_deg)[i].back());
      }
      const std::vector<std::string> lines = hand_lines(angle);
      g_.data(fmt::format("hand{}_{}", m, panel), lines.size(), [&](std::size_t k) { return lines[k]; });
    }
    g_.add(
        "unset border; unset tics; unset grid; unset key; set size ratio -1; set xrange [-2.1:1.7]; set "
        "yrange [-2.2:2.9]");
    g_.add("set multiplot layout {},{}", rows, columns);
    for (std::size_t panel = 0; panel < panels; ++panel) {
      g_.add("set title {} noenhanced",
             gnuplot_text(panel == 0 ? "finger (reference)" : plan_.compensators[panel - 1].name));
      g_.add(
          "plot $hand{0}_{1} index 0 using 1:2 with filledcurves closed fc rgb '#eeeeee' notitle, "
          "'' index 1 using 1:2 with lines lw 9 lc rgb '{2}' notitle, "
          "'' index 1 using 1:2 with points pt 7 ps 0.7 lc rgb '#ffffff' notitle",
          m, panel, panel == 0 ? kReference : colour_[panel - 1].c_str());
    }
    g_.add("unset multiplot");
    done(name, title(motion) + ": final posture",
         "The joints follow the MCP angle: PIP 3/4, DIP 2/3 of it, the thumb's IP one half.");
  }

  using PerFinger = twin::PerFinger;

  std::vector<std::string> hand_lines(const PerFinger& angle_deg) const {
    constexpr double kBase[kFingers][2] = {
        {-1.25, -0.9}, {-0.9, 0.75}, {-0.3, 0.95}, {0.3, 0.85}, {0.85, 0.55}};
    constexpr double kLinks[kFingers][3] = {
        {0.75, 0.6, 0}, {0.95, 0.6, 0.45}, {1.05, 0.7, 0.45}, {0.95, 0.65, 0.45}, {0.7, 0.45, 0.4}};
    constexpr double kAway_deg[kFingers] = {55, 8, 2, -4, -11};  // from straight up, to the left
    std::vector<std::string> lines = {"-1.1 -2.1", "-1.25 -0.9", "-0.9 0.75", "-0.3 0.95", "0.3 0.85",
                                      "0.85 0.55", "0.95 -0.6",  "0.7 -2.1",  "",          ""};
    for (std::size_t i = 0; i < kFingers; ++i) {
      // A finger at its lower limit is straight.
      const twin::Posture joints =
          twin::posture(static_cast<int>(i), angle_deg[i] - plan_.parameters.hand_lower_deg[i]);
      const double bends[3] = {joints.mcp_deg, joints.pip_deg, joints.dip_deg};
      const double away = kAway_deg[i] * std::numbers::pi / 180;
      double x = kBase[i][0];
      double y = kBase[i][1];
      double flexion = 0;
      lines.push_back(fmt::format("{:.3f} {:.3f}", x, y));
      for (int link = 0; link < 3; ++link) {
        flexion += bends[link] * std::numbers::pi / 180;
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

  const Plan& plan_;
  const Result& result_;
  bool pdf_;
  std::vector<std::string> colour_;
  Gnuplot g_;
  std::vector<TrialFigure> figures_;
};

}  // namespace

std::vector<TrialFigure> draw(const Plan& plan, const Result& result) {
  std::vector<std::vector<twin::Trial>> trials;
  for (const twin::Motion& motion : plan.motions) {
    std::vector<twin::Trial>& one = trials.emplace_back();
    for (const Compensator& c : plan.compensators) one.push_back(first_trial(plan, motion, c));
  }
  std::vector<TrialFigure> figures;
  for (const bool pdf : {false, true}) {
    Drawing drawing(plan, result, pdf);
    drawing.errors();
    for (std::size_t m = 0; m < plan.motions.size(); ++m) drawing.motion(m, trials[m]);
    std::vector<TrialFigure> drawn = drawing.finish();
    if (!pdf) {
      figures = std::move(drawn);
      continue;
    }
    for (std::size_t i = 0; i < figures.size(); ++i) figures[i].pdf = std::move(drawn[i].pdf);
  }
  return figures;
}

}  // namespace flexor::report
