#include "host/camera/joints.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "host/io/io.hpp"
#include "host/io/json.hpp"

namespace flexor::camera {
namespace {

using Json = nlohmann::ordered_json;

struct Way {
  const char* name;
  Point direction;
};
constexpr std::array<Way, 4> kWays = {
    {{"up", {0, -1}}, {"down", {0, 1}}, {"left", {-1, 0}}, {"right", {1, 0}}}};

// What a camera's pictures and a hand can have.
constexpr double kFarthest_px = 1e6;
constexpr double kLongestLink = 1e6;
constexpr double kLeastLevel = 1e-6;
constexpr double kMostLevel = 1000;

class SkeletonReader {
 public:
  SkeletonReader(const Json& json, std::string place) : reader_(json, place), place_(std::move(place)) {}

  Skeleton read() {
    skeleton_.name = reader_.text("name");
    read_marks(reader_.member("marks"));
    if (skeleton_.kind == MarkKind::colour) {
      read_links(reader_.list("links"));
      if (reader_.has("length_tolerance"))
        skeleton_.length_tolerance = reader_.number_within("length_tolerance", 0.001, 1000);
      if (reader_.has("first_link")) read_first_link(reader_.text("first_link"));
      read_positive(reader_.member("positive_turn"));
    }
    const Json& angles = reader_.list("angles");
    for (std::size_t i = 0; i < angles.size(); ++i) {
      read_angle(angles[i], fmt::format("{}: angle {}", place_, i + 1));
    }
    reader_.done();
    return std::move(skeleton_);
  }

 private:
  std::size_t mark(const Json& name, io::JsonReader& reader) const {
    if (!name.is_string()) reader.fail(fmt::format("{} must be a mark's name in quotes", name.dump()));
    const auto it = std::ranges::find(skeleton_.marks, name.get<std::string>());
    if (it == skeleton_.marks.end()) {
      reader.fail(
          fmt::format("no mark is called {}; there are: {}", name.dump(), fmt::join(skeleton_.marks, ", ")));
    }
    return static_cast<std::size_t>(it - skeleton_.marks.begin());
  }

  void read_marks(const Json& json) {
    io::JsonReader reader(json, place_ + ": marks");
    const std::string kind = reader.text("kind");
    if (kind != "colour" && kind != "printed") reader.fail("\"kind\" must be \"colour\" or \"printed\"");
    skeleton_.kind = kind == "colour" ? MarkKind::colour : MarkKind::printed;
    if (kind == "printed") {
      read_ids(reader);
    } else {
      for (const Json& name : reader.list("names")) {
        if (!name.is_string() || name.get<std::string>().empty())
          reader.fail("\"names\" must be texts in quotes");
        skeleton_.marks.push_back(name.get<std::string>());
      }
      if (std::set<std::string>(skeleton_.marks.begin(), skeleton_.marks.end()).size() !=
          skeleton_.marks.size()) {
        reader.fail("two marks have the same name");
      }
      read_colour(reader);
    }
    reader.done();
  }

  void read_ids(io::JsonReader& reader) {
    if (reader.text("dictionary") != "apriltag_36h11")
      reader.fail("\"dictionary\" must be \"apriltag_36h11\"");
    skeleton_.size_mm = reader.number_within("size_mm", 0.1, 10000);
    const Json ids = reader.member("ids");
    if (!ids.is_object() || ids.size() < 2)
      reader.fail("\"ids\" must name at least two marks: {\"palm\": 0, ...}");
    for (const auto& item : ids.items()) {
      constexpr int kCodes = 587;
      const double number = item.value().is_number_integer() ? item.value().get<double>() : -1;
      if (!(number >= 0 && number < kCodes)) {
        reader.fail(
            fmt::format("the id of \"{}\" must be a whole number from 0 to {}", item.key(), kCodes - 1));
      }
      const int id = static_cast<int>(number);
      if (std::ranges::find(skeleton_.ids, id) != skeleton_.ids.end()) {
        reader.fail(fmt::format("id {} is given to two marks", id));
      }
      skeleton_.marks.push_back(item.key());
      skeleton_.ids.push_back(id);
    }
  }

