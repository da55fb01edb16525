#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <optional>
#include <regex>

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

// Seconds since 1970 of the first day in a name as 2018-12-16 is; none: no such day.
std::optional<double> day_of(const std::string& name) {
  static const std::regex kDay(R"((\d{4})-(\d{2})-(\d{2}))");
  std::smatch found;
  if (!std::regex_search(name, found, kDay)) return std::nullopt;
  const std::chrono::year_month_day day{std::chrono::year(std::stoi(found[1])),
                                        std::chrono::month(static_cast<unsigned>(std::stoi(found[2]))),
                                        std::chrono::day(static_cast<unsigned>(std::stoi(found[3])))};
  if (!day.ok()) return std::nullopt;
  return 86400.0 * static_cast<double>(std::chrono::sys_days(day).time_since_epoch().count());
}

// A panel for each quantity, each sensor with its interval: over days where all sessions have one, else in their order, each sensor a
// little beside the others.
Chart changes_chart(const Json& r) {
  const Json& sessions = r.at("sessions");
  const std::vector<std::string> sensors = sensors_worn(r);
  const std::vector<std::string> colours = colours_of(sensors);
  Chart chart{
      {"changes", "Where each sensor lies, and how far it reaches",
       "Each session against the mean of all, with 95 % intervals. Sensors that go up and down together "
       "are a glove that moved as a whole.",
       true},
      "",
      {}};
  std::vector<double> place;
  for (const Json& session : sessions) {
    const auto name = session.at("name").get<std::string>();
    chart.x_names.push_back(name);
    if (const auto day = day_of(name)) place.push_back(*day);
  }
  chart.is_dated = place.size() == sessions.size();
  if (chart.is_dated) chart.x_names.clear();
  if (!chart.is_dated) {
    place.resize(sessions.size());
    std::iota(place.begin(), place.end(), 0);
  }
  const double spread = chart.is_dated ? 86400.0 : 0.5;
  for (const Change& quantity : kChanges) {
    Panel panel{fmt::format("{} (% of the span)", quantity.name), {}};
    for (std::size_t s = 0; s < sensors.size(); ++s) {
      std::vector<double> at, value, low, high;
      for (std::size_t i = 0; i < sessions.size(); ++i) {
        const Json& read = sessions.at(i).at("sensors");
        if (!read.contains(sensors[s])) continue;
        const Json& c = read.at(sensors[s]).at(quantity.key);
        at.push_back(place[i] +
                     spread * ((static_cast<double>(s) + 0.5) / static_cast<double>(sensors.size()) - 0.5));
        value.push_back(percent_of(c.at("value")));
        low.push_back(percent_of(c.at("low")));
        high.push_back(percent_of(c.at("high")));
      }
      panel.series.push_back(intervals(colours[s], at, low, high));
      panel.series.push_back({"", colours[s], at, value});
      panel.series.push_back({sensors[s], colours[s], at, value, Style::points, 4});
    }
    chart.panels.push_back(std::move(panel));
  }
  return chart;
}

std::string change_text(const Json& c) {
  const auto whole = [&](const char* key) { return std::round(percent_of(c.at(key))) + 0.0; };  // never -0
  return fmt::format("{:+.0f} ({:+.0f} to {:+.0f})", whole("value"), whole("low"), whole("high"));
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
  Page page("What changed from session to session");
  page.cards({{fmt::format("{:.0f} %", percent_of(prior.at("shift_sd"))),
               "standard deviation of where a sensor lies"},
              {fmt::format("{:.0f} %", percent_of(prior.at("log_gain_sd"))), "of how far it reaches"},
              {fmt::format("{:.2f}", prior.at("alike").get<double>()),
               "correlation of the shifts of two sensors, drawn towards the shipped one", true},
              {fmt::format("{}", r.at("sessions").size()), "sessions", true}});
  page.chart(changes_chart(r));
  page.table(changes_table(r));
  page.paragraph(
      "Shift: of the middle between the reading that 2 % of the samples stay below and that of 98 %. Gain: "
      "of the "
      "distance between the two, as a logarithm. Shape: what both leave, root mean square over five "
      "quantiles. "
      "Noise: of one reading.");
  page.write(saved);
}

}  // namespace flexor::report
