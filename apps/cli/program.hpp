// The command line of `flexor`, and of the programs beside it that have cameras and simulated boards.
#pragma once

#include "host/experiment/boards.hpp"
#include "host/experiment/cameras.hpp"

namespace flexor::cli {

// Parses and runs; the exit status. Null: commands that need boards are handed to flexor-cosim, those that
// need cameras to flexor-camera, processes of their own.
int run(int argc, char** argv, experiment::Boards* boards, const experiment::Cameras* cameras);

}  // namespace flexor::cli