  void read_colour(io::JsonReader& reader) {
    const Json colour = reader.has("colour") ? reader.member("colour") : Json("automatic");
    if (colour.is_object()) {
      io::JsonReader c(colour, place_ + ": colour");
      ColourModel model;
      const std::vector<double> weight = c.numbers_within("weight_bgr", -1, 1);
      if (weight.size() != 3) c.fail("\"weight_bgr\" must be three numbers");
      std::ranges::copy(weight, model.weight.begin());
      model.level = c.number_within("level", kLeastLevel, kMostLevel);
      model.background = c.number_within("background", -kMostLevel, kMostLevel);
      model.area_px = c.number_within("area_px", 0, kFarthest_px);
      c.done();
      skeleton_.colour = model;
    } else if (colour != "automatic") {
      skeleton_.rgb = rgb(colour, reader);
    }
    const std::vector<double> region = reader.numbers_or_empty("region");
    if (!region.empty()) {
      const bool good = region.size() == 4 && region[0] >= 0 && region[1] >= 0 && region[2] <= 1 &&
                        region[3] <= 1 && region[0] < region[2] && region[1] < region[3];
      if (!good) reader.fail("\"region\" must be left, top, right, bottom as shares of the picture, 0 to 1");
      std::ranges::copy(region, skeleton_.region.begin());
    }
    skeleton_.start.resize(skeleton_.marks.size());
    const Json start = reader.object_or_empty("start");
    for (const auto& item : start.items()) {
      const Json& p = item.value();
      const auto far = [](const Json& v) {
        return !v.is_number() || !(std::abs(v.get<double>()) <= kFarthest_px);
      };
      if (!p.is_array() || p.size() != 2 || far(p[0]) || far(p[1])) {
        reader.fail(fmt::format("the start of \"{}\" must be [x, y] in pixels", item.key()));
      }
      skeleton_.start[mark(Json(item.key()), reader)] = Point{p[0].get<double>(), p[1].get<double>()};
    }
  }

  static std::array<double, 3> rgb(const Json& colour, io::JsonReader& reader) {
    const std::string text = colour.is_string() ? colour.get<std::string>() : "";
    unsigned value = 0;
    const char* end = text.data() + text.size();
    const bool good = text.size() == 7 && text.front() == '#' &&
                      std::from_chars(text.data() + 1, end, value, 16).ptr == end;
    if (!good)
      reader.fail("\"colour\" must be \"automatic\", \"#rrggbb\" or what flexor track --setup writes");
    return {static_cast<double>(value >> 16), static_cast<double>(value >> 8 & 255U),
            static_cast<double>(value & 255U)};
  }

  void read_links(const Json& links) {
    std::set<std::size_t> known;
    for (std::size_t i = 0; i < links.size(); ++i) {
      io::JsonReader reader(Json::object(), fmt::format("{}: link {}", place_, i + 1));
      const Json& l = links[i];
      const bool good = l.is_array() && l.size() == 3 && l[2].is_number() &&
                        l[2].get<double>() >= 1 / kLongestLink && l[2].get<double>() <= kLongestLink;
      if (!good) {
        reader.fail(fmt::format("must be [\"from\", \"to\", length], the length between {:g} and {:g}",
                                1 / kLongestLink, kLongestLink));
      }
      const Link link = {mark(l[0], reader), mark(l[1], reader), l[2].get<double>()};
      if (known.empty()) known.insert(link.from);
      if (!known.contains(link.from)) {
        reader.fail(fmt::format("must begin at a mark that an earlier link reaches, not at {}", l[0].dump()));
      }
      if (!known.insert(link.to).second) reader.fail(fmt::format("{} is reached twice", l[1].dump()));
      skeleton_.links.push_back(link);
    }
    if (known.size() != skeleton_.marks.size()) {
      for (std::size_t m = 0; m < skeleton_.marks.size(); ++m) {
        if (!known.contains(m)) {
          throw io::InputError(
              fmt::format("{}: no link reaches mark \"{}\"; add one", place_, skeleton_.marks[m]));
        }
      }
    }
  }

