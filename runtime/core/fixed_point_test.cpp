#include "runtime/core/fixed_point.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cmath>

namespace flexor::core {
namespace {

TEST(FixedPoint, UnsignedProductIsTheExactFloor) {
  EXPECT_TRUE(rc::check([](int32_t a, uint16_t m) {
    const auto exact = static_cast<int64_t>(std::floor(static_cast<long double>(int64_t{a} * m) / 65536.0L));
    RC_ASSERT(multiply_q16(a, m) == exact);
  }));
}

TEST(FixedPoint, SignedProductIsOddInTheFactor) {
  EXPECT_TRUE(rc::check([](int32_t a) {
    const auto m = static_cast<int16_t>(*rc::gen::inRange(0, 32768));
    RC_ASSERT(multiply_q16(a, static_cast<int16_t>(-m)) == -multiply_q16(a, m));
  }));
}

TEST(FixedPoint, RoundedProductIsTheNearestModuloItsWidth) {
  EXPECT_TRUE(rc::check([](uint16_t a, int16_t m) {
    const int64_t exact = (int64_t{a} * m + 0x8000) >> 16;
    RC_ASSERT(multiply_round_q16(a, m) == static_cast<int16_t>(exact));
  }));
  EXPECT_EQ(multiply_round_q16(65535, 32767), 32767);
  EXPECT_EQ(multiply_round_q16(65535, -32768), -32767);
}

TEST(FixedPoint, WidenIsAProductWithAPowerOfTwo) {
  for (const int value : {-32768, -1, 0, 1, 32767}) {
    EXPECT_EQ(widen<1>(static_cast<int16_t>(value)), value * 32768);
    EXPECT_EQ(widen<2>(static_cast<int16_t>(value)), value * 16384);
  }
}

TEST(FixedPoint, RoundShiftIsWithinHalfAStep) {
  EXPECT_TRUE(rc::check([] {
    const auto value = *rc::gen::inRange<int32_t>(-(1 << 29), 1 << 29);
    const auto shift = static_cast<uint8_t>(*rc::gen::inRange(1, 20));
    const double exact = std::ldexp(static_cast<double>(value), -shift);
    RC_ASSERT(std::abs(round_shift(value, shift) - exact) <= 0.5);
  }));
}

TEST(FixedPoint, NarrowSaturates) {
  EXPECT_EQ(narrow(40000), 32767);
  EXPECT_EQ(narrow(-40000), -32768);
  EXPECT_EQ(narrow(-5), -5);
}

}  // namespace
}  // namespace flexor::core
