// A trial with all signals of both boards.
#pragma once

#include <filesystem>

#include "cosim/co_simulation.hpp"

namespace flexor::cosim {

// Trial 0 as a value change dump. Throws as io::write_file.
void trace(const Images& images, const twin::TrialInput& input, const std::filesystem::path& path);

}  // namespace flexor::cosim
