// Uneven samples onto a uniform grid.
#pragma once

#include <cstdint>

#include "host/recording/recording.hpp"

namespace flexor::recording {

struct Grid {
  double start_s = 0;
  double period_s = 0;
  std::size_t size = 0;

  double time(std::size_t k) const { return start_s + static_cast<double>(k) * period_s; }
};

struct Resampled {
  std::vector<double> value;  // one for each grid point, always finite
  std::vector<std::uint8_t>
      gap;  // 1 where the nearest samples are more than max_gap_s apart, or there are none
};

// Grid point k gets the mean of the samples within half a period of it; where there are none, the straight
// line between its neighbours; outside the recording, the nearest sample. Series has at least one sample.
Resampled resample(const Series& series, const Grid& grid, double max_gap_s);

// Seconds since the first sample, rounded to microseconds: what is computed from them does not depend on
// where the clock started, not even where a time falls exactly between two grid points.
std::vector<double> since_start(std::span<const double> t_s);

// What counts as a pause of this log: five median steps, at least 0.3 s.
double default_max_gap_s(std::span<const double> t_s);

}  // namespace flexor::recording
