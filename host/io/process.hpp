// Other programs: the cross-compiler, and the co-simulation, which is one of its own because of its licence.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace flexor::io {

struct ProcessResult {
  int status = 0;  // exit status; 128 + signal
  std::string out;
  std::string err;
};

// Runs argv[0], searched in PATH, to its end. Throws InputError when there is no such program.
// `temporaries`: where it keeps its own, if not where this process does; what it leaves there when it is
// killed goes with the folder.
ProcessResult run_process(const std::vector<std::string>& argv,
                          const std::filesystem::path& temporaries = {});

// Empty if PATH has no such program.
std::filesystem::path find_program(const std::string& name);

}  // namespace flexor::io
