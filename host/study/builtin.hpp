// Documents of models/ that the program carries with it, so that it needs no folder beside it.
#pragma once

#include <string>
#include <string_view>

namespace flexor::study {

// "gestures/1.json", "published_hw.json", ... Throws std::out_of_range for any other name.
std::string builtin(std::string_view name);

}  // namespace flexor::study
