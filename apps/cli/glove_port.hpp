// The options of every command that listens to a glove, or to what stands in for one.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "host/listen/listener.hpp"
#include "host/recording/time.hpp"

namespace flexor::cli {

struct GlovePort {
  listen::ListenerOptions listener = {.port = "auto"};
  std::string key;
  std::string from;    // instead of a port; empty: a port
  std::string joints;  // of a camera
  std::string lens;
  double speed = 1;             // of a recording
  recording::TimeOptions time;  // likewise
};

void add_options(CLI::App& command, GlovePort& o);
// --speed: for commands that do not keep the times.
void add_speed(CLI::App& command, GlovePort& o);

// Says on standard error what it tries and what it found. Throws io::InputError.
std::unique_ptr<listen::Source> open_glove(const GlovePort& o);

// What a command says of it with --json: port, format and baud, null where no port was listened to, and source.
nlohmann::ordered_json source_json(const GlovePort& o, const listen::Source& source);

}  // namespace flexor::cli
