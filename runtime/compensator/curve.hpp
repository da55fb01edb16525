// Piecewise-linear static curve through knots (x_i, y_i), held constant outside the first and last knot.
//
//   f(u) = y_i + s_i (u - x_i)   for x_i <= u < x_{i+1},   s_i = (y_{i+1} - y_i) / (x_{i+1} - x_i)
//   f(u) = y_0 for u <= x_0,   f(u) = y_{n-1} for u >= x_{n-1}
//
// x strictly increasing, 2 <= count <= kCapacity.
#pragma once

#include "runtime/core/memory.hpp"

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

// Out of line on a microcontroller: all curves of a board share these functions. scale: 2^up_i.
template <class Place>
FLEXOR_SHARED Segment segment_of(core::Words<Place, int16_t> x, core::Words<Place, uint16_t> scale,
                                 uint8_t count, int16_t u) {
  uint8_t segments = static_cast<uint8_t>(count - 1);
  const int16_t inside = core::clamp(u, x[0], x[segments]);
  core::Words<Place, int16_t> from = x;  // the segment that is sought is one of `segments` from here
  while (segments > 1) {
    const uint8_t half = segments / 2;
    const core::Words<Place, int16_t> middle = from + half;
    if (inside >= middle[0]) from = middle;
    segments = static_cast<uint8_t>(segments - half);
  }
  const uint8_t index = from - x;
  const uint16_t distance = static_cast<uint16_t>(inside - from[0]);
  return {index, static_cast<uint16_t>(distance * scale[index])};
}

template <class Place>
FLEXOR_SHARED int16_t value_at(core::Words<Place, int16_t> y, core::Words<Place, int16_t> slope,
                               Segment segment) {
  return static_cast<int16_t>(y[segment.index] +
                              core::multiply_round_q16(segment.share, slope[segment.index]));
}

// 2^up_i of a segment of this width, 1 or more.
inline uint16_t scale_of(uint16_t width) {
  uint16_t scale = 1;
  for (uint16_t scaled = width; scaled < 0x8000; scaled = static_cast<uint16_t>(2 * scaled)) {
    scale = static_cast<uint16_t>(2 * scale);
  }
  return scale;
}

// s_i of a segment that rises by `rise`, 2^14 at most either way, over share_i = width 2^up_i: what the values say as
// they are held, so that a segment ends where the next begins.
inline int16_t slope_of(int16_t rise, uint16_t share) {
  const int32_t half = rise < 0 ? -static_cast<int32_t>(share / 2) : share / 2;
  const int32_t slope = (static_cast<int32_t>(rise) * 0x10000 + half) / share;
  return core::narrow(slope);
}

template <int kCapacity>
struct FixedKnots {
  uint8_t count;
  int16_t x[kCapacity];
  uint16_t scale[kCapacity];

  FLEXOR_INLINE Segment operator()(int16_t u) const {
    return segment_of(core::in_flash(x), core::in_flash(scale), count, u);
  }
};

template <int kCapacity>
struct FixedValues {
  int16_t y[kCapacity];
  int16_t slope[kCapacity];

  FLEXOR_INLINE int16_t operator()(Segment segment) const {
    return value_at(core::in_flash(y), core::in_flash(slope), segment);
  }
};

template <int kCapacity>
struct FixedCurve {
  FixedKnots<kCapacity> knots;
  FixedValues<kCapacity> values;

  FLEXOR_INLINE int16_t operator()(int16_t u) const { return values(knots(u)); }
};

}  // namespace compensator
}  // namespace flexor
