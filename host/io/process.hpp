// Other programs: the cross-compiler, gnuplot, and the workers. The only place that starts one.
#pragma once

#include <sys/types.h>

#include <array>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "host/io/descriptor.hpp"

namespace flexor::io {

// [0] is read from, [1] written to. Neither end is handed on to other programs by accident.
struct Pipe {
  Pipe();  // throws JobError
  std::array<Descriptor, 2> end;
};

// This process's descriptor `ours` is the program's `theirs`.
struct HandedOn {
  int ours;
  int theirs;
};

// A program that runs, in a process group of its own, so that its end reaches what the program itself has started. It is killed
// with its owner, unless it was waited for.
class Process {
 public:
  // `temporaries`: where it keeps its own, if not where this process does; what it leaves there when it is
  // killed goes with the folder. It gets no other descriptor of this process. Throws JobError when it cannot be started.
  Process(const std::filesystem::path& program, const std::vector<std::string>& argv,
          const std::vector<HandedOn>& descriptors, const std::filesystem::path& temporaries = {});
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  // To its end: exit status; 128 + signal.
  int wait();
  // The same, but after so long the whole group is killed.
  int wait_at_most(int ms);
  void end();  // asks it to

 private:
  bool is_over(bool waits);  // its exit status is known then
  void kill();               // and what it has started

  pid_t child_ = 0;
  int status_ = -1;
};

struct ProcessResult {
  int status = 0;  // exit status; 128 + signal
  std::string out;
  std::string err;
};

// Of a program that takes its time.
struct Watch {
  std::function<void(const std::string& err)>
      on_err;                   // all of its standard error so far, whenever there is more
  int longest_silence_ms = -1;  // after which it is killed; -1: it may be silent
};

// Runs argv[0], searched in PATH, to its end. Throws InputError when there is no such program. `temporaries`
// as above.
ProcessResult run_process(const std::vector<std::string>& argv, const std::filesystem::path& temporaries = {},
                          const Watch& watch = {});

// Beside this program, or in PATH; empty: there is none.
std::filesystem::path find_program(const std::string& name);

}  // namespace flexor::io
