#include "apps/cli/commands.hpp"

int main(int argc, char** argv) { return flexor::cli::run(argc, argv); }
