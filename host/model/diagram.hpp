// A model in words: its blocks as a tree before each joint, their limits, and what it erred by.
#pragma once

#include <string>

#include "host/model/model.hpp"

namespace flexor::model {

std::string diagram(const Model& model);

}  // namespace flexor::model
