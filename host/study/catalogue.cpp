#include "host/study/catalogue.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/model/channel.hpp"
#include "host/study/builtin.hpp"
#include "host/study/published.hpp"
#include "host/study/recorded_motion.hpp"

namespace flexor::study {
namespace {

using io::InputError;

// alpha as it is: in degrees already. Nothing is refused, nothing limited but by the angles there are.
model::Model raw_model() {
  model::Model m;
  m.name = "raw";
  m.description = "The sensor's reading in degrees, sent as it is";
  for (const std::string& finger : model::finger_names()) {
    model::Channel c;
    c.name = finger;
    c.input_column = finger + "_alpha";
    c.input_unit = "deg";
    c.valid_min = -100;
    c.valid_max = 1023.9;
    c.saturation = {0, 180};
    c.rest_deg = finger == "thumb" ? 90 : 28;
    model::add(m, c);
  }
  return m;
}

twin::Motion motion_file(const std::string& name, std::vector<std::string>& notes) {
  const std::filesystem::path path(name);
  if (path.extension() == ".json") return twin::Motion::from_json(io::read_document(path), name);
  if (path.extension() == ".csv") return csv_motion(io::read_file(path), path, notes);
  if (path.extension() == ".txt") return grasp_motion(io::read_file(path), path, notes);
  throw InputError(
      "unknown gesture \"{}\"; known: 1 to 6, as 1-6 or 2,4; or a file: .json gesture, .csv or "
      ".txt recorded motion",
      name);
}

// "2" or "2-4".
std::pair<int, int> gesture_range(const std::string& item) {
  const bool is_range = item.size() == 3 && item[1] == '-';
  const int from = item.front() - '0';
  const int to = item.back() - '0';
  if ((item.size() != 1 && !is_range) || from < 1 || to > kLastGesture || from > to)
    throw InputError("unknown gesture \"{}\"; known: 1 to 6, as 1-6 or 2,4; or a file", item);
  return {from, to};
}

}  // namespace

Compensator compensator(const std::string& name, double rate_hz) {
  if (!(rate_hz >= 0.01 && rate_hz <= 1e5))  // what a model's period may be
    throw InputError("a rate of {:g} Hz must lie between 0.01 and 100000 Hz", rate_hz);
  Compensator out{name, {}};
  if (name == "raw") {
    out.model = raw_model();
  } else if (name == "published-w") {
    out.model = model::from_json(builtin("published_wiener.json"), name);
  } else if (name == "published-hw") {
    out.model = model::from_json(builtin("published_hw.json"), name);
  } else if (std::filesystem::exists(name)) {
    out.model = model::load(name);
    out.name = io::to_utf8(std::filesystem::path(name).stem().string());
  } else {
    throw InputError("unknown compensator \"{}\"; known: raw, published-w, published-hw, or a model file",
                     name);
  }
  // Poles are continuous-time: the same compensator at another rate is discretised again.
  out.model.sample_period_s = 1 / rate_hz;
  model::check(out.model);
  return out;
}

std::vector<Compensator> compensators(const std::vector<std::string>& items, double rate_hz) {
  std::vector<Compensator> out;
  std::map<std::string, int> uses;
  for (const std::string& item : items) {
    if (std::ranges::count(items, item) > 1) throw InputError("compensator {} is given twice", item);
    out.push_back(compensator(item, rate_hz));
    ++uses[out.back().name];
  }
  for (std::size_t i = 0; i < out.size(); ++i) {
    const bool published = std::ranges::count(published_compensators(), out[i].name) > 0;
    if (uses[out[i].name] > 1 || published) out[i].name = items[i];
    require_name(out[i].name, fmt::format("compensator {}", items[i]));
  }
  return out;
}

void require_name(const std::string& name, const std::string& what) {
  const bool fits = !name.empty() && std::ranges::all_of(name, [](char c) {
    return c != ',' && c != '"' && static_cast<unsigned char>(c) >= ' ' && c != 127;
  });
  if (fits) return;
  throw InputError(
      "{}: its name {} cannot stand in a table: no comma, quote or control character, and not "
      "empty; rename it",
      what, Json(name).dump(-1, ' ', true, Json::error_handler_t::replace));
}

std::vector<twin::Motion> motions(const std::string& list, std::vector<std::string>* notes) {
  std::vector<twin::Motion> out;
  std::vector<std::string> ignored;
  std::map<std::string, std::string> given;  // name -> what was written
  const auto add = [&](const std::string& item, twin::Motion motion) {
    require_name(motion.name(), item);
    const auto [before, fresh] = given.emplace(motion.name(), item);
    if (!fresh)
      throw InputError(before->second == item
                           ? fmt::format("gesture {} is given twice", item)
                           : fmt::format("gestures {} and {} have the same name, {}: rename one",
                                         before->second, item, motion.name()));
    out.push_back(std::move(motion));
  };
  std::istringstream items(list);
  std::string item;
  while (std::getline(items, item, ',')) {
    const bool numbers = !item.empty() && item.find_first_not_of("0123456789-") == std::string::npos;
    if (!numbers) {
      add(item, motion_file(item, notes != nullptr ? *notes : ignored));
      continue;
    }
    const auto [from, to] = gesture_range(item);
    for (int g = from; g <= to; ++g) add(std::to_string(g), carried_motion(std::to_string(g)));
  }
  return out;
}

twin::Motion carried_motion(const std::string& name) {
  const std::string file = "gestures/" + name + ".json";
  return twin::Motion::from_json(builtin(file), file);
}

std::vector<Scenario> scenarios() {
  std::vector<Scenario> out;
  const Json json = io::parse_json(builtin("scenarios.json"), "scenarios.json");
  for (const Json& s : json.at("scenarios"))
    out.push_back({s.at("name").get<std::string>(), s.at("set").get<std::vector<std::string>>(),
                   s.value("worn_s", 0.0), s.value("drift_turns_s", 0.0), s.value("tracked", false),
                   s.value("recalibrated", "")});
  return out;
}

std::vector<Scenario> changed_scenarios() {
  std::vector<Scenario> out = scenarios();
  std::erase_if(out, [](const Scenario& s) { return s.set.empty() || s.worn_s > 0; });
  return out;
}

}  // namespace flexor::study
