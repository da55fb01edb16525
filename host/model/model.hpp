// The model document: a compensator as a graph of blocks between named signals. Units are in the names.
//
// JSON: {"schema": "flexor-model", "schema_version": 2, "written_by", "name", "description",
//        "sample_period_s", "max_gap_s" (may be left out),
//        "inputs": [{"name", "column", "unit", "strip", "valid_min", "valid_max",
//                    "poses": {"open", "fist"}, "turns": {"open", "fist"}, "readings": {"share": [], "reading": []},
//                    "donnings": {"recordings", "shift_sd", "log_gain_sd"}   (these four may be left out)
//                   }],   a sensor's signal each
//        "blocks": [{"type", "from": "signal" or ["signal", ...], "to": "signal", ...}],
//        "joints": [{"name", "from", "rest_deg", "accuracy": {"angle_deg": [], "standard_error_deg": []},
//                    "ends": {"open_deg", "fist_deg"}   (these two may be left out)}],
//        "training": {...}, "fit": {...}}
// A block takes signals of inputs and of blocks before it; each name is given once. A joint's signal comes from a
// saturation. Kinds of blocks and their members: kinds.hpp, lti.hpp. Sample periods: 10 us to
// 100 s. Valid ranges are at least a millionth of their largest reading wide. Every signal stays within 1e9
// either way for all valid readings, what enters a joint's saturation within 1e5 degrees.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/model/block.hpp"

