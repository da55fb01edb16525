// A posture document: what people's recordings of all 23 joints say of how the joints go together. Learnt by
// python/flexor/posture_learning.py.
//
// JSON, schema 1. For each person typical hands and how long each was held, and the resting pose; the
// curves that couple DIP to PIP; the limits of each joint. It holds averages, no recording, and names the
// recordings by digest. Errors are io::InputError with the place in the document.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "host/posture/joints.hpp"

namespace flexor::posture {

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