  void read_first_link(const std::string& way) {
    const auto it = std::ranges::find(kWays, way, &Way::name);
    if (it == kWays.end()) reader_.fail("\"first_link\" must be \"up\", \"down\", \"left\" or \"right\"");
    skeleton_.first_link = it->direction;
  }

  void read_positive(const Json& json) {
    io::JsonReader reader(json, place_ + ": positive_turn");
    PositiveTurn& p = skeleton_.positive;
    if (reader.has("view")) {
      const std::string view = reader.text("view");
      if (view != "clockwise" && view != "counterclockwise") {
        reader.fail("\"view\" must be \"clockwise\" or \"counterclockwise\"");
      }
      p.clockwise = view == "clockwise";
    } else {
      p.by_marks = true;
      p.from = mark(reader.member("from"), reader);
      p.to = mark(reader.member("to"), reader);
      p.toward = mark(reader.member("toward"), reader);
    }
    reader.done();
  }

  void read_angle(const Json& json, const std::string& place) {
    io::JsonReader reader(json, place);
    AngleRule rule;
    rule.name = reader.text("name");
    const auto word = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; };
    if (rule.name.empty() || !std::ranges::all_of(rule.name, word)) {
      reader.fail("\"name\" must be letters, digits and _: it becomes a column");
    }
    for (const Json& name : reader.list("marks")) rule.marks.push_back(mark(name, reader));
    if (skeleton_.kind == MarkKind::printed) {
      if (rule.marks.size() != 2)
        reader.fail("\"marks\" must be two printed marks, on the links beside the joint");
    } else if (rule.marks.size() != 3 && rule.marks.size() != 4) {
      reader.fail("\"marks\" must be three marks, or four: two lines");
    }
    const std::string measure = reader.has("measure") ? reader.text("measure") : "turn";
    if (measure != "turn" && measure != "opening") reader.fail("\"measure\" must be \"turn\" or \"opening\"");
    rule.opening = measure == "opening";
    if (rule.opening && rule.marks.size() != 3) reader.fail("an opening has three marks: [a, corner, c]");
    const std::string turn = reader.has("turn") ? reader.text("turn") : "positive";
    if (turn != "positive" && turn != "negative")
      reader.fail("\"turn\" must be \"positive\" or \"negative\"");
    rule.negative = turn == "negative";
    if (reader.has("offset_deg")) rule.offset_deg = reader.number_within("offset_deg", -360, 360);
    const std::vector<double> range =
        reader.has("range_deg") ? reader.numbers_within("range_deg", -1000, 1000) : std::vector<double>();
    if (!range.empty()) {
      if (range.size() != 2 || !(range[0] < range[1]))
        reader.fail("\"range_deg\" must be [smallest, largest]");
      rule.min_deg = range[0];
      rule.max_deg = range[1];
    }
    reader.done();
    skeleton_.angles.push_back(std::move(rule));
  }

