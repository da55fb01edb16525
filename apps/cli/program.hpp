// The command line of `flexor`.
#pragma once

namespace flexor::cli {

// Parses and runs; the exit status.
int run(int argc, char** argv);

}  // namespace flexor::cli
