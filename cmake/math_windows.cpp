// The same bits as on Linux: cmake/newlib.cmake.
#include <cmath>
#include <utility>

namespace {

bool is_fused() {
  static const bool is = [] {
    __builtin_cpu_init();
    return __builtin_cpu_supports("fma") != 0 && __builtin_cpu_supports("avx2") != 0;
  }();
  return is;
}

}  // namespace

#define FLEXOR_BOTH(name)               \
  extern "C" double name##_0(double x); \
  extern "C" double name##_1(double x); \
  extern "C" double name(double x) { return is_fused() ? name##_1(x) : name##_0(x); }
FLEXOR_BOTH(exp)
FLEXOR_BOTH(log)
FLEXOR_BOTH(log2)
FLEXOR_BOTH(expm1)
FLEXOR_BOTH(log1p)
extern "C" double pow_0(double x, double y);
extern "C" double pow_1(double x, double y);
extern "C" double pow(double x, double y) { return is_fused() ? pow_1(x, y) : pow_0(x, y); }
extern "C" double exp2_0(double x);
extern "C" double exp2(double x) { return exp2_0(x); }

// C. F. Borges, "An improved algorithm for hypot(a, b)", 2019, corrected and unfused; for what neither overflows nor vanishes.
extern "C" double hypot(double a, double b) {
  double x = std::fabs(a);
  double y = std::fabs(b);
  if (x < y) std::swap(x, y);
  if (!(y > x * 0x1p-54)) return x + y;
  const double h = std::sqrt(x * x + y * y);
  const double d = h <= 2 * y ? h - y : h - x;
  const double excess =
      h <= 2 * y ? x * (2 * d - x) + (d - 2 * (x - y)) * d : 2 * d * (x - 2 * y) + ((4 * d - y) * y + d * d);
  return h - excess / (2 * h);
}