namespace flexor::model {

inline constexpr int kSchemaVersion = 2;
inline constexpr double kMaxUnlimited_deg = 1e5;  // before a joint's saturation
inline constexpr double kMinPeriod_s = 1e-5;
inline constexpr double kMaxPeriod_s = 100;
inline constexpr std::size_t kMaxBlocks = 500;  // and inputs, and joints
inline constexpr std::size_t kMaxName = 100;
inline constexpr Bounds kNameLength = {1, kMaxName};
inline constexpr Bounds kListLength = {1, kMaxBlocks};

// What a sensor reads at the open hand and at the fist, where the model was made.
struct Poses {
  double open = 0;
  double fist = 0;
  static constexpr auto members() {
    return std::tuple(required("open", &Poses::open), required("fist", &Poses::fist));
  }
  bool operator==(const Poses&) const = default;
};

// What a sensor read where the model was made: `reading[i]` was not exceeded by `share[i]` of the samples. What later
// recordings are compared with.
struct Spread {
  std::vector<double> share;    // increasing, between 0 and 1
  std::vector<double> reading;  // not decreasing, the last above the first
  static constexpr auto members() {
    return std::tuple(required("share", &Spread::share, Bounds{2, kMaxKnots}),
                      required("reading", &Spread::reading, Bounds{2, kMaxKnots}));
  }
  double span() const { return reading.back() - reading.front(); }
  double middle() const { return (reading.back() + reading.front()) / 2; }
  bool operator==(const Spread&) const = default;
};

// How the recordings of a model of several differ in what a sensor reads: standard deviations over them, of the shift in
// the input's unit and of the logarithm of the gain.
struct DonningSpread {
  int recordings = 0;  // two or more
  double shift_sd = 0;
  double log_gain_sd = 0;
  static constexpr auto members() {
    return std::tuple(required("recordings", &DonningSpread::recordings, Bounds{2, 1000000}),
                      required("shift_sd", &DonningSpread::shift_sd, Bounds{0, kMaxSignal}),
                      required("log_gain_sd", &DonningSpread::log_gain_sd, Bounds{0, 10}));
  }
  bool operator==(const DonningSpread&) const = default;
};

struct Input {
  std::string name;    // of its signal
  std::string column;  // the recording's column that feeds it; empty: the one called like it
  std::string unit;
  std::string strip;     // the finger whose sensor it is on the glove's board; may be empty
  double valid_min = 0;  // readings outside are refused with a status
  double valid_max = 1023;
  std::optional<Poses> poses = {};
  std::optional<Poses> turns = {};  // where whole bends turn, as a tracker sees them (tracking.hpp)
  std::optional<Spread> readings = {};
  std::optional<DonningSpread> donnings = {};
  static constexpr auto members() {
    return std::tuple(required("name", &Input::name, kNameLength), defaulted("column", &Input::column),
                      defaulted("unit", &Input::unit), defaulted("strip", &Input::strip),
                      required("valid_min", &Input::valid_min), required("valid_max", &Input::valid_max),
                      defaulted("poses", &Input::poses), defaulted("turns", &Input::turns),
                      defaulted("readings", &Input::readings), defaulted("donnings", &Input::donnings));
  }
  bool operator==(const Input&) const = default;
};

// What an angle is known to: the error to expect on another part of the motion (host/identify/additive.hpp), by the angle;
// straight lines between, constant beyond.
struct Accuracy {
  std::vector<double> angle_deg;           // increasing
  std::vector<double> standard_error_deg;  // above zero
  static constexpr auto members() {
    return std::tuple(required("angle_deg", &Accuracy::angle_deg, Bounds{1, kMaxKnots}),
                      required("standard_error_deg", &Accuracy::standard_error_deg, Bounds{1, kMaxKnots}));
  }
  double at(double angle) const;
  double root_mean_square() const;
  bool operator==(const Accuracy&) const = default;
};

// Of a joint at the open hand and at the fist, in its own convention: it may close towards smaller angles. Whatever has another
// convention (the page, VR, a bionic hand) maps through these two.
struct Ends {
  double open_deg = 0;
  double fist_deg = 90;
  static constexpr auto members() {
    return std::tuple(required("open_deg", &Ends::open_deg), required("fist_deg", &Ends::fist_deg));
  }
  bool operator==(const Ends&) const = default;
};
inline constexpr double kLeastEnds_deg = 1;  // apart

struct Joint {
  std::string name;     // index, index_mcp, thumb_cmc, ...
  std::string from;     // a saturation's signal
  double rest_deg = 0;  // before the first good sample
  std::optional<Accuracy> accuracy = {};
  std::optional<Ends> ends = {};
  static constexpr auto members() {
    return std::tuple(required("name", &Joint::name, kNameLength),
                      required("from", &Joint::from, kNameLength), required("rest_deg", &Joint::rest_deg),
                      defaulted("accuracy", &Joint::accuracy), defaulted("ends", &Joint::ends));
  }
  bool operator==(const Joint&) const = default;
};

struct Model {
  std::string name;
  std::string description;
  std::string written_by;
  double sample_period_s = 0;
  double max_gap_s = 0;  // a reading older than this is a pause of the log; 0: not stated
  std::vector<Input> inputs;
  std::vector<Block> blocks;
  std::vector<Joint> joints;
  Json training = Json::object();  // files, digests, split
  Json fit = Json::object();       // figures and standard errors
  static constexpr auto members() {
    return std::tuple(
        defaulted("written_by", &Model::written_by), defaulted("name", &Model::name),
        defaulted("description", &Model::description),
        required("sample_period_s", &Model::sample_period_s, Bounds{kMinPeriod_s, kMaxPeriod_s}),
        defaulted("max_gap_s", &Model::max_gap_s, Bounds{0}), required("inputs", &Model::inputs, kListLength),
        required("blocks", &Model::blocks, kListLength), required("joints", &Model::joints, kListLength),
        defaulted("training", &Model::training), defaulted("fit", &Model::fit));
  }
  bool operator==(const Model&) const = default;
};

// thumb index middle ring pinky.
const std::vector<std::string>& finger_names();

// The finger that `name` means; "pointer" is index and "little" is pinky. Throws io::InputError otherwise.
std::string finger(std::string_view name);

// Whether a signal may be called so: 1 to 100 bytes, no control characters.
bool is_name(std::string_view name);

// The joint's name as it is kept: letters, digits and underscores; "pointer" and "little" as above, also before an
// underscore. Throws io::InputError.
std::string joint_name(std::string_view name);

// The column of a recording that feeds each input: as `given` names them in order, or where it is empty as the model does.
// Throws io::InputError where `given` has another number.
std::vector<std::string> columns_of(const Model& model, const std::vector<std::string>& given);

// A graph in numbers: block b takes `from[b]`, signal inputs.size() + b is its own.
struct Graph {
  explicit Graph(const Model& model);  // throws io::InputError for names that do not fit together

  std::vector<std::vector<std::size_t>> from;
  std::vector<std::size_t> joint;                // its signal
  std::vector<std::vector<std::size_t>> inputs;  // that each signal depends on, ascending
  std::vector<Interval> values;                  // of each signal

  // Of each signal whether one of these depends on it, or is it.
  std::vector<bool> needed_for(const std::vector<std::size_t>& signals) const;
};

const Saturation& limits(const Model& model, const Joint& joint);

// As the joint states them; else the open hand is at the angle of its limits that is nearest to zero, the fist at the limit
// farther from that.
Ends ends(const Model& model, const Joint& joint);

// Throws io::InputError, one line naming block and the mend, when the document breaks a rule above.
void check(const Model& model);

std::string to_json(const Model& model);

// JSON Schema of the document, from the tables that read it. What compares numbers or names is checked on reading alone.
std::string schema_json();

// In words: its blocks as a tree before each joint, their limits, and what it erred by.
std::string diagram(const Model& model);

// `source` names the text in errors. Throws io::InputError.
Model from_json(const std::string& text, const std::string& source);

Model load(const std::filesystem::path& path);
void save(const Model& model, const std::filesystem::path& path);

}  // namespace flexor::model
