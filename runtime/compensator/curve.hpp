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
  uint16_t share;
  uint8_t offset;  // of its numbers in a table, bytes
};

// Where the knot lies from which the segment goes that u is in: of `left` + 1 segments from `x`, by fours and ones.
template <class Place>
FLEXOR_INLINE core::Words<Place, int16_t> segment_from(core::Words<Place, int16_t> x, uint8_t left,
                                                       int16_t u) {
  constexpr uint8_t kStride = 4;
  for (; left >= kStride && u >= x[kStride]; left = static_cast<uint8_t>(left - kStride)) x = x + kStride;
  for (; left >= 1 && u >= x[1]; --left) x = x + 1;
  return x;
}

#if defined(__AVR__) && defined(FLEXOR_AVR_ASSEMBLY)
// The same, with a pointer that goes on as it reads.
FLEXOR_INLINE core::Words<core::Flash, int16_t> segment_from(core::Words<core::Flash, int16_t> x,
                                                             uint8_t left, int16_t u) {
  int16_t knot;
  asm("subi %[left], 4\n\tbrcs 3f\n"
      "1:\tadiw %[x], 8\n\tlpm %A[knot], Z+\n\tlpm %B[knot], Z+\n\t"
      "cp %A[u], %A[knot]\n\tcpc %B[u], %B[knot]\n\tbrlt 2f\n\t"
      "sbiw %[x], 2\n\tsubi %[left], 4\n\tbrcc 1b\n\trjmp 3f\n"
      "2:\tsbiw %[x], 10\n\tldi %[left], 0xff\n"
      "3:\tsubi %[left], 0xfc\n\tadiw %[x], 2\n"
      "4:\tsubi %[left], 1\n\tbrcs 5f\n\tlpm %A[knot], Z+\n\tlpm %B[knot], Z+\n\t"
      "cp %A[u], %A[knot]\n\tcpc %B[u], %B[knot]\n\tbrge 4b\n\tsbiw %[x], 2\n"
      "5:\tsbiw %[x], 2"
      : [x] "+z"(x.at), [left] "+d"(left), [knot] "=&r"(knot)
      : [u] "r"(u));
  return x;
}
#endif

// Out of line on a microcontroller: all curves of a board share these functions. scale: 2^up_i.
template <class Place>
FLEXOR_SHARED Segment segment_of(core::Words<Place, int16_t> x, core::Words<Place, uint16_t> scale,
                                 uint8_t count, int16_t u) {
  const core::Words<Place, int16_t> from = segment_from(x, static_cast<uint8_t>(count - 2), u);
  const uint8_t* at = from.at;
  const int16_t begin = static_cast<int16_t>(Place::next_word(at));
  const int16_t end = static_cast<int16_t>(Place::next_word(at));
  const uint16_t distance = static_cast<uint16_t>(core::clamp(u, begin, end) - begin);
  const uint8_t offset = static_cast<uint8_t>(from.at - x.at);
  return {static_cast<uint16_t>(distance * scale.at_offset(offset)), offset};
}

struct Value {
  int16_t y;
  int16_t slope;  // of the segment that begins here
};

// `values`: y and slope of each knot.
template <class Place>
FLEXOR_INLINE int16_t value_in(const uint8_t* values, Segment segment) {
  const uint8_t* at = values + segment.offset;
  at += segment.offset;
  const uint16_t y = Place::next_word(at);
  const int16_t slope = static_cast<int16_t>(Place::next_word(at));
  return static_cast<int16_t>(y + static_cast<uint16_t>(core::multiply_round_q16(segment.share, slope)));
}
template <class Place>
FLEXOR_SHARED int16_t value_at(const uint8_t* values, Segment segment) {
  return value_in<Place>(values, segment);
}

// Of n curves one behind the other, each of `bytes`; n > 0. To `out`, which goes on; returns what lies behind them.
template <class Place>
FLEXOR_INLINE const uint8_t* values_in(const uint8_t* values, uint8_t bytes, Segment segment, int16_t*& out,
                                       uint8_t n) {
  for (; n > 0; --n, values += bytes) *out++ = value_in<Place>(values, segment);
  return values;
}

