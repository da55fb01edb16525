#include "apps/live/anew.hpp"

#include <fmt/ranges.h>

#include <algorithm>

namespace flexor::live {
namespace {

// Lines on a sensor begin with its name.
std::string verdict_on(const std::string& sensor, const Json& said) {
  const Json& of = said.at("sensors").at(sensor);
  if (of.at("applied").get<bool>()) return "fitted";
  const Json& line = of.at("kept");
  std::string why = line.get<std::string>();
  if (why.starts_with(sensor + ": ")) why.erase(0, sensor.size() + 2);
  const auto is_among = [&](const char* lines) {
    return std::ranges::find(said.at(lines), line) != said.at(lines).end();
  };
  return (is_among("misfits") ? "does not fit: " : is_among("wanted") ? "wanted: " : "kept: ") + why;
}

std::string verdict_on(const std::vector<std::string>& sensors, const Json& said) {
  if (sensors.size() == 1) return verdict_on(sensors.front(), said);
  std::string out;
  for (const std::string& sensor : sensors)
    out += (out.empty() ? "" : "; ") + sensor + " " + verdict_on(sensor, said);
  return out;
}

}  // namespace

AnewResult anew_result(const model::Model& old, const Json& said) {
  AnewResult out;
  out.applied = said.at("applied").get<bool>();
  out.wanted = fmt::format("{}", fmt::join(said.at("wanted").get<std::vector<std::string>>(), "; "));
  out.misfits = fmt::format("{}", fmt::join(said.at("misfits").get<std::vector<std::string>>(), "; "));
  const model::Graph graph(old);
  for (std::size_t j = 0; j < old.joints.size(); ++j) {
    const std::string& joint = old.joints[j].name;
    std::vector<std::string> sensors;
    for (const std::size_t i : graph.inputs[graph.joint[j]]) sensors.push_back(old.inputs[i].name);
    const bool is_kept = std::ranges::none_of(sensors, [&](const std::string& sensor) {
      return said.at("sensors").at(sensor).at("applied").get<bool>();
    });
    const Json before = is_kept ? Json(nullptr) : said.at("change_rms_deg").at(joint);  // not 0: not known
    const Json& after = said.at("se_deg").at(joint);
    if (before.is_number() && after.is_number() && before.get<double>() > after.get<double>())
      out.is_off = true;
    out.fingers.push_back({{"name", joint},
                           {"before_deg", before},
                           {"after_deg", after},
                           {"verdict", verdict_on(sensors, said)}});
  }
  return out;
}

}  // namespace flexor::live
