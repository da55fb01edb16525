#include <fmt/format.h>

#include "apps/cli/commands.hpp"
#include "apps/cli/progress.hpp"
#include "host/deploy/send_pages.hpp"
#include "host/listen/listener.hpp"

namespace flexor::cli::ports_command {

struct Options {
  bool listen = false;
  bool ask = false;
  std::string port;
};

struct Heard {
  std::string port;
  std::string says;  // what it is, or why not
  unsigned baud = 0;
  std::optional<deploy::BoardContents> contents;
};

Heard hear(const std::string& port) {
  ProgressLine line;
  listen::ListenerOptions options;
  options.port = port;
  const listen::Listener listener(options, line.steps(port + ": "));
  return {port, listen::name_of(listener.format()), listener.baud(), {}};
}

// Through the bootloader: a board says the same whatever it does.
Heard ask(const std::string& port) {
  ProgressLine line;
  deploy::Bootloader bootloader(deploy::choose_port(port), deploy::rates(0), line.percents(port + ": "));
  const std::optional<deploy::BoardContents> contents = deploy::contents_of(bootloader.read());
  return {port, contents ? deploy::to_text(*contents) : "no image of this Flexor: flexor flash writes one", 0,
          contents};
}

// No bootloader, no permission: the next port may be the board.
Heard look(const Options& o, const std::string& port) {
  try {
    return o.listen ? hear(port) : o.ask ? ask(port) : Heard{port, "", 0, {}};
  } catch (const std::runtime_error& error) {
    if (!o.port.empty()) throw;
    const std::string what = error.what();
    return {port, what.starts_with(port + ": ") ? what.substr(port.size() + 2) : what, 0, {}};
  }
}

Json to_json(const deploy::BoardContents& c) {
  const auto digest = [](const std::optional<std::uint16_t>& crc) {
    return crc ? Json(fmt::format("{:04x}", *crc)) : Json();
  };
  return {{"board", c.board == link::BoardKind::glove ? "glove" : "hand"},
          {"image_version", c.version},
          {"is_our_image", c.is_our_image},
          {"settings_crc16", digest(c.settings)},
          {"model_crc16", digest(c.model)},
          {"model_bytes", c.model_bytes}};
}

Output run(const Options& o) {
  std::vector<Heard> ports;
  const std::vector<std::string> names =
      o.port.empty() ? deploy::find_ports("/dev") : std::vector{deploy::choose_port(o.port)};
  for (const std::string& port : names) ports.push_back(look(o, port));
  Output out = {{{"ports", Json::array()}}, ""};
  for (const Heard& h : ports) {
    Json& entry = out.json["ports"].emplace_back();
    entry["port"] = h.port;
    if (o.listen || o.ask) entry["says"] = h.says;
    if (o.listen) entry["baud"] = h.baud;
    if (h.contents) entry.update(to_json(*h.contents));
    out.text += h.port + (h.says.empty() ? "" : ": " + h.says) +
                (h.baud > 0 ? fmt::format(" at {} baud", h.baud) : "") + "\n";
  }
  if (ports.empty())
    out.text = "no serial port: plug the board in with a cable that carries data, not power alone\n";
  return out;
}

void add(CLI::App& app) {
  const auto [o, command] = add_command(app, "ports", "Serial ports that may be gloves or hands", run);
  CLI::Option* listen = command->add_flag(
      "--listen", o->listen, "listen to each, and say what speaks there; most boards restart by that");
  command
      ->add_flag("--ask", o->ask,
                 "ask each board for its version and the digests of its settings and model; it pauses for "
                 "some seconds")
      ->excludes(listen);
  command->add_option("--port", o->port, "this one alone (default: each that may be a board)");
}

}  // namespace flexor::cli::ports_command
