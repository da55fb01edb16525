// flexor-cosim: the program `flexor` with simulated boards and cameras in it. GPL-3.0-or-later, because it
// links simavr.
#include "apps/cli/program.hpp"
#include "cosim/engine.hpp"

int main(int argc, char** argv) {
  flexor::cosim::Engine engine;
  return flexor::cli::run(argc, argv, &engine, flexor::filming::make_cameras().get());
}
