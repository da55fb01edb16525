// The gloves that the twin can wear.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "apps/live/worn_glove.hpp"

namespace flexor::live {

// Both simulated boards (host/study/bench.hpp). Builds their firmware, which takes seconds; `says` hears what goes on. Throws
// io::InputError, io::JobError.
std::unique_ptr<WornGlove> worn_boards(const std::function<void(const std::string&)>& says);

// The glove alone, without boards.
std::unique_ptr<WornGlove> worn_twin();

}  // namespace flexor::live
