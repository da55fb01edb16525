// Which blocks a chain has, in this order. The blocks and their equations are those of runtime/compensator.
#pragma once

namespace flexor::identify {

struct Structure {
  bool dead_zone = false;   // an input dead zone with fitted edges
  int plays = 0;            // play operators, 0 to 4
  int input_knots = 0;      // input curve, 0 (gain and offset instead) or 2 to 16
  int order = 0;            // poles, 0 to 3
  int output_knots = 0;     // output curve, 0 or 2 to 16
  bool saturation = false;  // fitted saturation limits

  bool operator==(const Structure&) const = default;
};

inline constexpr int kDefaultKnots = 10;
inline constexpr int kDefaultOrder = 2;
inline constexpr int kDefaultPlays = 2;

}  // namespace flexor::identify
