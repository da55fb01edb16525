// The firmware's sources, which the program carries with it: a user needs no checkout to deploy.
#pragma once

#include <map>
#include <string_view>

namespace flexor::deploy {

// By their paths from the repository's root, as includes are written.
const std::map<std::string_view, const char*>& sources();

}  // namespace flexor::deploy
