// One number for how large errors are, when they need not be normal: the se for which
//
//   share of errors within se + share within 1.96 se = 0.683 + 0.95
//
// Normal errors have both. Of others, what one interval covers too much the other covers too little: both miss by as
// many points. A root mean square would be drawn by the few largest errors, and claim too much.
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
