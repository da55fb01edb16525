// The structure of a joint's compensator as text.
//
//   structure = [ "mix > " ] ( auto | shorthand | term { "+" term } )
//   term      = block { ">" block }
//   block     = name [ "(" number ")" ]
//
// A sum of curves, fitted as additive.hpp says; all of them have the same number of knots:
//   curve(20)                  of the reading
//   play(0.08) > curve(20)     of the reading through a play, its radius a share of the reading's range
//   motion(0.3)                of the reading, minus itself through a lag of so many seconds
//   open                       the angle goes on beyond the farthest that was seen; without it it stops there. auto, line-lead, curve
//                              and hysteresis try both
// A chain with dynamics, fitted as fit.hpp says, with blocks in this order, each at most once:
//   lag(0.2) > dead-zone > hysteresis(2) > curve(10) > lti(2) > saturation
//   hysteresis: so many plays; lti: so many real poles, pair in its place: two complex ones; the curve may stand behind them, or
//   on both sides, or a gain in its place; a lag without a number is searched, and without a curve a gain is meant.
// mix: of several sensors, whose readings become one by weights that are fitted first; the structure is then as of one sensor. auto of
// several sensors tries that as well, the sum of each sensor's curves and the own sensor alone.
// Shorthands: limited-line, line-lead, curve, hysteresis are sums; line (by least squares, of one sensor), linear-dynamic,
// hammerstein, wiener, hw, wh, hysteresis-hw are chains.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "host/identify/additive.hpp"
#include "host/identify/predictor.hpp"
#include "host/score/judge.hpp"

namespace flexor::identify {

struct Chain {
  bool lag = false;             // a first-order lag of the reading before all else
  std::optional<double> lag_s;  // none: searched
  Structure blocks;

  bool operator==(const Chain&) const = default;
};

// What stands behind "mix >", where the text begins so.
std::optional<std::string_view> behind_mix(std::string_view text);

using WantedStructure = std::variant<Candidates, Chain>;

// Of a joint with so many sensors. Throws io::InputError pointing at the character that has no meaning.
WantedStructure parse_structure(std::string_view text, std::size_t sensors);

// The article's: an input dead zone, a pole, limits.
inline constexpr std::string_view kPublishedForm = score::kBaselines.back().structure;
// Of a chain's text.
inline Structure blocks_of(std::string_view chain) {
  return std::get<Chain>(parse_structure(chain, 1)).blocks;
}

// The text that stands for it.
std::string text_of(const Structure& blocks);
std::string text_of(const Branches& branches);
std::string text_of(const Chain& chain);

}  // namespace flexor::identify
