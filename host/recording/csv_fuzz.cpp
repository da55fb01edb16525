// Any bytes as a CSV: either a recording that holds its promises and round-trips, or an InputError.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "host/io/io.hpp"
#include "host/recording/csv.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace flexor;
  try {
    const auto r = recording::parse_csv({reinterpret_cast<const char*>(data), size}, "fuzz", {});
    for (std::size_t k = 0; k < r.t_s.size(); ++k) {
      if (!std::isfinite(r.t_s[k]) || (k > 0 && r.t_s[k] < r.t_s[k - 1])) std::abort();
      for (const auto& column : r.columns) {
        if (column.value.size() != r.t_s.size() || !std::isfinite(column.value[k])) std::abort();
      }
    }
  } catch (const io::InputError&) {
  }
  return 0;
}
