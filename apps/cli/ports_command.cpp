#include <fmt/format.h>

#include "apps/cli/commands.hpp"
#include "apps/cli/progress.hpp"
#include "host/deploy/flash.hpp"
#include "host/io/json.hpp"
#include "host/listen/listener.hpp"

namespace flexor::cli {
namespace ports_command {

struct Options {
  bool listen = false;
  bool json = false;
};

struct Heard {
  std::string port;
  std::string says;  // what it is, or why not
  unsigned baud = 0;
};

Heard hear(const std::string& port) {
  ProgressLine line;
  try {
    listen::ListenerOptions options;
    options.port = port;
    const listen::Listener listener(options,
                                    [&](const std::string& what) { line.show(port + ": " + what + " ..."); });
    return {port, listen::name_of(listener.format()), listener.baud()};
  } catch (const io::InputError& error) {
    const std::string what = error.what();
    return {port, what.starts_with(port + ": ") ? what.substr(port.size() + 2) : what, 0};
  }
}

void run(const Options& o) {
  std::vector<Heard> ports;
  for (const std::string& port : deploy::find_ports("/dev"))
    ports.push_back(o.listen ? hear(port) : Heard{port, "", 0});
  if (o.json) {
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (const Heard& h : ports) {
      nlohmann::ordered_json entry = {{"port", h.port}};
      if (o.listen) entry.update({{"says", h.says}, {"baud", h.baud}});
      list.push_back(entry);
    }
    return print(io::dump({{"ports", list}, {"version", FLEXOR_VERSION}}));
  }
  if (ports.empty())
    return print("no serial port: plug the board in with a cable that carries data, not power alone\n");
  for (const Heard& h : ports) {
    print(h.port + (h.says.empty() ? "" : ": " + h.says) +
          (h.baud > 0 ? fmt::format(" at {} baud", h.baud) : "") + "\n");
  }
}

}  // namespace ports_command

void add_ports(CLI::App& app) {
  using namespace ports_command;
  const auto [o, command] = add_command(app, "ports", "Serial ports that may be gloves or hands", run);
  command->add_flag("--listen", o->listen,
                    "listen to each, and say what speaks there; most boards restart by that");
}

}  // namespace flexor::cli
