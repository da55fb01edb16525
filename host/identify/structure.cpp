#include "host/identify/structure.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "host/io/io.hpp"
#include "host/model/model.hpp"
#include "runtime/compensator/lti.hpp"

namespace flexor::identify {

Structure make_structure(Family family, int order, int knots, int plays) {
  Structure s;
  s.family = family;
  if (family == Family::linear) return s;
  s.order = order;
  if (family == Family::linear_dynamic) return s;
  (family == Family::wiener ? s.output_knots : s.input_knots) = knots;
  s.saturation = family == Family::hw || family == Family::hw_hysteresis;
  if (family == Family::hw_hysteresis) s.plays = plays;
  return s;
}

Structure make_dead_zone_structure(int order) {
  Structure s;
  s.family = Family::hw;
  s.dead_zone = true;
  s.order = order;
  s.saturation = true;
  return s;
}

const std::vector<Family>& families() {
  static const std::vector<Family> all = {Family::linear,      Family::linear_dynamic,
                                          Family::hammerstein, Family::wiener,
                                          Family::hw,          Family::hw_hysteresis};
  return all;
}

std::string name(Family family) {
  switch (family) {
    case Family::linear:
      return "linear";
    case Family::linear_dynamic:
      return "linear-dynamic";
    case Family::hammerstein:
      return "hammerstein";
    case Family::wiener:
      return "wiener";
    case Family::hw:
      return "hw";
    case Family::hw_hysteresis:
      return "hw-hysteresis";
  }
  return "";
}

std::string describe(const Structure& s) {
  std::vector<std::string> parts;
  if (s.dead_zone) parts.emplace_back("dead zone");
  if (s.plays > 0) parts.push_back(fmt::format("{} play{}", s.plays, s.plays > 1 ? "s" : ""));
  if (s.input_knots > 0) parts.push_back(fmt::format("{} knots", s.input_knots));
  if (s.order > 0) parts.push_back(fmt::format("order {}", s.order));
  if (s.output_knots > 0) parts.push_back(fmt::format("{} output knots", s.output_knots));
  if (s.monotone) parts.emplace_back("monotone");
  return parts.empty() ? name(s.family) : fmt::format("{}: {}", name(s.family), fmt::join(parts, ", "));
}

void check(const Structure& s) {
  const auto require = [&](bool good, const std::string& rule) {
    if (!good) throw io::InputError(fmt::format("structure {}: {}", name(s.family), rule));
  };
  const auto knots_good = [](int k) { return k == 0 || (k >= 2 && k <= model::kMaxKnots); };
  require(s.order >= 0 && s.order <= compensator::kMaxOrder, "the order must be 0 to 3");
  require(knots_good(s.input_knots) && knots_good(s.output_knots),
          fmt::format("knots must be 2 to {}", model::kMaxKnots));
  require(s.input_knots == 0 || s.output_knots == 0, "has one curve, not two");
  require(s.plays >= 0 && s.plays <= model::kMaxPlays, "plays must be 0 to 4");
  require(s.family != Family::hw_hysteresis || s.plays > 0, "needs at least one play");
  require(s.family == Family::linear || s.input_knots > 0 || s.order > 0, "needs an order of at least 1");
}

}  // namespace flexor::identify
