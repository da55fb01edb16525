// A trial with all signals of both boards.
#pragma once

#include <filesystem>

#include "cosim/simulation.hpp"

namespace flexor::cosim {

// Trial 0 as a value change dump. Throws as io::write_file.
void trace(const Images& images, const twin::Setup& setup, const std::filesystem::path& path);

}  // namespace flexor::cosim
