#include "apps/cli/commands.hpp"
#include "apps/cli/progress.hpp"
#include "host/io/folder_lock.hpp"
#include "host/study/glove_fit.hpp"

namespace flexor::cli::twin_command {

struct RecordOptions {
  study::GloveRequest request;
  TwinFiles twin;
  std::string folder;
};

Output record(RecordOptions& o) {
  o.request.parameters = twin_parameters(o.twin);
  study::check(o.request);
  const io::FolderLock lock(o.folder);
  Json pairs = Json::array();
  std::string next = "flexor identify";  // the fit that a user would do next, ready to be run
  for (int n = 1; n <= o.request.donnings; ++n) {
    Json& pair = pairs.emplace_back();
    for (const char* what : {"glove", "camera", "hand"}) {
      const std::string file = fmt::format("{}/{}-{}.csv", o.folder, what, n);
      if (std::filesystem::exists(file))
        throw io::InputError("{}: is there already and may be a log of yours: choose another folder", file);
      pair[what] = file;
    }
    next += fmt::format(" --pair {} {}", io::shell_word(pair.at("glove").get<std::string>()),
                        io::shell_word(pair.at("camera").get<std::string>()));
  }
  std::vector<study::GloveRecording> recordings;
  {
    ProgressLine line;
    line.show("recording");
    recordings = study::record_glove(o.request);
    study::write_recordings(recordings, o.folder);
  }
  const std::optional<study::HandLag> lag = study::hand_lag(recordings);
  next += fmt::format(" --rate {}", o.request.rate_hz);
  if (lag && lag->lead_s() > 0) next += fmt::format(" --lead {:.3f}", lag->lead_s());
  next += " --neighbours --fit-all --model " + io::shell_word(o.folder + "/identified.json");
  const double duration_s = study::recommended_motion().duration_s();
  return {{{"pairs", std::move(pairs)},
           {"rate_hz", o.request.rate_hz},
           {"duration_s", duration_s},
           {"lag_s", lag ? Json(lag->finger_to_hand_s) : Json(nullptr)},
           {"sensor_lag_s", lag ? Json(lag->sensor_s) : Json(nullptr)},
           {"lead_s", lag ? Json(lag->lead_s()) : Json(nullptr)},
           {"next", next},
           {"seed", o.request.seed}},
          fmt::format("{} donning(s) of {:.0f} s in {}\nlag from finger to hand {}\nnext: {}\n",
                      o.request.donnings, duration_s, io::one_line(o.folder),
                      lag ? fmt::format("{:.0f} ms, of these {:.0f} ms to the reading",
                                        1000 * lag->finger_to_hand_s, 1000 * lag->sensor_s)
                          : "outside the search",
                      io::one_line(next))};
}

void add(CLI::App& app) {
  auto json = std::make_shared<bool>(false);
  CLI::App* command =
      app.add_subcommand("twin",
                         "The twin's parameters: value, unit and where each comes from; with record, "
                         "recordings of its glove, with wear, its glove for other commands");
  command->add_flag("--json", *json, "as a configuration file, to edit and give to --twin");
  command->require_subcommand(0, 1);
  const auto [o, record_command] = add_command(
      *command, "record",
      "Record the twin's glove as a user records a real one: a person wears it and plays the recommended "
      "motion; the glove's log, what a camera sees of the fingers and what another sees of the hand, each "
      "donning a file of its own. Then flexor identify, as with any recording",
      record);
  add_folder(*record_command, "--out", o->folder, "write the recordings into this folder")->required();
  add_shown(*record_command, "--donnings", o->request.donnings,
            "recordings of two minutes, the glove put on again for each; one is what a user does");
  add_shown(*record_command, "--rate", o->request.rate_hz, "sample rate of the glove, Hz");
  add_seed(*record_command, o->request.seed, "other than the experiment's");
  add_twin_options(*record_command, o->twin);
  wear_command::add(*command);
  command->callback([json, command] {
    const twin::Parameters p;
    if (!command->get_subcommands().empty()) return;
    if (*json) return print(twin::to_json(p));
    for (const model::Number& n : twin::numbers(p))
      print(fmt::format("{:<31}{:<34}{:<10}{}\n", n.name, model::value_text(n), n.unit, n.source));
  });
}

}  // namespace flexor::cli::twin_command