#if defined(__AVR__) && defined(FLEXOR_AVR_ASSEMBLY)
// In the registers that a function need not keep.
template <>
FLEXOR_INLINE const uint8_t* values_in<core::Flash>(const uint8_t* values, uint8_t bytes, Segment segment,
                                                    int16_t*& out, uint8_t n) {
  const uint8_t offset = static_cast<uint8_t>(2 * segment.offset);
  values += offset;
  uint16_t y;
  int16_t slope;
  uint8_t below;
  asm volatile(
      "1:\tlpm %A[y], Z+\n\tlpm %B[y], Z+\n\tlpm %A[s], Z+\n\tlpm %B[s], Z+\n\t"
      "mulsu %B[s], %B[u]\n\tadd %A[y], r0\n\tadc %B[y], r1\n\t"
      "mul %A[u], %A[s]\n\tldi %[b], 0x80\n\tadd %[b], r1\n\tadc %A[y], %[z]\n\tadc %B[y], %[z]\n\t"
      "mul %B[u], %A[s]\n\tadd %[b], r0\n\tadc %A[y], r1\n\tadc %B[y], %[z]\n\t"
      "mulsu %B[s], %A[u]\n\tsbc %B[y], %[z]\n\tadd %[b], r0\n\tadc %A[y], r1\n\tadc %B[y], %[z]\n\t"
      "st X+, %A[y]\n\tst X+, %B[y]\n\tadd r30, %[rest]\n\tadc r31, %[z]\n\tdec %[n]\n\tbrne 1b\n\tclr r1"
      : [v] "+z"(values), [o] "+x"(out), [n] "+r"(n), [y] "=&r"(y), [s] "=&a"(slope), [b] "=&d"(below)
      : [u] "a"(segment.share), [rest] "r"(static_cast<uint8_t>(bytes - 4)), [z] "r"(static_cast<uint8_t>(0))
      : "r0", "memory");
  return values - offset;
}
#endif

// Curves of one signal on the same knots, as the graph has them. n: how many.
struct Curves {
  uint16_t knots;  // where they lie in the part: count u8, x i16 of each, scale u16 of each
  uint8_t count;
  const Value* values;

  template <class Coder>
  FLEXOR_INLINE void code(Coder& coder, uint8_t n) {
    coder.require(n > 0);
    coder.knots(knots, count);
    coder.values(values, static_cast<uint16_t>(n * count));
  }
  // To `out`, which goes on.
  template <class Machine>
  FLEXOR_SHARED static typename Machine::Outs interpret(typename Machine::In in, uint8_t n, int16_t u,
                                                        int16_t* out) {
    const uint8_t* const knots = Machine::at(in.u16());
    if (!Machine::is_far()) {
      const uint8_t* const behind = evaluate<core::Ram>(knots, in.at, u, out, n);
      return {behind, out};
    }
    const uint16_t values = in.u16();
    (void)evaluate<typename Machine::Far>(knots, Machine::at(values), u, out, n);
    return {in.at, out};
  }

  // To `out`, which goes on; returns what lies behind the values.
  template <class Place>
  FLEXOR_INLINE static const uint8_t* evaluate(const uint8_t* knots, const uint8_t* values, int16_t u,
                                               int16_t*& out, uint8_t n) {
    const uint8_t count = Place::next_byte(knots);
    const core::Words<Place, int16_t> x{knots};
    const Segment on = segment_of(x, core::Words<Place, uint16_t>{(x + count).at}, count, u);
    return values_in<Place>(values, static_cast<uint8_t>(4 * count), on, out, n);
  }
};

// 2^up_i of a segment of this width, 1 or more.
inline uint16_t scale_of(uint16_t width) {
  uint16_t scale = 1;
  for (uint16_t scaled = width; scaled < 0x8000; scaled = static_cast<uint16_t>(2 * scaled)) {
    scale = static_cast<uint16_t>(2 * scale);
  }
  return scale;
}

// s_i of a segment that rises by `rise`, 2^14 at most either way, over share_i = width 2^up_i: the slope of the values as
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
  Value at[kCapacity];

  FLEXOR_INLINE int16_t operator()(Segment segment) const {
    return value_at<core::Flash>(reinterpret_cast<const uint8_t*>(at), segment);
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
