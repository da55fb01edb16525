// The gloves that the twin can wear.
#pragma once

#include <cstdlib>
#include <functional>
#include <memory>
#include <string>

#include "apps/live/worn_glove.hpp"

namespace flexor::live {

// Both simulated boards (host/study/bench.hpp). Builds their firmware, which takes seconds; `says` hears what goes on. Where no
// folder of `path` has a compiler for boards, the glove alone, which says so (why_not_written()). Throws io::InputError, io::JobError.
std::unique_ptr<WornGlove> worn_boards(const std::function<void(const std::string&)>& says,
                                       const char* path = std::getenv("PATH"));

// The glove alone, without boards.
std::unique_ptr<WornGlove> worn_twin();

}  // namespace flexor::live
