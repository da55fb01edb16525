// What a compensator reports of one input sample.
#pragma once

#include <stdint.h>

namespace flexor {
namespace core {

// Every status comes with a safe output: anything but `ok` leaves the state untouched and repeats the last
// good output (the rest angle before the first good sample).
enum class Status : uint8_t {
  ok = 0,
  below_range = 1,  // input under `valid_min`: a shorted or unplugged sensor at the lower ADC rail
  above_range = 2,  // input over `valid_max`: the upper ADC rail
  not_a_number =
      3,  // floating point only: the input, or what overflowed on its way; then the state starts again
};

}  // namespace core
}  // namespace flexor
