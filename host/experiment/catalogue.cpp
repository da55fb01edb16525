#include "host/experiment/catalogue.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
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
    m.channels.push_back(c);
  }
  return m;
}

// A finger's flexion, zero when straight, on the hand's scale: its lower limit is straight, a degree is a
// degree.
twin::Motion recorded(const std::string& name, std::vector<double> t_s,
                      std::array<std::vector<double>, kFingers> flexion_deg) {
  for (std::size_t i = 0; i < kFingers; ++i) {
    const double lower = i == 0 ? 90 : 28;
    const double upper = i == 0 ? 170 : 113;
    for (double& angle : flexion_deg[i]) angle = std::clamp(lower + angle, lower, upper);
  }
  return twin::Motion::from_samples(name, std::move(t_s), std::move(flexion_deg));
}

// What is kept in memory grows with the rows, not with the time between them.
constexpr double kLongestPause_s = 60;

// From 0. `row(i)` says where sample i is.
std::vector<double> motion_time(const std::vector<double>& t_s, const std::string& file,
                                const std::function<std::string(std::size_t)>& row) {
  if (t_s.size() < 2) throw InputError(fmt::format("{}: a motion needs at least two rows", file));
  for (std::size_t i = 1; i < t_s.size(); ++i) {
    const double pause_s = t_s[i] - t_s[i - 1];
    if (pause_s > kLongestPause_s) {
      throw InputError(
          fmt::format("{}: {}: its time is {:g} s after the row before, and a motion pauses {:g} s "
                      "at most; mend or remove the row",
                      file, row(i), pause_s, kLongestPause_s));
    }
  }
  const double lasts_s = t_s.back() - t_s.front();
  if (!(lasts_s >= 0.01 && lasts_s <= twin::kMaxDuration_s)) {
    throw InputError(
        fmt::format("{}: lasts {:g} s; a motion lasts 0.01 to {:g} s", file, lasts_s, twin::kMaxDuration_s));
  }
  return recording::since_start(t_s);
}

// The row of a log that has this time, as an editor counts.
std::string row_at(const std::filesystem::path& path, const std::vector<std::string>& columns, double t_s) {
  std::ifstream stream(path, std::ios::binary);
  recording::CsvReader reader(stream, path.string(), {.columns = columns, .time_unit = {}});
  for (recording::Row row; reader.next(row);) {
    if (row.t_s == t_s) return fmt::format("row {}", row.line);
  }
  return fmt::format("time {:g}", t_s);
}

// Wide CSV with thumb_deg index_deg middle_deg ring_deg pinky_deg, on the hand's own scale.
twin::Motion csv_motion(const std::filesystem::path& path, std::vector<std::string>& notes) {
  std::vector<std::string> columns;
  for (const std::string& finger : model::finger_names()) columns.push_back(finger + "_deg");
  recording::Recording r = recording::read_csv(path, columns);
  notes.insert(notes.end(), r.warnings.begin(), r.warnings.end());
  std::vector<double> t_s =
      motion_time(r.t_s, path.string(), [&](std::size_t i) { return row_at(path, columns, r.t_s[i]); });
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
  return twin::Motion::from_samples(io::to_utf8(path.stem().string()), std::move(t_s), std::move(angle_deg));
}

// GraspDB: year month day hour minute second flag, then 23 joints in radians, flexion negative; MCP of thumb,
// index, middle, ring and little finger are joints 2, 5, 9, 13 and 17.
class GraspReader {
 public:
  explicit GraspReader(const std::filesystem::path& path) : path_(path) {}

  twin::Motion read() {
    std::istringstream text(io::read_file(path_));
    for (std::string line; std::getline(text, line);) {
      ++row_;
      if (line.find_first_not_of(" \t\r") != std::string::npos) add(line);
    }
    std::vector<double> t_s =
        motion_time(t_s_, path_.string(), [&](std::size_t i) { return fmt::format("row {}", rows_[i]); });
    // The glove's zero is its own: the straightest that each finger gets counts as straight.
    for (auto& finger : flexion_deg_) {
      const double straight = *std::ranges::min_element(finger);
      for (double& angle : finger) angle -= straight;
    }
    return recorded(io::to_utf8(path_.stem().string()), std::move(t_s), std::move(flexion_deg_));
  }

 private:
  static constexpr std::size_t kJoint[kFingers] = {2, 5, 9, 13, 17};
  static constexpr std::size_t kClock = 7;
  static constexpr std::size_t kFields = kClock + 23;
  static constexpr double kMaxJoint_rad = 2 * std::numbers::pi;

  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}: row {}: {}; mend or remove the row", path_.string(), row_, what));
  }

  void add(const std::string& line) {
    std::istringstream fields(line);
    std::vector<double> v;
    for (double x = 0; fields >> x;) v.push_back(x);
    if (v.size() != kFields || !fields.eof()) {
      fail(fmt::format("{} number(s) where a date, a flag and 23 joint angles make {}", v.size(), kFields));
    }
    const bool clock =
        v[2] >= 1 && v[2] <= 31 && v[3] >= 0 && v[3] < 24 && v[4] >= 0 && v[4] < 60 && v[5] >= 0 && v[5] < 61;
    if (!clock) fail(fmt::format("day {:g}, {:g}:{:g}:{:g} is no time", v[2], v[3], v[4], v[5]));
    for (std::size_t j = kClock; j < kFields; ++j) {
      if (!(std::abs(v[j]) <= kMaxJoint_rad)) fail(fmt::format("{:g} is no joint angle in radians", v[j]));
    }
    const double t = ((v[2] * 24 + v[3]) * 60 + v[4]) * 60 + v[5];
    if (!t_s_.empty() && t == t_s_.back()) return;  // some rows repeat the one before
    if (!t_s_.empty() && t < t_s_.back()) fail("the time goes backwards");
    t_s_.push_back(t);
    rows_.push_back(row_);
    for (std::size_t i = 0; i < kFingers; ++i) {
      flexion_deg_[i].push_back(-v[kClock - 1 + kJoint[i]] * 180 / std::numbers::pi);
    }
  }

  const std::filesystem::path& path_;
  int row_ = 0;
  std::vector<double> t_s_;
  std::vector<int> rows_;  // of each sample
  std::array<std::vector<double>, kFingers> flexion_deg_;
};

twin::Motion motion_file(const std::string& name, std::vector<std::string>& notes) {
  const std::filesystem::path path(name);
  if (path.extension() == ".json") return twin::Motion::from_json(io::read_file(path), name);
  if (path.extension() == ".csv") return csv_motion(path, notes);
  if (path.extension() == ".txt") return GraspReader(path).read();
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

std::vector<Compensator> compensators(const std::string& list, double rate_hz) {
  std::vector<Compensator> out;
  std::vector<std::string> items;
  std::map<std::string, int> uses;
  std::istringstream names(list);
  for (std::string item; std::getline(names, item, ',');) {
    if (std::ranges::find(items, item) != items.end())
      throw InputError(fmt::format("compensator {} is given twice", item));
    items.push_back(item);
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
