// The glove's electrical side, equations 1 to 3 of Sensors 2019, 19(18), 3896.
//
//   R1 = flat + k theta                                   kohm; theta is the sensor's bend in degrees
//   V  = V_in R1 / (R1 + R2)                              divider
//   n  = round(1023 V / V_ref), V_in = V_ref              10-bit ADC
//   alpha = ((R2 n / (1023 - n)) - flat) / k              the reading in degrees: the static calibration
// A compensator gets alpha, or the counts, V or R1 where those are what its model reads. Raw sends alpha as it is. The rails
// give values that a compensator's valid range refuses.
#pragma once

#include <cmath>
#include <functional>
#include <string>

#include "host/twin/parameters.hpp"

namespace flexor::twin {

inline constexpr int kAdcTop = 1023;
inline constexpr double kAlphaTop_deg = 1023.9;  // the largest that the fixed-point input holds

class Divider {
 public:
  explicit Divider(const Parameters& parameters);

  // A sensor cannot have less than no resistance.
  int counts(double bend_deg) const {
    const double kohm = flat_kohm_ + kohm_per_deg_ * bend_deg;
    if (kohm <= 0) return 0;
    return static_cast<int>(std::lround(kAdcTop * kohm / (kohm + fixed_kohm_)));
  }

  double alpha_deg(double counts) const;

  // What a model's input reads at counts. `unit`: count, V, mV, ohm, kohm, deg (alpha) or rad. Throws io::InputError naming
  // `input` for another one.
  std::function<double(double counts)> reading(const std::string& unit, const std::string& input) const;

 private:
  double kohm(double counts) const;

  double flat_kohm_;
  double kohm_per_deg_;
  double fixed_kohm_;
  double reference_V_;
};

}  // namespace flexor::twin
