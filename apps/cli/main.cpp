#include "apps/cli/program.hpp"

int main(int argc, char** argv) { return flexor::cli::run(argc, argv); }
