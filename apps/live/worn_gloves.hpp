// The gloves that the twin can wear.
#pragma once

#include <memory>

#include "apps/live/worn_glove.hpp"

namespace flexor::live {

// Both simulated boards (host/study/bench.hpp). Throws io::InputError, io::JobError.
std::shared_ptr<WornGlove> worn_boards();

// Glove and hand without boards, at once and on any machine.
std::shared_ptr<WornGlove> worn_twin();

}  // namespace flexor::live
