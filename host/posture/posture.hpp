// A posture document: how the joints go together in people's recordings of all 23. Learnt by
// python/flexor/posture_learning.py.
//
// JSON, schema 1. For each person typical hands and how long each was held, and the resting pose; the
// curves that couple DIP to PIP; the limits of each joint. It holds averages, no recording, and names the
// recordings by digest. Errors are io::InputError with the place in the document.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace flexor::posture {

// The 23 joints of a hand, in degrees, as a CyberGlove names and signs them: flexion of the fingers is negative.
inline constexpr int kJoints = 23;
inline constexpr std::array<std::string_view, kJoints> kJointNames = {
    "thumb_rot", "thumb_mcp", "thumb_ip",   "thumb_abd",   "index_mcp",  "index_pip",
    "index_dip", "index_abd", "middle_mcp", "middle_pip",  "middle_dip", "middle_abd",
    "ring_mcp",  "ring_pip",  "ring_dip",   "ring_abd",    "pinky_mcp",  "pinky_pip",
    "pinky_dip", "pinky_abd", "palm_arch",  "wrist_pitch", "wrist_yaw"};

using Hand = Eigen::Array<double, kJoints, 1>;                 // degrees
using Hands = Eigen::Matrix<double, Eigen::Dynamic, kJoints>;  // a hand in each row

inline std::string_view joint_name(int joint) { return kJointNames[static_cast<std::size_t>(joint)]; }
// Whether its flexion is negative here: MCP, PIP, DIP and the thumb's IP.
inline bool flexes(int joint) {
  constexpr std::array kEnds = {"_mcp", "_pip", "_dip", "_ip"};
  return std::ranges::any_of(kEnds, [&](const char* end) { return joint_name(joint).ends_with(end); });
}
// Empty: no such joint.
inline std::optional<int> find_joint(std::string_view name) {
  const auto it = std::ranges::find(kJointNames, name);
  if (it == kJointNames.end()) return std::nullopt;
  return static_cast<int>(it - kJointNames.begin());
}

// A joint that follows another through tendons: DIP and PIP of one finger.
struct Coupling {
  int joint;
  int follows;
};

// How far each joint goes.
struct Limits {
  Hand low_deg;
  Hand high_deg;
};

// What is sensed: the sum of one or several joints, as a sensor that lies over them measures it.
struct Input {
  std::string name;
  std::vector<int> joints;
};

// One row for each input: inputs = matrix * hand.
using InputMatrix = Eigen::Matrix<double, Eigen::Dynamic, kJoints>;
inline InputMatrix input_matrix(const std::vector<Input>& inputs) {
  InputMatrix matrix = InputMatrix::Zero(std::ssize(inputs), kJoints);
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    for (const int joint : inputs[static_cast<std::size_t>(i)].joints) matrix(i, joint) = 1;
  }
  return matrix;
}

// Seconds since the row before: a clock that starts again, or a pause, counts as nothing.
inline double step_s(double before_s, double now_s, double pause_s = 0.5) {
  const double step = now_s - before_s;
  return step > 0 && step <= pause_s ? step : 0;
}

inline constexpr int kSchemaVersion = 1;

// A person's recording as a few typical hands. Averages, not samples: how far the hands of a cell lie from their centre is kept
// as a variance.
struct Codebook {
  Hands centre_deg;         // cells x 23
  Eigen::VectorXd seconds;  // cells, each above 0
  Hand within_deg2;         // variance about the centres
};

struct Person {
  std::string source;  // the file's name without its folder
  std::string digest;
  int rows = 0;
  Hand rest_deg;
  Codebook book;
  double seconds() const { return book.seconds.sum(); }
};

// angle = curve(angle of the joint that is followed), straight between knots, level beyond them.
struct CoupledCurve {
  Coupling coupling;
  std::vector<double> knot_deg;  // ascending, at least two
  std::vector<double> value_deg;
  double sd_deg = 0;  // standard error (regression.hpp) on people that the curve was not fitted to
  double at(double angle_deg) const;
};

struct Posture {
  std::string written_by;
  std::uint64_t seed = 0;
  std::vector<Person> people;  // at least three
  std::vector<CoupledCurve> curves;
  Limits limits;
};

Posture parse(const std::string& text, const std::string& source);
Posture load(const std::filesystem::path& path);

}  // namespace flexor::posture
