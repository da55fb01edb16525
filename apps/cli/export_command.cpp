#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "apps/cli/commands.hpp"
#include "host/export/bids.hpp"
#include "host/export/joint_state.hpp"
#include "host/export/mot.hpp"
#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/recording/time.hpp"

namespace flexor::cli {
namespace export_command {

struct Options {
  std::vector<std::string> files;
  std::string to;
  std::string out;
  exports::AngleOptions angles;
  exports::JointStateOptions mcap;
  std::string start;
  exports::BidsOptions bids;
  bool json = false;
};

std::uint64_t start_ns(const std::string& text) {
  const auto time = recording::to_time(text);
  const bool is_date = time && recording::is_date(time->format) && !recording::is_ambiguous_date(text);
  if (!is_date || time->value < 0)
    throw io::InputError(fmt::format("--start {}: a time such as 2026-05-01T12:03:11Z is needed", text));
  return static_cast<std::uint64_t>(std::llround(time->value * 1e6)) * 1000;
}

exports::Written write(const Options& o) {
  if (o.to == "bids") return exports::write_bids({o.files.begin(), o.files.end()}, o.angles, o.bids, o.out);
  if (o.files.size() > 1)
    throw io::InputError(fmt::format("--to {} takes one recording, {} are given: export them one by one",
                                     o.to, o.files.size()));
  if (o.to == "mot") return exports::write_mot(o.files.front(), o.angles, o.out);
  exports::JointStateOptions mcap = o.mcap;
  if (!o.start.empty()) mcap.start_ns = start_ns(o.start);
  return exports::write_joint_states(o.files.front(), o.angles, mcap, o.out);
}

// An option that does nothing would be taken for one that does.
void require_of_format(const CLI::App& command, const std::string& to) {
  const std::vector<std::pair<const char*, const char*>> all = {
      {"--start", "mcap"}, {"--subject", "bids"}, {"--task", "bids"}, {"--run", "bids"}};
  for (const auto& [option, format] : all) {
    if (command.get_option(option)->count() > 0 && to != format)
      throw io::InputError(fmt::format("{} is for --to {} alone: leave it out", option, format));
  }
}

void run(const Options& o) {
  const exports::Written done = write(o);
  for (const std::string& note : done.notes) log("note: " + note);
  if (o.json) {
    nlohmann::ordered_json rate = nullptr;
    if (done.rate_hz > 0) rate = done.rate_hz;
    return print(io::dump({{"files", done.files},
                           {"joints", done.joints},
                           {"rows", done.rows},
                           {"seconds", done.seconds},
                           {"rate_hz", rate},
                           {"warnings", done.notes},
                           {"version", FLEXOR_VERSION}}));
  }
  std::string joints;
  for (const std::string& joint : done.joints) joints += (joints.empty() ? "" : ", ") + joint;
  print(fmt::format("{}: {} rows, {:.1f} s, {} joint(s): {}\n", o.out, done.rows, done.seconds,
                    done.joints.size(), joints));
}

void add_format_options(CLI::App& command, Options& o) {
  command.add_option(
      "--start", o.start,
      "mcap: time of the first row, such as 2026-05-01T12:03:11Z (default: as the recording has it where its "
      "times are dates, else now)");
  command.add_option("--subject", o.bids.subject, "bids: label of the subject, letters and digits")
      ->capture_default_str();
  command.add_option("--task", o.bids.task, "bids: label of the task")->capture_default_str();
  command
      .add_option("--run", o.bids.run,
                  "bids: number of the first recording (default: 1 where there are several)")
      ->check(CLI::Range(1, 9999));
}

}  // namespace export_command

void add_export(CLI::App& app) {
  using namespace export_command;
  auto o = std::make_shared<Options>();
  CLI::App* command =
      app.add_subcommand("export", "Recorded angles for other programs: ROS 2 and Foxglove, OpenSim, BIDS");
  command->footer(
      "mcap  one file with ROS 2 messages, sensor_msgs/msg/JointState in radians: ROS 2, Foxglove, Rerun\n"
      "mot   an OpenSim motion, degrees\n"
      "bids  a dataset folder, degrees, evenly sampled; into one that is there a subject, task or run is "
      "added\n"
      "Angles are the columns NAME_deg and NAME_rad, as `flexor apply` and `flexor track` write them; the "
      "joint is NAME.");
  command->add_option("recordings", o->files, "CSV with angles, one or, for bids, more; - is standard input")
      ->required();
  command->add_option("--to", o->to, "mcap, mot or bids")
      ->required()
      ->check(CLI::IsMember({"mcap", "mot", "bids"}));
  command->add_option("--out", o->out, "file, or folder of the dataset")->required();
  command
      ->add_option("--columns", o->angles.columns,
                   "columns with angles (default: all called NAME_deg or NAME_rad)")
      ->delimiter(',')
      ->allow_extra_args(false);
  command->add_option("--names", o->angles.names, "call joints otherwise: OLD=NEW, separated by commas")
      ->delimiter(',')
      ->allow_extra_args(false);
  command
      ->add_option("--rate", o->angles.rate_hz,
                   "put the rows onto an even grid of so many a second (default: as they are)")
      ->check(CLI::Range(0.01, 10000.0));
  add_time_options(*command, o->angles.time);
  add_format_options(*command, *o);
  command->add_flag("--json", o->json, "one JSON object on standard output");
  command->callback([o, command] {
    require_of_format(*command, o->to);
    run(*o);
  });
}

}  // namespace flexor::cli
