#include "host/experiment/catalogue.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>

#include "host/experiment/builtin.hpp"
#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/recording/csv.hpp"
#include "host/recording/resample.hpp"

namespace flexor::experiment {
namespace {

using Json = nlohmann::ordered_json;
using io::InputError;

struct Published {
  const char* compensator;
  double error_deg_s[6];
};
// Tables 1 and 2, averages of three trials.
constexpr Published kPublished[] = {{"raw", {681.04, 956.0, 1346.2, 860.0, 1086.5, 515.4}},
                                    {"published-w", {186.25, 221.91, 208.93, 206.90, 347.0, 368.7}},
                                    {"published-hw", {64.21, 47.66, 101.90, 39.02, 77.69, 78.2}}};

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
    m.channels.push_back(c);
  }
  return m;
}

// A finger's flexion, zero when straight, on the hand's scale: its lower limit is straight, a degree is a
// degree.
twin::Motion recorded(const std::string& name, const std::vector<double>& t_s,
                      std::array<std::vector<double>, kFingers> flexion_deg) {
  for (std::size_t i = 0; i < kFingers; ++i) {
    const double lower = i == 0 ? 90 : 28;
    const double upper = i == 0 ? 170 : 113;
    for (double& angle : flexion_deg[i]) angle = std::clamp(lower + angle, lower, upper);
  }
  return twin::Motion::from_samples(name, recording::since_start(t_s), std::move(flexion_deg));
}

// Wide CSV with thumb_deg index_deg middle_deg ring_deg pinky_deg, on the hand's own scale.
twin::Motion csv_motion(const std::filesystem::path& path) {
  std::vector<std::string> columns;
  for (const std::string& finger : model::finger_names()) columns.push_back(finger + "_deg");
  recording::Recording r = recording::read_csv(path, columns);
  if (r.t_s.size() < 2) throw InputError(fmt::format("{}: a motion needs at least two rows", path.string()));
  std::array<std::vector<double>, kFingers> angle_deg;
  double largest_deg = 0;
  for (std::size_t i = 0; i < kFingers; ++i) {
    angle_deg[i] = r.column(columns[i]).value;
    const auto [low, high] = std::ranges::minmax(angle_deg[i]);
    if (low < 0 || high > 180) {
      throw InputError(
          fmt::format("{}: column {}: {:g} to {:g} is no joint's range; write degrees between 0 and 180",
                      path.string(), columns[i], low, high));
    }
    largest_deg = std::max(largest_deg, high);
  }
  if (largest_deg < 4) {
    throw InputError(
        fmt::format("{}: no angle above {:g}: are these radians? Write degrees", path.string(), largest_deg));
  }
  return twin::Motion::from_samples(io::to_utf8(path.stem().string()), recording::since_start(r.t_s),
                                    std::move(angle_deg));
}

// GraspDB: year month day hour minute second flag, then 23 joints in radians, flexion negative; MCP of thumb,
// index, middle, ring and little finger are joints 2, 5, 9, 13 and 17.
twin::Motion grasp_motion(const std::filesystem::path& path) {
  constexpr std::size_t kJoint[kFingers] = {2, 5, 9, 13, 17};
  constexpr std::size_t kFields = 7 + 23;
  std::istringstream text(io::read_file(path));
  std::vector<double> t_s;
  std::array<std::vector<double>, kFingers> flexion_deg;
  std::string line;
  for (int row = 1; std::getline(text, line); ++row) {
    std::istringstream fields(line);
    std::vector<double> v;
    for (double x = 0; fields >> x;) v.push_back(x);
    if (v.empty()) continue;
    if (v.size() != kFields || !std::ranges::all_of(v, [](double x) { return std::isfinite(x); })) {
      throw InputError(fmt::format("{}: row {}: {} numbers where a date, a flag and 23 joint angles make {}",
                                   path.string(), row, v.size(), kFields));
    }
    const double t = ((v[2] * 24 + v[3]) * 60 + v[4]) * 60 + v[5];
    if (!t_s.empty() && t <= t_s.back()) continue;  // some rows repeat the one before
    t_s.push_back(t);
    for (std::size_t i = 0; i < kFingers; ++i) {
      flexion_deg[i].push_back(-v[6 + kJoint[i]] * 180 / std::numbers::pi);
    }
  }
  if (t_s.size() < 2) throw InputError(fmt::format("{}: a motion needs at least two rows", path.string()));
  // The glove's zero is its own: the straightest that each finger gets counts as straight.
  for (auto& finger : flexion_deg) {
    const double straight = *std::ranges::min_element(finger);
    for (double& angle : finger) angle -= straight;
  }
  return recorded(io::to_utf8(path.stem().string()), t_s, std::move(flexion_deg));
}

twin::Motion motion_file(const std::string& name) {
  const std::filesystem::path path(name);
  if (path.extension() == ".json") return twin::Motion::from_json(io::read_file(path), name);
  if (path.extension() == ".csv") return csv_motion(path);
  if (path.extension() == ".txt") return grasp_motion(path);
  throw InputError(
      fmt::format("unknown gesture \"{}\"; known: 1 to 6, as 1-6 or 2,4; or a file: .json gesture, .csv or "
                  ".txt recorded motion",
                  name));
}

}  // namespace

Compensator compensator(const std::string& name, double rate_hz) {
  if (!(rate_hz > 0) || !std::isfinite(rate_hz)) throw InputError("the rate must be positive");
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
  return out;
}

std::vector<twin::Motion> motions(const std::string& list) {
  std::vector<twin::Motion> out;
  std::istringstream items(list);
  std::string item;
  while (std::getline(items, item, ',')) {
    const bool numbers = !item.empty() && item.find_first_not_of("0123456789-") == std::string::npos;
    if (!numbers) {
      out.push_back(motion_file(item));
      continue;
    }
    const auto dash = item.find('-');
    const int from = std::atoi(item.c_str());
    const int to = dash == std::string::npos ? from : std::atoi(item.c_str() + dash + 1);
    if (from < 1 || to > 6 || from > to) {
      throw InputError(fmt::format("unknown gesture \"{}\"; known: 1 to 6, as 1-6 or 2,4; or a file", item));
    }
    for (int g = from; g <= to; ++g) {
      const std::string name = fmt::format("gestures/{}.json", g);
      out.push_back(twin::Motion::from_json(builtin(name), name));
    }
  }
  return out;
}

twin::Motion calibration_motion() {
  return twin::Motion::from_json(builtin("gestures/calibration.json"), "gestures/calibration.json");
}

twin::Parameters shipped_parameters() { return twin::from_json(builtin("twin.json"), "twin.json"); }

std::vector<Scenario> scenarios() {
  std::vector<Scenario> out;
  const Json json = io::parse_json(builtin("scenarios.json"), "scenarios.json");
  for (const Json& s : json.at("scenarios")) {
    out.push_back({s.at("name").get<std::string>(), s.at("set").get<std::vector<std::string>>()});
  }
  return out;
}

std::optional<double> published_error_deg_s(int gesture, const std::string& compensator) {
  const auto it = std::ranges::find(kPublished, compensator, &Published::compensator);
  if (it == std::end(kPublished) || gesture < 1 || gesture > 6) return std::nullopt;
  return it->error_deg_s[gesture - 1];
}

}  // namespace flexor::experiment
