#include "host/study/twin_prior.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "host/model/channel.hpp"
#include "host/study/catalogue.hpp"

namespace flexor::study {
namespace {

constexpr double kPlacementDeviation_deg = 16;
constexpr double kPlacementReach_deg = 45;

// The input at which a published compensator settles at angle_deg.
double inverse(const model::Channel& c, double angle_deg) {
  return angle_deg / c.lti.gain + (c.dead_zone ? c.dead_zone->upper : 0);
}

std::vector<FreeParameter> make_free_parameters() {
  const Compensator w = compensator("published-w", kPublishedRate_hz);
  const Compensator hw = compensator("published-hw", kPublishedRate_hz);
  const twin::Parameters p;
  std::vector<FreeParameter> out;
  for (const bool upper : {false, true}) {
    for (std::size_t i = 0; i < kFingers; ++i) {
      const double angle_deg = upper ? p.hand_upper_deg[i] : p.hand_lower_deg[i];
      const double implied = (inverse(*model::channel(w.model, i), angle_deg) +
                              inverse(*model::channel(hw.model, i), angle_deg)) /
                             2;
      out.push_back(
          {fmt::format("placement.bend_{}_deg.{}", upper ? "upper" : "lower", model::finger_names()[i]),
           implied, kPlacementDeviation_deg, false, implied - kPlacementReach_deg,
           implied + kPlacementReach_deg,
           "the published compensators answer rightly there, and differ by as much"});
    }
  }
  out.push_back({"loop.integral_limit", 60, std::nullopt, true, 0.2, 120,
                 "full duties; from a cautious anti-windup to none, the article names none"});
  out.push_back({"loop.integral_per_deg_s", 0.1, std::log(2.5), true, 0.002, 0.5,
                 "an integral time of half a second beside the proportional gain, in two of three loops from "
                 "0.2 to 1.25 s"});
  out.push_back(
      {"cloth.slip_deg", 1, std::log(2), true, 0.2, 6, "cloth on skin gives by half to two degrees"});
  out.push_back({"cloth.creep_share", 0.03, std::log(2), true, 0.005, 0.15,
                 "fabric and film creep by some percent of a bend"});
  out.push_back({"person.rest_s", 15, std::log(3), true, 0.5, 120,
                 "the first pose is held while somebody starts two cameras: seconds to a minute"});
  out.push_back({"person.pose_spread_deg", 0.5, std::log(3), true, 0.05, 5,
                 "a pose is met again to a degree or two; the best published trial leaves a tenth"});
  return out;
}

double four_digits(double value) {
  const std::string text = fmt::format("{:.4g}", value);
  double out = value;
  std::from_chars(text.data(), text.data() + text.size(), out);
  return out;
}

// Inverse of the normal distribution's integral, by bisection: a table's entries need no more.
double normal_quantile(double share) {
  double low = -8;
  double high = 8;
  for (int k = 0; k < 60; ++k) {
    const double middle = (low + high) / 2;
    (0.5 * std::erfc(-middle / std::sqrt(2.0)) < share ? low : high) = middle;
  }
  return (low + high) / 2;
}

}  // namespace

double FreeParameter::coordinate(double value) const { return is_log ? std::log(value) : value; }

double FreeParameter::value(double coordinate) const {
  return std::clamp(is_log ? std::exp(coordinate) : coordinate, min, max);
}

double FreeParameter::log_prior(double value) const {
  if (!(value >= min && value <= max)) return -std::numeric_limits<double>::infinity();
  if (!deviation) return 0;
  const double z = (coordinate(value) - coordinate(median)) / *deviation;
  return -z * z / 2;
}

double FreeParameter::quantile(double share) const {
  if (deviation) return value(coordinate(median) + *deviation * normal_quantile(share));
  return value(coordinate(min) + share * (coordinate(max) - coordinate(min)));
}

const std::vector<FreeParameter>& free_parameters() {
  static const std::vector<FreeParameter> out = make_free_parameters();
  return out;
}

twin::Parameters with_values(const twin::Parameters& base, std::span<const double> values) {
  twin::Parameters p = base;
  for (std::size_t i = 0; i < values.size(); ++i) {
    twin::assign(p, fmt::format("{}={}", free_parameters()[i].name, four_digits(values[i])));
  }
  return p;
}

std::vector<double> values_of(const twin::Parameters& p) {
  std::vector<double> out;
  for (const FreeParameter& f : free_parameters()) out.push_back(model::value(twin::numbers(p), f.name));
  return out;
}

double log_prior(std::span<const double> values) {
  double sum = 0;
  for (std::size_t i = 0; i < values.size(); ++i) sum += free_parameters()[i].log_prior(values[i]);
  for (std::size_t i = 0; i < kFingers; ++i) {
    if (values[i] >= values[i + kFingers]) return -std::numeric_limits<double>::infinity();
  }
  return sum;
}

}  // namespace flexor::study
