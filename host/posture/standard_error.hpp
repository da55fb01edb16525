// One number for how large errors are, when they need not be normal:
//
//   se = sqrt(q68 q95 / 1.96)     q68, q95: sizes that 68.3 and 95 % of the errors do not exceed
//
// so that one se covers 68.3 % and 1.96 se cover 95 %, or, where no number does both, each as nearly as the other. A root
// mean square would be drawn by the few largest errors, and claim too much.
#pragma once

#include <vector>

namespace flexor::posture {

struct Weighted {
  double size;   // at least 0
  double share;  // weight, above 0
};

// 0 without errors.
double standard_error(std::vector<Weighted> errors);

}  // namespace flexor::posture
