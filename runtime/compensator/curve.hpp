// Piecewise-linear static curve through knots (x_i, y_i), held constant outside the first and last knot.
//
//   f(u) = y_i + s_i (u - x_i)   for x_i <= u < x_{i+1},   s_i = (y_{i+1} - y_i) / (x_{i+1} - x_i)
//   f(u) = y_0 for u <= x_0,   f(u) = y_{n-1} for u >= x_{n-1}
//
// x strictly increasing, 2 <= count <= kCapacity.
#pragma once

#include "runtime/core/fixed_point.hpp"

namespace flexor {
namespace compensator {

// The segment i with x[i] <= u < x[i+1], for u inside [x[0], x[count-1]].
template <class Number>
inline uint8_t find_segment(const Number* x, uint8_t count, Number u) {
  uint8_t i = 0;
  while (i + 2 < count && u >= core::table(x[i + 1])) ++i;
  return i;
}

template <class Real, int kCapacity>
struct Curve {
  uint8_t count;
  Real x[kCapacity];
  Real y[kCapacity];
  Real slope[kCapacity];  // slope[i] belongs to the segment right of knot i

  Real operator()(Real u) const {
    const Real inside = core::clamp(u, x[0], x[count - 1]);
    const uint8_t i = find_segment(x, count, inside);
    return y[i] + slope[i] * (inside - x[i]);
  }
};

// In integers a curve is knots and values; curves of one signal on the same knots share the search.
//
//   f(u) = y_i + round(share s_i / 2^16),   share = (u - x_i) 2^up_i,   s_i = slope 2^(16 - up_i)
//
// Knots in the input's fraction, y in the output's, slopes in their ratio. 2^up_i is the largest power for which
// the segment's width stays in 16 bits: steep segments are narrow, and no slope loses bits to another.
struct Segment {
  uint8_t index;
  uint16_t share;
};

// Tables lie in flash; out of line there, all curves of a board share these two functions. scale: 2^up_i.
FLEXOR_SHARED Segment segment_of(const int16_t* x, const uint16_t* scale, uint8_t count, int16_t u) {
  uint8_t segments = static_cast<uint8_t>(count - 1);
  const int16_t inside = core::clamp(u, core::table(x[0]), core::table(x[segments]));
  const int16_t* from = x;  // the segment that is sought is one of `segments` from here
  while (segments > 1) {
    const uint8_t half = segments / 2;
    const int16_t* middle = from + half;
    if (inside >= core::table(*middle)) from = middle;
    segments = static_cast<uint8_t>(segments - half);
  }
  const uint8_t index = static_cast<uint8_t>(from - x);
  const uint16_t distance = static_cast<uint16_t>(inside - core::table(*from));
  return {index, static_cast<uint16_t>(distance * core::table(scale[index]))};
}

FLEXOR_SHARED int16_t value_at(const int16_t* y, const int16_t* slope, Segment segment) {
  return static_cast<int16_t>(core::table(y[segment.index]) +
                              core::multiply_round_q16(segment.share, core::table(slope[segment.index])));
}

template <int kCapacity>
struct FixedKnots {
  uint8_t count;
  int16_t x[kCapacity];
  uint16_t scale[kCapacity];

  FLEXOR_INLINE Segment operator()(int16_t u) const { return segment_of(x, scale, count, u); }
};

template <int kCapacity>
struct FixedValues {
  int16_t y[kCapacity];
  int16_t slope[kCapacity];

  FLEXOR_INLINE int16_t operator()(Segment segment) const { return value_at(y, slope, segment); }
};

template <int kCapacity>
struct FixedCurve {
  FixedKnots<kCapacity> knots;
  FixedValues<kCapacity> values;

  FLEXOR_INLINE int16_t operator()(int16_t u) const { return values(knots(u)); }
};

}  // namespace compensator
}  // namespace flexor
