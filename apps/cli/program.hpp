// The command line of `flexor`, and of the programs beside it that have cameras and simulated boards.
#pragma once

#include "apps/camera/cameras.hpp"
#include "host/study/boards.hpp"

namespace flexor::cli {

// Parses and runs; the exit status. Null: commands that need boards are handed to flexor-cosim, those that
// need cameras to flexor-camera, processes of their own.
int run(int argc, char** argv, study::Boards* boards, const filming::Cameras* cameras);

}  // namespace flexor::cli
