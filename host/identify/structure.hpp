// Which blocks a compensator has. The blocks and their equations are those of runtime/compensator.
#pragma once

#include <string>
#include <vector>

namespace flexor::identify {

// The families that users choose from.
enum class Family { linear, linear_dynamic, hammerstein, wiener, hw, hw_hysteresis };

struct Structure {
  Family family = Family::hw;
  bool dead_zone = false;   // an input dead zone with fitted edges
  int plays = 0;            // play operators, 0 to 4
  int input_knots = 0;      // input curve, 0 (gain and offset instead) or 2 to 16
  int order = 0;            // poles, 0 to 3
  int output_knots = 0;     // output curve, 0 or 2 to 16
  bool saturation = false;  // fitted saturation limits
  bool monotone = false;    // curves may not turn back

  bool operator==(const Structure&) const = default;
};

inline constexpr int kDefaultKnots = 10;
inline constexpr int kDefaultOrder = 2;
inline constexpr int kDefaultPlays = 2;

// linear:         gain and offset
// linear-dynamic: gain and offset, LTI
// hammerstein:    curve, LTI
// wiener:         LTI, curve
// hw:             curve, LTI, saturation
// hw-hysteresis:  plays, curve, LTI, saturation
Structure make_structure(Family family, int order = kDefaultOrder, int knots = kDefaultKnots,
                         int plays = kDefaultPlays);

// hw with a dead zone, gain and offset in place of the curve: the published structure with fitted edges.
Structure make_dead_zone_structure(int order = 1);

const std::vector<Family>& families();
std::string name(Family family);
// "hw: 10 knots, order 2".
std::string describe(const Structure& structure);

// Throws io::InputError when a number is out of its range or the family cannot have the block.
void check(const Structure& structure);

}  // namespace flexor::identify
