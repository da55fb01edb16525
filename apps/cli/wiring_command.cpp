#include "apps/cli/commands.hpp"
#include "host/deploy/wiring.hpp"
#include "host/io/folder_lock.hpp"
#include "host/report/wiring.hpp"

namespace flexor::cli::wiring_command {

struct Options {
  std::string out;
  std::string hardware = "flexor";
  deploy::Output output = deploy::Output::radio;
};

Output run(const Options& o) {
  const model::Hardware hardware = model::hardware(o.hardware);
  Json json = deploy::wiring_plan(hardware, o.output);
  const io::FolderLock lock(o.out, "wiring");
  report::save_wiring(json, o.out);
  json["folder"] = o.out;
  json["pins"] = model::to_json(hardware.pins);
  return {
      json,
      fmt::format("wiring    {0}/wiring.md, {0}/wiring_glove.svg{1}\nlog it    flexor deploy --output log "
                  "--hardware {2} --out logger, then flexor flash logger\n",
                  o.out, o.output == deploy::Output::radio ? fmt::format(", {}/wiring_hand.svg", o.out) : "",
                  io::shell_word(o.hardware))};
}

void add(CLI::App& app) {
  const auto [o, command] = add_command(app, "wiring", "What to solder where, with pictures and parts", run);
  add_folder(*command, "--out", o->out, "write pictures and list into this folder")->required();
  add_hardware(*command, o->hardware);
  add_choice(*command, "--output", o->output, deploy::kOutputs,
             "of the glove: radio, or over a cable to the PC opengloves, text, log");
}

}  // namespace flexor::cli::wiring_command
