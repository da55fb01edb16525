#include "host/posture/standard_error.hpp"

#include <algorithm>

namespace flexor::posture {

double standard_error(std::vector<Weighted> errors) {
  const std::size_t count = errors.size();
  double left = 0;
  for (std::size_t i = 0; i < count; ++i) {
    left += (0.683 + 0.95) * errors[i].share;
    errors.push_back({errors[i].size / 1.96, errors[i].share});
  }
  std::ranges::sort(errors, {}, &Weighted::size);
  for (const Weighted& error : errors) {
    left -= error.share;
    if (left <= 0) return error.size;
  }
  return 0;
}

}  // namespace flexor::posture
