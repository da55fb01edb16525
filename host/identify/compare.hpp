// The angles of two logs beside each other, and what their motion says of figures that are bad for another reason than the
// estimate: two clocks, one that runs fast, another zero, sign or unit.
#pragma once

#include <string>
#include <vector>

#include "host/recording/csv.hpp"
#include "host/score/score.hpp"

namespace flexor::identify {

struct Compared {
  score::Score score;
  std::vector<std::string> notes;  // on reading
  std::vector<std::string> warnings;
};

// `shift_s` is added to the estimate's clock. Throws what reading an angle does, and score::compare.
Compared compare(const recording::Log& measured, const std::string& column, const recording::Log& estimated,
                 const std::string& of, const recording::TimeOptions& time = {}, double shift_s = 0);

}  // namespace flexor::identify
