#include <algorithm>

#include "host/io/io.hpp"
#include "host/report/colours.hpp"
#include "host/report/jobs.hpp"
#include "host/report/page.hpp"

namespace flexor::report {
namespace {

struct Change {
  const char* key;
  const char* name;
};
constexpr Change kChanges[] = {{"shift", "shift"}, {"log_gain", "gain"}};

double percent_of(const Json& share) { return 100 * share.get<double>(); }

std::vector<std::string> sensors_worn(const Json& r) {
  std::vector<std::string> out;
  for (const Json& session : r.at("sessions")) {  // a sensor may be missing in some
    for (const auto& sensor : session.at("sensors").items()) {
      if (std::ranges::find(out, sensor.key()) == out.end()) out.push_back(sensor.key());
    }
  }
  return out;
}

// A panel for each quantity: sessions in their order, each sensor a little beside the others, with its interval.
void draw_changes(Gnuplot& g, const Json& r) {
  const Json& sessions = r.at("sessions");
  const std::vector<std::string> sensors = sensors_worn(r);
  const std::vector<std::string> colours = colours_of(sensors);
  for (const Change& quantity : kChanges) {
    for (std::size_t s = 0; s < sensors.size(); ++s) {
      const double beside = 0.5 * (static_cast<double>(s) + 0.5) / static_cast<double>(sensors.size()) - 0.25;
      g.data(fmt::format("{}{}", quantity.key, s), sessions.size(), [&](std::size_t i) {
        const Json& read = sessions.at(i).at("sensors");
        if (!read.contains(sensors[s])) return fmt::format("{} NaN NaN NaN", i);
        const Json& c = read.at(sensors[s]).at(quantity.key);
        return fmt::format("{} {} {} {}", static_cast<double>(i) + beside, percent_of(c.at("value")),
                           percent_of(c.at("low")), percent_of(c.at("high")));
      });
    }
  }
  g.begin("changes", 560);
  g.add("set multiplot layout 2,1 margins 0.13,0.97,0.2,0.93 spacing 0,0.05");
  g.add("set xrange [-0.6:{}]; set xzeroaxis lw 1 lc rgb '#888888'",
        static_cast<double>(sessions.size()) - 0.4);
  g.add("set key above");
  for (const Change& quantity : kChanges) {
    const bool last = &quantity == &kChanges[1];
    std::string tics;
    for (std::size_t i = 0; i < sessions.size(); ++i) {
      tics += fmt::format("{}{} {}", i > 0 ? ", " : "",
                          last ? gnuplot_tic(sessions.at(i).at("name").get<std::string>()) : "''", i);
    }
    g.add("set xtics ({}) rotate by 40 right noenhanced", tics);
    g.add("set ylabel '{} (% of the span)'", quantity.name);
    std::string plot;
    for (std::size_t s = 0; s < sensors.size(); ++s) {
      plot += fmt::format(
          "{}${}{} using 1:2:3:4 with yerrorlines lw 1.5 pt 7 ps 0.5 lc rgb '{}' title {} noenhanced",
          s > 0 ? ", " : "", quantity.key, s, colours[s], gnuplot_text(sensors[s]));
    }
    g.add("plot {}", plot);
    g.add("set key off");
  }
  g.add("unset multiplot");
}

std::string change_text(const Json& c) {
  return fmt::format("{:+.0f} ({:+.0f} to {:+.0f})", percent_of(c.at("value")), percent_of(c.at("low")),
                     percent_of(c.at("high")));
}

TableBlock changes_table(const Json& r) {
  TableBlock out{"Percent of the sensor's span, against the mean of all sessions, with 95 % intervals",
                 {"session", "sensor", "shift", "gain", "shape", "noise"},
                 {},
                 {}};
  for (const Json& session : r.at("sessions")) {
    for (const auto& [sensor, s] : session.at("sensors").items()) {
      out.rows.push_back({session.at("name").get<std::string>(), sensor, change_text(s.at("shift")),
                          change_text(s.at("log_gain")), fmt::format("{:.1f}", percent_of(s.at("shape"))),
                          fmt::format("{:.2f}", percent_of(s.at("noise")))});
    }
  }
  return out;
}

}  // namespace

void render_donning(const Saved& saved) {
  const Json& r = saved.results();
  const Json& prior = r.at("prior");
  Gnuplot g;
  draw_changes(g, r);
  g.run();
  saved.go_on();
  Page page("What changed from session to session");
  page.cards({{fmt::format("{:.0f} %", percent_of(prior.at("shift_sd"))),
               "standard deviation of where a sensor lies"},
              {fmt::format("{:.0f} %", percent_of(prior.at("log_gain_sd"))), "of how far it reaches"},
              {fmt::format("{:.2f}", prior.at("alike").get<double>()),
               "correlation of the shifts of two sensors, drawn towards the shipped one", true},
              {fmt::format("{}", r.at("sessions").size()), "sessions", true}});
  page.figure(
      {"changes", "Where each sensor lies, and how far it reaches",
       "Each session against the mean of all, with 95 % intervals. Sensors that go up and down together "
       "are a glove that moved as a whole.",
       true},
      g, saved.folder());
  page.table(changes_table(r));
  page.paragraph(
      "Shift: of the middle between the reading that 2 % of the samples stay below and that of 98 %. Gain: "
      "of the "
      "distance between the two, as a logarithm. Shape: what both leave, root mean square over five "
      "quantiles. "
      "Noise: of one reading.");
  page.paragraph(fmt::format("flexor {}.", saved.text("version")));
  io::write_file(saved.folder() / "report.html", page.html());
}

}  // namespace flexor::report
