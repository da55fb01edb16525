// Recordings of all 23 joints, one for each person, to a posture document.
//
// A person's resting pose is the mean of the first kRest_s of each trial; a trial begins where the clock starts again.
// Typical hands are the centres of Lloyd's algorithm (1982).
// The coupled curves (DIP over PIP) are straight between knots every 10 degrees, by least squares with a prior that
// they do not bend; their error is that of curves that were fitted to the other people.
#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "host/posture/posture.hpp"

namespace flexor::posture {

inline constexpr double kRest_s = 0.25;
inline constexpr int kCells = 80;

// What a file says: a row for each of the table's.
struct Recorded {
  std::string source;
  std::string digest;
  Hands hands_deg;
  std::vector<double> t_s;
};

// Needs NAME_deg of all 23 joints, none missing. Throws io::InputError as recording::CsvReader does.
Recorded read_recorded(const std::filesystem::path& file);

// Of `total_s` seconds of motion; every hand counts the same, as in a root mean square error over the rows. At most `cells` cells; the
// same seed, the same cells.
Codebook make_codebook(const Hands& hands_deg, double total_s, int cells, std::uint64_t seed);

// Throws io::InputError: fewer than three people, one of them twice.
// `progress` is called with what goes on; it may throw to stop.
Posture learn(const std::vector<Recorded>& people, std::uint64_t seed,
              const std::function<void(const std::string&, std::size_t, std::size_t)>& progress);

}  // namespace flexor::posture
