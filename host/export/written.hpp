// What an export has made.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace flexor::exports {

struct Written {
  std::vector<std::string> files;
  std::vector<std::string> joints;
  std::uint64_t rows = 0;
  double seconds = 0;              // from the first row to the last; of several recordings their sum
  double rate_hz = 0;              // of evenly sampled ones
  std::vector<std::string> notes;  // what was assumed or left out
};

}  // namespace flexor::exports
