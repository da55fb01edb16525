// A command that runs as a job of another program (flexor job): where what it says goes in place of a person's streams.
#pragma once

#include <string>

#include "host/io/interrupt.hpp"
#include "host/io/worker.hpp"

namespace flexor::cli {

struct JobOutput {
  io::Event event;
  std::string result;  // what --json prints

  void show(const io::Progress& progress) {
    if (!event({{"progress", io::to_json(progress)}})) io::stop_job();
  }
};

// Of the request that a command takes as a job: the keys are its options. Throws io::InputError where there is no such command.
nlohmann::ordered_json job_schema(const std::vector<std::string>& name);

// Runs the command `name` ("twin", "record") with a request as its schema says; what --json prints, text as text. Throws
// io::InputError, which names the key that is wrong, and what the command throws.
nlohmann::ordered_json run_job(const std::vector<std::string>& name, const nlohmann::ordered_json& request,
                               const io::Event& event);

// Of its last line (io::answer): 0 done, 1 failed, 2 bad input, 3 stopped or not usable.
int status_of(const nlohmann::ordered_json& answer);

// Of a job that was stopped and goes on where it ended: a queue gives it another go (EX_TEMPFAIL).
inline constexpr int kGoOnLater = 75;

// All is printed: what is left is the exit status.
struct JobEnded {
  int status;
};

// The one that runs; null: none, a person reads.
inline JobOutput* job_output = nullptr;

}  // namespace flexor::cli
