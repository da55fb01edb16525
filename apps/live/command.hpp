// A job of the live view: `flexor` itself with other arguments, as a user would run it, in a process of its own. What is
// shown here is what the command line does, a crash there does not end the glove's recording, and it can be ended at any time.
#pragma once

#include <atomic>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "host/io/process.hpp"

namespace flexor::live {

// As the progress line says it: "what done of N, about 12 s left".
struct Progress {
  std::string stage;
  std::optional<double> share;
  std::optional<double> left_s;
};
Progress progress_of(const std::string& line);

struct CommandResult {
  bool ok = false;
  nlohmann::ordered_json json;  // what --json printed; null without
  std::string text;             // the last line of its messages, without "flexor: "
  std::vector<std::string> warnings;
};

class Command {
 public:
  // Runs `program` with these and --json; it ends with the thread that makes this. `progress` and, at the end, `done` are called on a thread of the command's.
  Command(const std::filesystem::path& program, std::vector<std::string> arguments,
          std::function<void(const Progress&)> progress, std::function<void(CommandResult)> done);
  ~Command();  // ends it
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;

  void cancel();

 private:
  CommandResult follow(const std::function<void(const Progress&)>& progress);

  io::Pipe out_;
  io::Pipe err_;
  io::Process process_;
  std::atomic<bool> cancelled_ = false;
  std::thread thread_;
};

}  // namespace flexor::live
