#include "host/study/catalogue.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/model/channel.hpp"
#include "host/study/builtin.hpp"
#include "host/study/recorded_motion.hpp"

namespace flexor::study {
namespace {

using Json = nlohmann::ordered_json;
using io::InputError;

struct Published {
  const char* compensator;
  double error_deg_s[6];
  double trials_deg_s[kPublishedTrials][6];
};
// Tables 1 and 2: averages of three trials, and the trials.
constexpr Published kPublished[] = {{"raw",
                                     {681.04, 956.0, 1346.2, 860.0, 1086.5, 515.4},
                                     {{1036.21, 701.5, 2014.2, 1201.2, 1479, 418.5},
                                      {545.7, 1654.14, 1023.1, 721.78, 1080.25, 525.3},
                                      {461.21, 512.23, 1001.2, 657.12, 700.23, 602.3}}},
                                    {"published-w",
                                     {186.25, 221.91, 208.93, 206.90, 347.0, 368.7},
                                     {{354.2, 412.21, 401.28, 70.254, 299.5, 315.9},
                                      {144.25, 152.25, 101.25, 98.321, 441.2, 401},
                                      {60.214, 101.27, 124.27, 452.12, 300.2, 389.3}}},
                                    {"published-hw",
                                     {64.21, 47.66, 101.90, 39.02, 77.69, 78.2},
                                     {{136.7, 97.75, 254.3, 76.76, 39.47, 48.4},
                                      {49.8, 39.1, 39.34, 37.03, 108.3, 81.3},
                                      {6.131, 6.137, 12.08, 3.283, 85.3, 104.9}}}};
static_assert(std::size(kPublished) == kPublishedCompensators);

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
  if (path.extension() == ".txt") return grasp_motion(io::read_file(path), path);
  throw InputError(
      fmt::format("unknown gesture \"{}\"; known: 1 to 6, as 1-6 or 2,4; or a file: .json gesture, .csv or "
                  ".txt recorded motion",
                  name));
}

// "2" or "2-4".
std::pair<int, int> gesture_range(const std::string& item) {
  int from = 0;
  int to = 0;
  const char* const end = item.data() + item.size();
  auto [at, error] = std::from_chars(item.data(), end, from);
  to = from;
  if (error == std::errc() && at < end && *at == '-') {
    const auto last = std::from_chars(at + 1, end, to);
    at = last.ptr;
    error = last.ec;
  }
  if (error != std::errc() || at != end || from < 1 || to > 6 || from > to) {
    throw InputError(fmt::format("unknown gesture \"{}\"; known: 1 to 6, as 1-6 or 2,4; or a file", item));
  }
  return {from, to};
}

}  // namespace

Compensator compensator(const std::string& name, double rate_hz) {
  if (!(rate_hz >= 0.01 && rate_hz <= 1e5))  // what a model's period may be
    throw InputError(fmt::format("a rate of {:g} Hz must lie between 0.01 and 100000 Hz", rate_hz));
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
    throw InputError(fmt::format(
        "unknown compensator \"{}\"; known: raw, published-w, published-hw, or a model file", name));
  }
  // Poles are continuous-time: the same compensator at another rate is discretised anew.
  out.model.sample_period_s = 1 / rate_hz;
  model::check(out.model);
  return out;
}

std::vector<Compensator> compensators(const std::vector<std::string>& items, double rate_hz) {
  std::vector<Compensator> out;
  std::map<std::string, int> uses;
  for (const std::string& item : items) {
    if (std::ranges::count(items, item) > 1)
      throw InputError(fmt::format("compensator {} is given twice", item));
    out.push_back(compensator(item, rate_hz));
    ++uses[out.back().name];
  }
  for (std::size_t i = 0; i < out.size(); ++i) {
    const bool published =
        std::ranges::find(kPublished, out[i].name, &Published::compensator) != std::end(kPublished);
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
      fmt::format("{}: its name {} cannot stand in a table: no comma, quote or control character, and not "
                  "empty; rename it",
                  what, Json(name).dump(-1, ' ', true, Json::error_handler_t::replace)));
}

std::vector<twin::Motion> motions(const std::string& list) {
  std::vector<std::string> notes;
  return motions(list, notes);
}

std::vector<twin::Motion> motions(const std::string& list, std::vector<std::string>& notes) {
  std::vector<twin::Motion> out;
  std::map<std::string, std::string> given;  // name -> what was written
  const auto add = [&](const std::string& item, twin::Motion motion) {
    require_name(motion.name(), item);
    const auto [before, fresh] = given.emplace(motion.name(), item);
    if (!fresh) {
      throw InputError(before->second == item
                           ? fmt::format("gesture {} is given twice", item)
                           : fmt::format("gestures {} and {} have the same name, {}: rename one",
                                         before->second, item, motion.name()));
    }
    out.push_back(std::move(motion));
  };
  std::istringstream items(list);
  std::string item;
  while (std::getline(items, item, ',')) {
    const bool numbers = !item.empty() && item.find_first_not_of("0123456789-") == std::string::npos;
    if (!numbers) {
      add(item, motion_file(item, notes));
      continue;
    }
    const auto [from, to] = gesture_range(item);
    for (int g = from; g <= to; ++g) {
      const std::string name = fmt::format("gestures/{}.json", g);
      add(std::to_string(g), twin::Motion::from_json(builtin(name), name));
    }
  }
  return out;
}

twin::Motion short_motion() {
  return twin::Motion::from_json(builtin("gestures/calibration.json"), "gestures/calibration.json");
}

twin::Motion ordinary_motion() {
  return twin::Motion::from_json(builtin("gestures/ordinary.json"), "gestures/ordinary.json");
}

twin::Motion recommended_motion() {
  return twin::Motion::from_json(builtin("gestures/protocol.json"), "gestures/protocol.json");
}

std::vector<Scenario> scenarios() {
  std::vector<Scenario> out;
  const Json json = io::parse_json(builtin("scenarios.json"), "scenarios.json");
  for (const Json& s : json.at("scenarios")) {
    out.push_back({s.at("name").get<std::string>(), s.at("set").get<std::vector<std::string>>(),
                   s.value("worn_s", 0.0), s.value("drift_turns_s", 0.0), s.value("tracked", false),
                   s.value("recalibrated", "")});
  }
  return out;
}

std::vector<Scenario> changed_scenarios() {
  std::vector<Scenario> out = scenarios();
  std::erase_if(out, [](const Scenario& s) { return s.set.empty() || s.worn_s > 0; });
  return out;
}

std::optional<double> published_error_deg_s(int gesture, const std::string& compensator) {
  const auto it = std::ranges::find(kPublished, compensator, &Published::compensator);
  if (it == std::end(kPublished) || gesture < 1 || gesture > 6) return std::nullopt;
  return it->error_deg_s[gesture - 1];
}

std::array<double, kPublishedTrials> published_trials_deg_s(int gesture, const std::string& compensator) {
  const auto it = std::ranges::find(kPublished, compensator, &Published::compensator);
  if (it == std::end(kPublished) || gesture < 1 || gesture > 6) {
    throw InputError(fmt::format("gesture {} with {} is not in the article", gesture, compensator));
  }
  std::array<double, kPublishedTrials> out{};
  for (std::size_t t = 0; t < kPublishedTrials; ++t) out[t] = it->trials_deg_s[t][gesture - 1];
  return out;
}

const std::vector<std::string>& published_compensators() {
  static const std::vector<std::string> names = {"raw", "published-w", "published-hw"};
  return names;
}

}  // namespace flexor::study
