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

// What it is, or why not.
void look(const Options& o, const std::string& port, Json& entry) {
  ProgressLine line;
  if (o.listen) {
    entry.update({{"says", ""}, {"baud", 0}});
    listen::ListenerOptions options;
    options.port = port;
    const listen::Listener listener(options, line.steps(port + ": "));
    entry.update({{"says", listen::name_of(listener.format())}, {"baud", listener.baud()}});
  } else if (o.ask) {  // through the bootloader: a board says the same whatever it does
    deploy::Bootloader bootloader(deploy::choose_port(port), 0, line.percents(port + ": "));
    const std::optional<deploy::BoardContents> contents = deploy::contents_of(bootloader.read());
    entry["says"] =
        contents ? deploy::to_text(*contents) : "no image of this Flexor: flexor flash writes one";
    if (contents) entry.update(to_json(*contents));
  }
}

Output run(const Options& o) {
  Output out = {{{"ports", Json::array()}}, ""};
  for (const std::string& port :
       o.port.empty() ? io::serial_ports() : std::vector{deploy::choose_port(o.port)}) {
    Json& entry = out.json["ports"].emplace_back(Json{{"port", port}});
    try {
      look(o, port, entry);
    } catch (const std::runtime_error& error) {  // no bootloader or permission: look at the next port
      if (!o.port.empty()) throw;
      const std::string what = error.what();
      entry["says"] = what.starts_with(port + ": ") ? what.substr(port.size() + 2) : what;
    }
    const auto says = entry.value("says", "");
    const auto baud = entry.value("baud", 0U);
    out.text += fmt::format("{}{}{}{}\n", port, says.empty() ? "" : ": ", says,
                            baud > 0 ? fmt::format(" at {} baud", baud) : "");
  }
  if (out.text.empty())
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
