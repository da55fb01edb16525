#include <cstdlib>

#include "apps/cli/commands.hpp"
#include "apps/live/live.hpp"
#include "host/export/joint_state.hpp"
#include "host/export/opengloves.hpp"
#include "host/io/interrupt.hpp"

namespace flexor::cli::live_command {

struct Options {
  live::LiveOptions live;
  std::string from;
  std::string opengloves;
  std::string mcap;
  bool demo = false;
  bool boards = false;
  bool json = false;
};

// Each finger's first joint, from the open hand to the fist.
exports::OpenGlovesOptions curls_of(const model::Model& model) {
  exports::OpenGlovesOptions out;
  for (std::size_t f = 0; f < out.fingers.size(); ++f) {
    for (std::size_t j = 0; j < model.joints.size() && !out.fingers[f]; ++j) {
      if (!model.joints[j].name.starts_with(model::finger_names()[f])) continue;
      const model::Ends ends = model::ends(model, model.joints[j]);
      out.fingers[f] = exports::FingerRange{j, ends.open_deg, ends.fist_deg};
    }
  }
  return out;
}

// Models with other joints go into files of their own: angles.mcap, angles-2.mcap.
std::filesystem::path not_there_yet(const std::filesystem::path& path) {
  std::filesystem::path out = path;
  for (int n = 2; std::filesystem::exists(out); ++n) {
    out = path;
    out.replace_filename(fmt::format("{}-{}{}", path.stem().string(), n, path.extension().string()));
  }
  return out;
}

void add_outs(Options& o) {
  // What cannot be opened is reported now, not when a model is worn.
  if (!o.opengloves.empty()) {
    if (!std::filesystem::is_fifo(o.opengloves))
      (void)exports::OpenGloves(o.opengloves, {});  // whose reader would take it for the end
    o.live.outs.emplace_back([path = o.opengloves](const model::Model& model) {
      return std::make_unique<exports::OpenGloves>(path, curls_of(model));
    });
  }
  if (!o.mcap.empty()) {
    if (std::filesystem::exists(o.mcap))
      throw io::InputError(o.mcap + ": is there already: a recording is never written over, name another");
    io::require_writable(o.mcap);
    o.live.outs.emplace_back([path = o.mcap](const model::Model& model) {
      std::vector<std::string> joints;
      for (const model::Joint& joint : model.joints) joints.push_back(joint.name);
      return std::make_unique<exports::JointStateFile>(not_there_yet(path), joints);
    });
  }
}

void run(Options& o) {
  const char* home = std::getenv(kHome);
  if (o.live.sessions.empty() && (home == nullptr || *home == '\0'))
    throw io::InputError("--sessions: say where, there is no home folder");
  if (o.live.sessions.empty()) o.live.sessions = std::filesystem::path(home) / "flexor";
  o.live.program = io::program_beside("flexor");
  if (o.boards) {
    o.live.worn = live::worn_boards();
    if (!o.live.worn->facts.why_not_written.empty()) log(o.live.worn->facts.why_not_written);
  } else if (o.demo || o.from == "twin") {
    std::string unit = o.live.model.empty() ? "" : model::load(o.live.model).inputs.front().unit;
    if (unit.empty()) unit = "count";
    if (unit != "count") log(fmt::format("the twin's glove reads {}, as {} takes it", unit, o.live.model));
    o.live.worn = live::worn_twin(unit);
  } else {
    o.live.recording = o.from;
  }
  add_outs(o);
  live::Live live(o.live);
  io::StopOnSignal stop;
  const std::string sessions = o.live.sessions.string();
  print(o.json
            ? io::dump_line({{"url", live.url()}, {"sessions", sessions}, {"version", FLEXOR_VERSION}}) + "\n"
            : fmt::format("{}\nOpen this address in a browser. Sessions are kept in {}. Ctrl-C ends it.\n",
                          live.url(), sessions));
  live.run(*stop.flag());
}

void add(CLI::App& app) {
  const auto [o, command] = add_command(
      app, "live", "One page in a browser: the hand as it moves, a guided calibration, scopes, sessions", run,
      "the address as one JSON object on standard output, at the start");
  command->footer(
      "Whoever has the address it prints, which holds a secret, can use the glove; nobody else can. It is "
      "for this\n"
      "machine alone; for others a reverse proxy with TLS goes before it (docs/live.md).");
  add_shown(*command, "--port", o->live.port,
            "serial port of the glove or of a radio; auto: what there is of a glove and a hand, also "
            "when it is plugged in later");
  CLI::Option* hand =
      command->add_option("--hand", o->live.hand, "serial port of the bionic hand, shown beside the glove");
  add_positive(*command, "--baud", o->live.baud, "of the port (default: found by listening)");
  command->add_option(
      "--key", o->live.key,
      "pair.key of the deployment: a glove that is paired with a hand speaks to this program instead");
  command->add_option("--sessions", o->live.sessions,
                      "folder of recordings, models and reports (default: flexor in the home folder)");
  command->add_option("--model", o->live.model,
                      "model that is worn at first (default: the one that was accepted last for this glove)");
  command
      ->add_option("--rate", o->live.rate_hz,
                   "sample rate of models that are identified, Hz (default: what suits the glove)")
      ->check(CLI::Range(0.01, 1e5));
  command
      ->add_option("--lead", o->live.lead_s,
                   "seconds by which what follows the glove comes after it: models that are identified are "
                   "so much ahead (flexor identify --lead)")
      ->check(CLI::Range(0.0, 2.0));
  command
      ->add_flag("--demo", o->demo,
                 "without any hardware: the twin wears glove and bionic hand, and a drawn hand is filmed")
      ->excludes(hand);
  command
      ->add_flag("--boards", o->boards,
                 "as --demo, with both boards in the simulator, running their firmware in real time")
      ->excludes(hand);
  command
      ->add_option("--from", o->from, "instead of a port: a recording (CSV), played again; twin: as --demo")
      ->excludes(hand);
  add_time_options(*command, o->live.time);
  command->add_option("--opengloves", o->opengloves,
                      "serial port or FIFO of an OpenGloves driver, which gets the fingers' bends as text");
  command->add_option("--mcap", o->mcap, "file that gets the angles as ROS 2 JointState; a new one");
  command->add_option("--http", o->live.server.port, "port of the page (default: any that is free)");
}

}  // namespace flexor::cli::live_command
