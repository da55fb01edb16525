// The command line of `flexor`, and of the program beside it that has simulated boards.
#pragma once

#include "host/experiment/boards.hpp"

namespace flexor::cli {

// Parses and runs; the exit status. `boards` null: commands that need them are handed to flexor-cosim, a
// process of its own.
int run(int argc, char** argv, experiment::Boards* boards);

}  // namespace flexor::cli
