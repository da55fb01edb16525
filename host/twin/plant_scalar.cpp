// Compiled without vector instructions; see CMakeLists.txt.
#include "host/twin/plant_step.hpp"

namespace flexor::twin {

void advance(const PlantConstants& c, PlantState<5>& x) { detail::advance(c, x); }

}  // namespace flexor::twin
