// flexor-camera: the program `flexor` with cameras in it.
#include "apps/cli/program.hpp"

int main(int argc, char** argv) {
  return flexor::cli::run(argc, argv, nullptr, flexor::filming::make_cameras().get());
}
