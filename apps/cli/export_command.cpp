#include "apps/cli/commands.hpp"
#include "host/deploy/compensator_text.hpp"
#include "host/export/joint_state.hpp"
#include "host/model/matlab.hpp"

namespace flexor::cli::export_command {

struct Options {
  std::string file;
  std::string to;
  std::string out;
  exports::RecordedOptions recorded;
  std::string model;
  std::string start;
  CLI::App* command = nullptr;
};

std::optional<double> start_s(const std::string& text) {
  if (text.empty()) return std::nullopt;
  const auto time = recording::to_time(text);
  const bool is_date = time && recording::is_date(time->format) && !time->is_ambiguous;
  if (!is_date || time->value < 0)
    throw io::InputError("--start {}: a time such as 2026-05-01T12:03:11Z is needed", text);
  return time->value;
}

// What Python writes is named with its command.
std::string format_fault(const std::string& to) {
  if (to == "mcap" || to == "matlab" || to == "cpp") return "";
  if (to == "bids" || to == "mot" || to == "mat" || to == "lsl")
    return fmt::format("{0}: is written by Python: python -m flexor.export FILE --to {0} --out OUT", to);
  return to + ": mcap, matlab or cpp is needed";
}

Output write_function(const Options& o) {
  // An option that does nothing would be taken for one that does.
  for (const char* option : {"--start", "--names", "--time-unit", "--time-column", "--log-rate", "--model"})
    if (o.command->count(option) > 0) throw io::InputError("{} is for --to mcap alone: leave it out", option);
  const std::filesystem::path out = o.out;
  const bool matlab = o.to == "matlab";
  if (out.extension() != (matlab ? ".m" : ".hpp"))
    throw io::InputError("--out {}: a file of {} ends in {}", o.out, matlab ? "MATLAB" : "C++",
                         matlab ? ".m" : ".hpp");
  const model::Model model = model::load(o.file);
  const std::string name = out.stem().string();
  std::string text;
  try {
    text = matlab ? model::matlab_text(model, name) : deploy::header_text(model, name);
  } catch (const io::InputError& error) {
    throw io::InputError("--out {}: {}", o.out, error.what());
  }
  io::write_file(out, text);
  std::vector<std::string> inputs;
  for (const model::Input& input : model.inputs) inputs.push_back(input.name);
  std::vector<std::string> joints;
  for (const model::Joint& joint : model.joints) joints.push_back(joint.name);
  return {{{"files", {o.out}},
           {"function", name},
           {"inputs", inputs},
           {"joints", joints},
           {"rate_hz", 1 / model.sample_period_s}},
          fmt::format("{}: {}, every {:g} ms; inputs: {}; joints: {}\n", o.out,
                      matlab ? fmt::format("angle_deg = {}(readings)", name) : name + "::Compensator",
                      1000 * model.sample_period_s, fmt::join(inputs, ", "), fmt::join(joints, ", "))};
}

Output run(Options& o) {
  if (o.to != "mcap") return write_function(o);
  o.recorded.ends_deg = ends_deg(o.model);
  o.recorded.start_s = start_s(o.start);
  const exports::Written done = exports::write_joint_states(o.file, o.recorded, o.out);
  for (const std::string& note : done.notes) log_note(note);
  return {{{"files", {o.out}},
           {"joints", done.joints},
           {"rows", done.rows},
           {"seconds", done.seconds},
           {"warnings", done.notes}},
          fmt::format("{}: {} rows, {:.1f} s, {} joint(s): {}\n", o.out, done.rows, done.seconds,
                      done.joints.size(), fmt::join(done.joints, ", "))};
}

void add(CLI::App& app) {
  const auto [o, command] =
      add_command(app, "export", "Recorded angles for ROS 2 and Foxglove; a model for MATLAB and C++", run);
  o->command = command;
  command->footer(
      "mcap  one file with ROS 2 messages, sensor_msgs/msg/JointState in radians: ROS 2, Foxglove, Rerun\n"
      "matlab  a model document as a function of MATLAB and GNU Octave, called like its file\n"
      "cpp   a model document as one header of C++14 in fixed point, for firmware of your own\n"
      "Angles are the columns NAME_deg and NAME_rad, as `flexor apply` and `flexor track` write them; the "
      "joint is NAME. BIDS, OpenSim, .mat and LSL: python -m flexor.export");
  command
      ->add_option("recording", o->file,
                   "CSV with angles, - is standard input; for matlab and cpp a model document")
      ->required();
  command->add_option("--to", o->to, "mcap, matlab or cpp")->required()->check(format_fault);
  command->add_option("--out", o->out, "the file")->required();
  command->add_option("--names", o->recorded.names, "call joints otherwise: OLD=NEW, separated by commas")
      ->delimiter(',')
      ->allow_extra_args(false);
  command->add_option("--model", o->model,
                      "the model that the angles are of: written as flexion, 0 at the open hand and growing "
                      "towards the fist");
  add_time_options(*command, o->recorded.time);
  command->add_option("--start", o->start,
                      "mcap: time of the first row, such as 2026-05-01T12:03:11Z (default: as the recording "
                      "has it where its times are dates, else now)");
}

}  // namespace flexor::cli::export_command
