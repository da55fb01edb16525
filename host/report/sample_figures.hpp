// Figures of an identified joint's samples: what the reports of one finger and of a hand share.
#pragma once

#include <string>
#include <vector>

#include "host/report/chart.hpp"
#include "host/report/saved.hpp"

namespace flexor::report {

// Colours that stay apart for colour-blind readers (Okabe, Ito 2008).
inline constexpr const char* kMeasured = "#222222";
inline constexpr const char* kEstimated = "#0072B2";
inline constexpr const char* kBaseline = "#E69F00";
inline constexpr const char* kHeldOut = "#D55E00";

struct Samples {
  std::vector<double> t_s;
  std::vector<double> reading;
  std::vector<double> measured_deg;
  std::vector<double> estimated_deg;
  std::vector<double> line_deg;
  std::vector<double> gap;
  std::vector<double> held_out;
  std::vector<double> pair;  // of recordings that a sample is from; in each t_s starts anew
  std::size_t size() const { return t_s.size(); }
};

// A table of samples that identify has saved, all of pair 1 where it has no such column. Throws io::InputError without
// a held-out part.
Samples read_samples(const Saved& saved, const std::string& file);

// Every so many rows, so that an hour is drawn as quickly as a minute.
std::size_t every(std::size_t rows);

// What is held out, or what was fitted, outside pauses.
struct Part {
  std::vector<double> error_deg;  // estimated minus measured
  std::vector<double> reading;
};
Part part_of(const Samples& samples, bool held_out);

Chart holdout_chart(const std::string& name, const Samples& samples);
Chart curve_chart(const std::string& name, const Samples& samples, const Json& static_map,
                  const std::string& unit);
Chart error_histogram(const std::string& name, const std::vector<double>& fitted,
                      const std::vector<double>& held_out);
Chart error_correlation(const std::string& name, const Part& held, double period_s);

}  // namespace flexor::report
