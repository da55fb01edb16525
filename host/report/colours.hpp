// One colour for each compensator, the same in every figure and on every page, whatever stands beside it.
#pragma once

#include <string>
#include <vector>

namespace flexor::report {

// Orange for raw, sky blue for published-w, vermilion for published-hw. Any other has the colour that its
// name picks, or the next one that is free; "#RRGGBB", in the order of the names.
std::vector<std::string> colours_of(const std::vector<std::string>& compensators);

}  // namespace flexor::report
