// MAT files for MATLAB and Octave.
#pragma once

#include <filesystem>

#include "host/recording/recording.hpp"

namespace flexor::recording {

enum class MatVersion { v5, v7_3 };

// Writes t_s and every column as an n x 1 double under a valid MATLAB name (other characters become '_').
// Columns that would get the same name are numbered. By the rules and with the errors of host/io/output.hpp:
// what was written is read back.
void write_mat(const Recording& recording, const std::filesystem::path& path, MatVersion version);

// The MATLAB name of a column: "∠ABC_smooth" -> "x_ABC_smooth".
std::string mat_name(std::string_view column);

}  // namespace flexor::recording
