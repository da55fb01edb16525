// A model in fixed point as C++ for the board: straight lines, coefficients as constants of their instructions.
#pragma once

#include <string>

#include "host/model/model.hpp"
#include "host/model/wiring.hpp"

namespace flexor::deploy {

struct CompensatorText {
  std::string coefficients;  // for namespace config
  std::string compensator;   // class GloveCompensator
};

// `more`: joints of the model whose angles follow the fingers'. Throws io::InputError when the model does not
// fit fixed point. Numbers only: no text of the model's reaches the compiler.
CompensatorText compensator_text(const model::Model& model, const std::vector<std::size_t>& more = {});

// The same and all that it needs as one header of C++14 in a namespace of this name, for firmware of one's own; its first lines
// say what its class Compensator takes and gives. Throws likewise, and for a second joint of a finger.
std::string header_text(const model::Model& model, const std::string& name);

}  // namespace flexor::deploy
