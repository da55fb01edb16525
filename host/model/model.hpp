// The model document: what a compensator is, for people and programs. Units are in the names.
//
// JSON: {"schema": "flexor-model", "schema_version": 1, "written_by", "name", "description",
//        "sample_period_s", "max_gap_s" (may be left out), "channels": [{"name", "input": {"column", "unit",
//        "valid_min", "valid_max"}, "rest_deg", "blocks": [...]}], "training": {...}, "fit": {...}}
// blocks, in this order, all but the last optional:
//   {"type": "dead_zone", "lower", "upper"}
//   {"type": "hysteresis", "radii": [...], "weights": [...]}
//   {"type": "curve", "x": [...], "y": [...]}
//   {"type": "lti", "gain", "offset", "poles_rad_s": [...], "taps": [...]}
//   {"type": "curve", ...}                               the output curve, only after an lti
//   {"type": "saturation", "lower_deg", "upper_deg"}
// The equations are those of runtime/compensator, block by block. Each block may come once, the curve once on
// either side of the lti; a repeated or misplaced block is refused by its place.
//
// Numbers that no glove, hand or sensor has are refused, so that every accepted model gives finite angles in
// double and float (kMax..., kMin... below):
//   every angle (saturation, rest, what a curve says once gain and offset have carried it to degrees)
//                        at most 1000 degrees either way
//   readings (valid range, dead zone, radii, knots)        at most 1e9 either way, in any unit
//   the valid range, the range of a curve's knots          at least a millionth of the largest reading in it
//   neighbouring knots   at least a millionth of the largest |x| apart; that and the angles bound the slopes
//   gain, offset         without a curve: |gain u| + |offset| at most 1e5 degrees over the valid range;
//                        before an output curve, where the unit is the curve's own, at most 1e9
//   poles                |pole| times the sample period from 1e-9 to 1e3; taps at most 1000 either way
//   sample period        10 us to 100 s
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace flexor::model {

inline constexpr int kSchemaVersion = 1;
inline constexpr int kMaxPlays = 4;
inline constexpr int kMaxKnots = 16;
inline constexpr double kMaxAngle_deg = 1000;
inline constexpr double kMaxLinear_deg = 1e5;  // before the saturation, without a curve
inline constexpr double kMaxReading = 1e9;     // in the input's unit
inline constexpr double kMinReadingRange = 1e-20;
inline constexpr double kMinRelativeRange = 1e-6;  // of the largest reading in it
inline constexpr double kMinKnotSpacing = 1e-6;    // of the largest |x|
inline constexpr double kMinPoleTimesPeriod = 1e-9;
inline constexpr double kMaxPoleTimesPeriod = 1e3;
inline constexpr double kMaxTap = 1000;
inline constexpr double kMinPeriod_s = 1e-5;
inline constexpr double kMaxPeriod_s = 100;

struct DeadZone {
  double lower = 0;  // in the input's unit, lower <= upper
  double upper = 0;
  bool operator==(const DeadZone&) const = default;
};

struct Hysteresis {
  std::vector<double> radii;    // in the input's unit, >= 0; at most kMaxPlays
  std::vector<double> weights;  // |w| < 8; as many
  bool operator==(const Hysteresis&) const = default;
};

struct Curve {
  std::vector<double> x;  // strictly increasing, 2 to kMaxKnots
  std::vector<double> y;  // as many
  bool operator==(const Curve&) const = default;
};

// H(s) = gain (c_0 + c_1 H_1 + ... + (1 - sum c) H_n), H_i = prod_{j<=i} a_j / (s + a_j), poles -a_j;
// `offset` is added before the lags. No poles: a static gain and offset.
struct Lti {
  double gain = 1;
  double offset = 0;
  std::vector<double> poles_rad_s;  // negative; at most 3
  std::vector<double> taps;         // c_0 .. c_{n-1}; empty: all zero
  bool operator==(const Lti&) const = default;
};

struct Saturation {
  double lower_deg = 0;  // lower_deg < upper_deg
  double upper_deg = 0;
  bool operator==(const Saturation&) const = default;
};

struct Channel {
  std::string name;          // one of finger_names()
  std::string input_column;  // the recording's column that feeds it; may be empty
  std::string input_unit;
  double valid_min = 0;  // inputs outside are refused with a status
  double valid_max = 1023;
  double rest_deg = 0;  // output before the first good sample
  std::optional<DeadZone> dead_zone;
  std::optional<Hysteresis> hysteresis;
  std::optional<Curve> input_curve;
  Lti lti;
  std::optional<Curve> output_curve;
  Saturation saturation;
  bool operator==(const Channel&) const = default;
};

struct Model {
  std::string name;
  std::string description;
  std::string written_by;
  double sample_period_s = 0;
  double max_gap_s = 0;  // a reading older than this is a pause of the log; 0: not stated
  std::vector<Channel> channels;
  nlohmann::ordered_json training = nlohmann::ordered_json::object();  // files, digests, split
  nlohmann::ordered_json fit = nlohmann::ordered_json::object();       // figures and standard errors
  bool operator==(const Model&) const = default;
};

// thumb index middle ring pinky.
const std::vector<std::string>& finger_names();

// The finger that `name` means; "pointer" is index and "little" is pinky. Throws io::InputError otherwise.
std::string finger(std::string_view name);

// Throws io::InputError, one line naming channel, block and the mend, when the document breaks a rule above.
void check(const Model& model);

std::string to_json(const Model& model);

// `source` names the text in errors. Throws io::InputError.
Model from_json(const std::string& text, const std::string& source);

Model load(const std::filesystem::path& path);
void save(const Model& model, const std::filesystem::path& path);

}  // namespace flexor::model
