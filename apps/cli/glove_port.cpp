#include "apps/cli/glove_port.hpp"

#include <fmt/format.h>

#include "apps/cli/commands.hpp"
#include "apps/cli/progress.hpp"
#include "host/deploy/flash.hpp"
#include "host/deploy/pair_key.hpp"

namespace flexor::cli {

void add_options(CLI::App& command, GlovePort& o) {
  command.add_option("--port", o.port, "serial port of the glove or of a radio; auto: the only one there is")
      ->capture_default_str();
  command.add_option("--baud", o.baud, "of the port (default: found by listening)")
      ->check(CLI::PositiveNumber);
  command.add_flag("--readings", o.readings,
                   "of a glove with Flexor's firmware: readings of its strips instead of angles");
  command.add_option(
      "--key", o.key,
      "pair.key of the deployment: a glove that is paired with a hand speaks to this program instead");
}

std::unique_ptr<listen::Listener> open_glove(const GlovePort& o) {
  listen::ListenerOptions options;
  options.port = deploy::choose_port(o.port);
  options.baud = o.baud;
  options.readings = o.readings;
  if (!o.key.empty()) options.key = deploy::load_key(o.key);
  std::unique_ptr<listen::Listener> listener;
  {
    ProgressLine line;
    listener = std::make_unique<listen::Listener>(
        options, [&](const std::string& what) { line.show(options.port + ": " + what + " ..."); });
  }
  log(fmt::format("{}: {} at {} baud", options.port, listen::name_of(listener->format()), listener->baud()));
  return listener;
}

}  // namespace flexor::cli
