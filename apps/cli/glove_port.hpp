// The options of every command that listens to a glove.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "host/listen/listener.hpp"

namespace flexor::cli {

struct GlovePort {
  std::string port = "auto";
  unsigned baud = 0;
  bool readings = false;
  std::string key;
};

void add_options(CLI::App& command, GlovePort& o);

// Says on standard error what it tries and what it found. Throws io::InputError.
std::unique_ptr<listen::Listener> open_glove(const GlovePort& o);

}  // namespace flexor::cli
