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

// What a camera's pictures and a hand can have.
constexpr double kFarthest_px = 1e6;
constexpr double kLongestLink = 1e6;
constexpr double kLeastLevel = 1e-6;
constexpr double kMostLevel = 1000;

// Which of `words` a member is; the first where it is left out.
std::size_t choice(io::JsonReader& reader, const char* key, const std::vector<std::string>& words) {
  if (!reader.has(key)) return 0;
  const auto it = std::ranges::find(words, reader.text(key));
  if (it == words.end()) reader.fail(fmt::format("\"{}\" must be \"{}\"", key, fmt::join(words, "\" or \"")));
  return static_cast<std::size_t>(it - words.begin());
}

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
      if (reader_.has("first_link")) {
        static const std::array<Point, 4> kWays = {Point{0, -1}, {0, 1}, {-1, 0}, {1, 0}};
        skeleton_.first_link = kWays.at(choice(reader_, "first_link", {"up", "down", "left", "right"}));
      }
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
    try {
      return skeleton_.mark(name.get<std::string>());
    } catch (const io::InputError& error) {
      reader.fail(error.what());
    }
  }

  void read_marks(const Json& json) {
    io::JsonReader reader(json, place_ + ": marks");
    (void)reader.member("kind");
    skeleton_.kind =
        choice(reader, "kind", {"colour", "printed"}) == 0 ? MarkKind::colour : MarkKind::printed;
    if (skeleton_.kind == MarkKind::printed) {
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
    (void)reader.member("dictionary");
    (void)choice(reader, "dictionary", {"apriltag_36h11"});
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
    for (std::size_t m = 0; m < skeleton_.marks.size(); ++m) {
      if (!known.contains(m))
        reader_.fail(fmt::format("no link reaches mark \"{}\"; add one", skeleton_.marks[m]));
    }
  }

  void read_positive(const Json& json) {
    io::JsonReader reader(json, place_ + ": positive_turn");
    PositiveTurn& p = skeleton_.positive;
    if (reader.has("view")) {
      p.clockwise = choice(reader, "view", {"clockwise", "counterclockwise"}) == 0;
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
    rule.opening = choice(reader, "measure", {"turn", "opening"}) == 1;
    if (rule.opening && rule.marks.size() != 3) reader.fail("an opening has three marks: [a, corner, c]");
    rule.negative = choice(reader, "turn", {"positive", "negative"}) == 1;
    if (reader.has("offset_deg")) rule.offset_deg = reader.number_within("offset_deg", -360, 360);
    if (reader.has("range_deg")) {
      const std::vector<double> range = reader.numbers_within("range_deg", -1000, 1000);
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

}  // namespace

std::vector<double> Skeleton::lengths() const {
  std::vector<double> out;
  for (const Link& l : links) out.push_back(l.length);
  return out;
}

std::size_t Skeleton::mark(const std::string& mark_name) const {
  const auto it = std::ranges::find(marks, mark_name);
  if (it == marks.end()) {
    throw io::InputError("no mark is called \"{}\"; there are: {}", mark_name, fmt::join(marks, ", "));
  }
  return static_cast<std::size_t>(it - marks.begin());
}

Window region_of(const Skeleton& skeleton, const Picture& picture) {
  const auto& r = skeleton.region;
  const int left = static_cast<int>(r[0] * picture.cols);
  const int top = static_cast<int>(r[1] * picture.rows);
  return {left, top, static_cast<int>(r[2] * picture.cols) - left,
          static_cast<int>(r[3] * picture.rows) - top};
}

Joints joints_from_json(const std::string& text, const std::string& source) {
  const Json json = io::parse_json(text, source);
  io::JsonReader reader(json, source);
  reader.schema("flexor-joints", 1);
  Joints out{source, text, reader.text("name"), {}};
  (void)reader.text_or_empty("description");
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
  Json out = Json::parse(joints.document);
  for (std::size_t i = 0; i < joints.skeletons.size(); ++i) {
    const Skeleton& s = joints.skeletons[i];
    if (s.kind == MarkKind::printed) continue;
    out["skeletons"][i]["length_tolerance"] = s.length_tolerance;
    Json& marks = out["skeletons"][i]["marks"];
    if (s.colour) {
      marks["colour"] = {{"weight_bgr", s.colour->weight},
                         {"level", s.colour->level},
                         {"background", s.colour->background},
                         {"area_px", s.colour->area_px}};
    }
    for (std::size_t m = 0; m < s.start.size(); ++m) {
      if (s.start[m]) marks["start"][s.marks[m]] = {s.start[m]->x, s.start[m]->y};
    }
  }
  return io::dump(out);
}

}  // namespace flexor::camera
