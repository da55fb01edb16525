#include <fmt/format.h>
#include <fmt/ranges.h>

#include <optional>

#include "apps/cli/commands.hpp"
#include "host/deploy/compensator_text.hpp"
#include "host/export/bids.hpp"
#include "host/export/joint_state.hpp"
#include "host/export/mot.hpp"
#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/model/matlab.hpp"
#include "host/recording/time.hpp"

namespace flexor::cli {
namespace export_command {

struct Options {
  std::vector<std::string> files;
  std::string to;
  std::string out;
  exports::AngleOptions angles;
  std::string model;
  std::string start;
  exports::BidsOptions bids;
  bool json = false;
};

constexpr const char* kRecorded = "mcap, mot and bids";

std::optional<double> start_s(const std::string& text) {
  if (text.empty()) return std::nullopt;
  const auto time = recording::to_time(text);
  const bool is_date = time && recording::is_date(time->format) && !recording::is_ambiguous_date(text);
  if (!is_date || time->value < 0)
    throw io::InputError(fmt::format("--start {}: a time such as 2026-05-01T12:03:11Z is needed", text));
  return time->value;
}

exports::Written write(const Options& o) {
  if (o.to == "bids") return exports::write_bids({o.files.begin(), o.files.end()}, o.angles, o.bids, o.out);
  if (o.to == "mot") return exports::write_mot(o.files.front(), o.angles, o.out);
  return exports::write_joint_states(o.files.front(), o.angles, start_s(o.start), o.out);
}

bool is_of_model(const std::string& to) { return to == "matlab" || to == "cpp"; }

// An option that does nothing would be taken for one that does.
void require_of_format(const CLI::App& command, const std::string& to) {
  const std::vector<std::pair<const char*, const char*>> all = {
      {"--start", "mcap"},       {"--subject", "bids"},      {"--task", "bids"},
      {"--run", "bids"},         {"--columns", kRecorded},   {"--names", kRecorded},
      {"--rate", kRecorded},     {"--time-unit", kRecorded}, {"--time-column", kRecorded},
      {"--log-rate", kRecorded}, {"--model", kRecorded}};
  for (const auto& [option, format] : all) {
    const bool fits = format == std::string(kRecorded) ? !is_of_model(to) : to == format;
    if (command.get_option(option)->count() > 0 && !fits)
      throw io::InputError(fmt::format("{} is for --to {} alone: leave it out", option, format));
  }
}

void write_function(const Options& o) {
  const std::filesystem::path out = o.out;
  const bool matlab = o.to == "matlab";
  if (out.extension() != (matlab ? ".m" : ".hpp"))
    throw io::InputError(fmt::format("--out {}: a file of {} ends in {}", o.out, matlab ? "MATLAB" : "C++",
                                     matlab ? ".m" : ".hpp"));
  const model::Model model = model::load(o.files.front());
  const std::string name = out.stem().string();
  std::string text;
  try {
    text = matlab ? model::matlab_text(model, name) : deploy::header_text(model, name);
  } catch (const io::InputError& error) {
    throw io::InputError(fmt::format("--out {}: {}", o.out, error.what()));
  }
  io::write_file(out, text);
  std::vector<std::string> inputs;
  for (const model::Input& input : model.inputs) inputs.push_back(input.name);
  std::vector<std::string> joints;
  for (const model::Joint& joint : model.joints) joints.push_back(joint.name);
  if (o.json) {
    return print(io::dump({{"files", {o.out}},
                           {"function", name},
                           {"inputs", inputs},
                           {"joints", joints},
                           {"rate_hz", 1 / model.sample_period_s},
                           {"version", FLEXOR_VERSION}}));
  }
  print(fmt::format("{}: {}, every {:g} ms; inputs: {}; joints: {}\n", o.out,
                    matlab ? fmt::format("angle_deg = {}(readings)", name) : name + "::Compensator",
                    1000 * model.sample_period_s, fmt::join(inputs, ", "), fmt::join(joints, ", ")));
}

void run(Options& o) {
  if (o.files.size() > 1 && o.to != "bids")
    throw io::InputError(fmt::format("--to {} takes one {}, {} are given: export them one by one", o.to,
                                     is_of_model(o.to) ? "model" : "recording", o.files.size()));
  if (is_of_model(o.to)) return write_function(o);
  o.angles.ends_deg = ends_deg(o.model);
  const exports::Written done = write(o);
  for (const std::string& note : done.notes) log_note(note);
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
  print(fmt::format("{}: {} rows, {:.1f} s, {} joint(s): {}\n", o.out, done.rows, done.seconds,
                    done.joints.size(), fmt::join(done.joints, ", ")));
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

std::map<std::string, std::pair<double, double>> ends_deg(const std::string& file) {
  std::map<std::string, std::pair<double, double>> out;
  if (file.empty()) return out;
  const model::Model model = model::load(file);
  for (const model::Joint& joint : model.joints) {
    const model::Ends ends = model::ends(model, joint);
    out[joint.name] = {ends.open_deg, ends.fist_deg};
  }
  return out;
}

void add_export(CLI::App& app) {
  using namespace export_command;
  auto o = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "export",
      "Recorded angles for other programs (ROS 2 and Foxglove, OpenSim, BIDS); a model for MATLAB and C++");
  command->footer(
      "mcap  one file with ROS 2 messages, sensor_msgs/msg/JointState in radians: ROS 2, Foxglove, Rerun\n"
      "mot   an OpenSim motion, degrees\n"
      "bids  a dataset folder, degrees, evenly sampled; into one that is there a subject, task or run is "
      "added\n"
      "matlab  a model document as a function of MATLAB and GNU Octave, called like its file\n"
      "cpp   a model document as one header of C++14 in fixed point, for firmware of your own\n"
      "Angles are the columns NAME_deg and NAME_rad, as `flexor apply` and `flexor track` write them; the "
      "joint is NAME.");
  command
      ->add_option(
          "recordings", o->files,
          "CSV with angles, one or, for bids, more; - is standard input; for matlab and cpp a model document")
      ->required();
  command->add_option("--to", o->to, "mcap, mot, bids, matlab or cpp")
      ->required()
      ->check(CLI::IsMember({"mcap", "mot", "bids", "matlab", "cpp"}));
  command->add_option("--out", o->out, "file, or folder of the dataset")->required();
  command
      ->add_option("--columns", o->angles.columns,
                   "columns with angles (default: all called NAME_deg or NAME_rad)")
      ->delimiter(',')
      ->allow_extra_args(false);
  command->add_option("--names", o->angles.names, "call joints otherwise: OLD=NEW, separated by commas")
      ->delimiter(',')
      ->allow_extra_args(false);
  command->add_option("--model", o->model,
                      "the model that the angles are of: written as flexion, 0 at the open hand and growing "
                      "towards the fist");
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