  io::JsonReader reader_;
  std::string place_;
  Skeleton skeleton_;
};

Json marks_json(const Skeleton& s) {
  Json out;
  if (s.kind == MarkKind::printed) {
    out = {{"kind", "printed"}, {"dictionary", "apriltag_36h11"}, {"size_mm", s.size_mm}};
    for (std::size_t m = 0; m < s.marks.size(); ++m) out["ids"][s.marks[m]] = s.ids[m];
    return out;
  }
  out = {{"kind", "colour"}, {"names", s.marks}};
  if (s.colour) {
    out["colour"] = {{"weight_bgr", s.colour->weight},
                     {"level", s.colour->level},
                     {"background", s.colour->background},
                     {"area_px", s.colour->area_px}};
  } else if (s.rgb) {
    out["colour"] = fmt::format("#{:02x}{:02x}{:02x}", static_cast<int>((*s.rgb)[0]),
                                static_cast<int>((*s.rgb)[1]), static_cast<int>((*s.rgb)[2]));
  } else {
    out["colour"] = "automatic";
  }
  if (s.region != std::array<double, 4>{0, 0, 1, 1}) out["region"] = s.region;
  for (std::size_t m = 0; m < s.start.size(); ++m) {
    if (s.start[m]) out["start"][s.marks[m]] = {s.start[m]->x, s.start[m]->y};
  }
  return out;
}

Json skeleton_json(const Skeleton& s) {
  Json out = {{"name", s.name}, {"marks", marks_json(s)}};
  for (const Link& l : s.links) out["links"].push_back({s.marks[l.from], s.marks[l.to], l.length});
  if (s.kind == MarkKind::colour) out["length_tolerance"] = s.length_tolerance;
  if (s.first_link) {
    for (const Way& way : kWays) {
      if (way.direction.x == s.first_link->x && way.direction.y == s.first_link->y)
        out["first_link"] = way.name;
    }
  }
  if (s.kind == MarkKind::colour) {
    const PositiveTurn& p = s.positive;
    out["positive_turn"] =
        p.by_marks ? Json{{"from", s.marks[p.from]}, {"to", s.marks[p.to]}, {"toward", s.marks[p.toward]}}
                   : Json{{"view", p.clockwise ? "clockwise" : "counterclockwise"}};
  }
  for (const AngleRule& rule : s.angles) {
    Json angle = {{"name", rule.name}};
    for (const std::size_t m : rule.marks) angle["marks"].push_back(s.marks[m]);
    if (rule.opening) angle["measure"] = "opening";
    if (rule.negative) angle["turn"] = "negative";
    if (rule.offset_deg != 0) angle["offset_deg"] = rule.offset_deg;
    if (rule.min_deg != -180 || rule.max_deg != 180) angle["range_deg"] = {rule.min_deg, rule.max_deg};
    out["angles"].push_back(std::move(angle));
  }
  return out;
}

}  // namespace

std::vector<double> Skeleton::lengths() const {
  std::vector<double> out;
  for (const Link& l : links) out.push_back(l.length);
  return out;
}

std::size_t Skeleton::mark(const std::string& mark_name) const {
  const auto it = std::ranges::find(marks, mark_name);
  if (it == marks.end()) {
    throw io::InputError(
        fmt::format("no mark is called \"{}\"; there are: {}", mark_name, fmt::join(marks, ", ")));
  }
  return static_cast<std::size_t>(it - marks.begin());
}

Window region_of(const Skeleton& skeleton, const Picture& picture) {
  const auto& r = skeleton.region;
  const int left = static_cast<int>(r[0] * picture.width);
  const int top = static_cast<int>(r[1] * picture.height);
  return {left, top, static_cast<int>(r[2] * picture.width) - left,
          static_cast<int>(r[3] * picture.height) - top};
}

Joints joints_from_json(const std::string& text, const std::string& source) {
  const Json json = io::parse_json(text, source);
  io::JsonReader reader(json, source);
  reader.schema("flexor-joints", 1);
  Joints out;
  out.source = source;
  out.name = reader.text("name");
  out.description = reader.text_or_empty("description");
  const Json& skeletons = reader.list("skeletons");
  std::set<std::string> angles;
  for (std::size_t i = 0; i < skeletons.size(); ++i) {
    out.skeletons.push_back(
        SkeletonReader(skeletons[i], fmt::format("{}: skeleton {}", source, i + 1)).read());
    for (const AngleRule& rule : out.skeletons.back().angles) {
      if (!angles.insert(rule.name).second)
        reader.fail(fmt::format("two angles are called \"{}\"", rule.name));
    }
  }
  reader.done();
  return out;
}

Joints load_joints(const std::filesystem::path& path) {
  return joints_from_json(io::read_document(path), path.string());
}

std::string to_json(const Joints& joints) {
  Json out = {{"schema", "flexor-joints"}, {"schema_version", 1}, {"name", joints.name}};
  if (!joints.description.empty()) out["description"] = joints.description;
  for (const Skeleton& s : joints.skeletons) out["skeletons"].push_back(skeleton_json(s));
  return io::dump(out);
}

}  // namespace flexor::camera
