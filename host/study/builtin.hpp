// Documents of models/ that the program carries with it, so that it needs no folder beside it.
#pragma once

#include <map>
#include <string>
#include <string_view>

namespace flexor::study {

const std::map<std::string_view, const char*>& builtin();

// "gestures/1.json", "published_hw.json", ... Throws std::out_of_range for any other name.
inline std::string builtin(std::string_view name) { return builtin().at(name); }

}  // namespace flexor::study
