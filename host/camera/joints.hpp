// Which marks there are and what angles they make: a joint file.
//
//   {"schema": "flexor-joints", "schema_version": 1, "name", "description",
//    "skeletons": [{
//      "name": "hand",
//      "marks": {"kind": "colour", "names": [...], "colour": "automatic" | "#30a040" | {"weight", ...},
//                "region": [left, top, right, bottom] as shares of the picture, "start": {NAME: [x, y], ...}}
//            or {"kind": "printed", "dictionary": "apriltag_36h11", "size_mm": 12, "ids": {NAME: 0, ...}},
//      "links": [[FROM, TO, length], ...],                lengths relative to each other; colour only
//      "length_tolerance": 0.35,      of a length's logarithm; smaller if this hand was measured
//      "first_link": "up" | "down" | "left" | "right",    where it points in the picture, if that is known
//      "positive_turn": {"from", "to", "toward"} or {"view": "clockwise" | "counterclockwise"},
//      "angles": [{"name", "marks": [a, b, c] or [a, b, c, d], "measure": "turn" | "opening",
//                  "turn": "positive" | "negative", "offset_deg", "range_deg": [min, max]}, ...]}]}
//
// angle(a, b, c) is the turn from the line a -> b to the line b -> c, of four marks from a -> b to c -> d:
// zero when straight. Its sign: a turn is positive in the sense in which the line from -> to turns towards
// the mark `toward` by the shorter way; then it does not matter whether the picture is rotated or mirrored.
// With "turn": "negative" the joint flexes the other way, as a thumb does. An opening is the angle between b
// -> a and b -> c, 0 to 180. offset_deg is added: another reference line, or a printed mark that was stuck on
// askew.
//
// Lengths lie between 1e-6 and 1e6, tolerances between 0.001 and 1000, offsets within 360 and ranges within
// 1000 degrees, places in pictures within 1e6 pixels, levels within 1000, weights within 1, printed marks
// between 0.1 and 10000 mm.
//
// Two hands, glove and bionic, in one picture: two skeletons with colours or regions of their own.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "host/camera/colour.hpp"
#include "host/camera/picture.hpp"

namespace flexor::camera {

struct Link {
  std::size_t from = 0;
  std::size_t to = 0;
  double length = 1;
};

struct AngleRule {
  std::string name;
  std::vector<std::size_t> marks;  // 3 or 4; of printed marks 2
  bool opening = false;
  bool negative = false;
  double offset_deg = 0;
  double min_deg = -180;
  double max_deg = 180;
};

// The sense in which a turn is positive.
struct PositiveTurn {
  bool clockwise = true;  // as seen in the picture; without marks
  bool by_marks = false;
  std::size_t from = 0;
  std::size_t to = 0;
  std::size_t toward = 0;
};

enum class MarkKind { colour, printed };

struct Skeleton {
  std::string name;
  MarkKind kind = MarkKind::colour;
  std::vector<std::string> marks;
  std::vector<AngleRule> angles;
  PositiveTurn positive;
  // colour
  std::optional<ColourModel> colour;         // learnt before
  std::optional<std::array<double, 3>> rgb;  // as given
  double length_tolerance = 0.35;
  std::optional<Point> first_link;          // unit vector along which it points, roughly
  std::vector<Link> links;                  // each joins a new mark to one that is named before
  std::vector<std::optional<Point>> start;  // where marks are in the first picture, if it was given
  std::array<double, 4> region = {0, 0, 1, 1};
  // printed
  std::vector<int> ids;
  double size_mm = 0;

  // Of the links, as the file has them.
  std::vector<double> lengths() const;
  // Throws io::InputError, listing the marks there are.
  std::size_t mark(const std::string& mark_name) const;
};

// Of the picture, in pixels.
Window region_of(const Skeleton& skeleton, const Picture& picture);

struct Joints {
  std::string source;
  std::string document;  // what was read
  std::string name;
  std::vector<Skeleton> skeletons;
};

// Throws io::InputError naming file and place.
Joints load_joints(const std::filesystem::path& path);
Joints joints_from_json(const std::string& text, const std::string& source);
// The document with what is learnt about a video: colours, start positions, tolerances of lengths.
std::string to_json(const Joints& joints);

}  // namespace flexor::camera
