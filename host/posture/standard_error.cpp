#include "host/posture/standard_error.hpp"

#include <algorithm>
#include <cmath>

namespace flexor::posture {
namespace {

double quantile(const std::vector<Weighted>& ascending, double part) {
  double left = 0;
  for (const Weighted& error : ascending) left += part * error.share;
  for (const Weighted& error : ascending) {
    left -= error.share;
    if (left <= 0) return error.size;
  }
  return ascending.back().size;
}

}  // namespace

double standard_error(std::vector<Weighted> errors) {
  if (errors.empty()) return 0;
  std::ranges::sort(errors, {}, &Weighted::size);
  return std::sqrt(quantile(errors, 0.683) * quantile(errors, 0.95) / 1.96);
}

}  // namespace flexor::posture
