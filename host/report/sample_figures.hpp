// Figures of an identified joint's samples: what the reports of one finger and of a hand share.
#pragma once

#include <string>
#include <vector>

#include "host/report/gnuplot.hpp"
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

// Estimated minus measured outside pauses.
std::vector<double> errors(const Samples& samples, bool held_out);

// What is held out, outside pauses.
struct Held {
  std::vector<double> error_deg;
  std::vector<double> reading;
};
Held held_of(const Samples& samples);

struct Curve {
  Json static_map;   // reading, angle_deg
  Json knots;        // likewise, or null
  std::string unit;  // of the reading; may be empty
};

// Each begins the figure of that name.
void draw_holdout(Gnuplot& g, const std::string& name, const Samples& samples);
void draw_curve(Gnuplot& g, const std::string& name, const Samples& samples, const Curve& curve);
void draw_error_histogram(Gnuplot& g, const std::string& name, const std::vector<double>& fitted,
                          const std::vector<double>& held_out);
void draw_error_correlation(Gnuplot& g, const std::string& name, const Held& held, double period_s);

// Their titles and captions.
Figure holdout_figure(const std::string& name);
Figure curve_figure(const std::string& name);
Figure error_histogram_figure(const std::string& name);
Figure error_correlation_figure(const std::string& name);

}  // namespace flexor::report
