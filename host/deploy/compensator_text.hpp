// A model in fixed point as C++: straight lines, coefficients as constants of their instructions.
#pragma once

#include <string>

#include "host/model/model.hpp"

namespace flexor::deploy {

// With all that it needs, as one header of C++14 in a namespace of this name, for firmware of one's own; its first lines
// state what its class Compensator takes and gives. Throws io::InputError when the model
// does not fit fixed point, and for a second joint of a finger. Numbers only: no text of the model's reaches the compiler.
std::string header_text(const model::Model& model, const std::string& name);

}  // namespace flexor::deploy
