#include "apps/cli/commands.hpp"
#include "host/identify/apply.hpp"
#include "host/identify/recalibrate_files.hpp"
#include "host/io/output.hpp"

namespace flexor::cli::recalibrate_command {

struct Options {
  identify::RecalibrationFiles request;
  std::string model;
  std::vector<std::string> poses;  // list, log
  std::vector<std::string> pair;   // glove, camera
  std::string out;
  bool json = false;
};

std::string in_words(const identify::Recalibration& r, const std::string& out) {
  std::string text = fmt::format("{:<16}{:>18}{:>20}\n", "", "angles change by", "uncertain by");
  for (const identify::RecalibratedJoint& joint : r.joints)
    text += fmt::format("{:<16}{:>14.1f} deg{:>13.1f} deg\n", joint.name, joint.change_deg, joint.se_deg);
  text += "\n";
  for (const identify::RecalibratedSensor& s : r.sensors)
    text += s.applied
                ? fmt::format("corrected: {}: {:.4g} times its reading {:+.4g} (standard error {:.2g})\n",
                              s.name, s.correction.gain, s.correction.shift, s.shift_se)
                : fmt::format("kept: {}\n", s.kept);
  for (const std::string& wanted : r.wanted) text += fmt::format("wanted: {}\n", wanted);
  if (r.clock)
    text += fmt::format("clock    camera minus glove {:+.3f} s, confidence {:.2f}\n", r.clock->offset_s,
                        r.clock->confidence);
  return text + fmt::format("model    {}{}\n", out, r.applied ? "" : ", the old calibration");
}

Output run(Options& o) {
  if (!o.poses.empty()) {
    o.request.poses = CLI::detail::split(o.poses.at(0), ',');
    o.request.poses_log = o.poses.at(1);
  }
  if (!o.pair.empty()) {
    o.request.pair_sensor = o.pair.at(0);
    o.request.pair_camera = o.pair.at(1);
  }
  io::require_writable(o.out);
  if (o.json && io::is_standard_output(o.out))
    throw io::InputError("--json goes to standard output: another --out, or leave out --json");
  const std::string old = io::read_file(o.model);
  o.request.model = model::load(o.model);
  const identify::Recalibration r = identify::recalibrate_files(o.request);
  // Few sensors that do not fit are named, and the others stay; most are another glove.
  const bool few_misfit = !r.misfits.empty() && 2 * r.misfits.size() < r.sensors.size();
  for (const identify::LogRanges& log : r.logs)
    if (!r.applied && !few_misfit)
      identify::check_ranges(r.model, log.file, log.columns, log.ranges, log_warning);
  // Where nothing is applied the very bytes: what was signed, compared or committed stays as it was.
  io::write_file(o.out, r.applied ? model::to_json(r.model) : old);
  return {to_json(r), in_words(r, o.out), {}, r.notes};
}

void add(CLI::App& app) {
  const auto [o, command] =
      add_command(app, "recalibrate", "Fit a model's sensors again to a glove that was put on again", run);
  command->footer(
      "All evidence goes into one estimate. Without a camera a finger counts once it was opened and closed\n"
      "over its whole range (three turns of 30 degrees). What the evidence does not determine stays,\n"
      "and what is missing is reported.");
  command->add_option("model", o->model, "model document")->required();
  command->add_option("--recording", o->request.recording, "log of ten to thirty seconds of ordinary motion");
  command
      ->add_option(
          "--poses", o->poses,
          "POSES LOG: a log of held poses as identify takes it, and in which order they are held: open,fist")
      ->expected(2)
      ->type_name("POSES LOG");
  command->add_option("--pair", o->pair, "GLOVE CAMERA: seconds with measured angles of some of the joints")
      ->expected(2)
      ->type_name("GLOVE CAMERA");
  command->add_option("--map", o->request.map,
                      "with --pair: columns of the joints' angles, index=COLUMN,... (default: by name)");
  command->add_option(
      "--input", o->request.inputs,
      "columns of the logs, one for each of the model's inputs (default: those in the model)");
  add_time_options(*command, o->request.time);
  command->add_option(
      "--prior", o->request.prior,
      "how donnings of this glove differ, as python -m flexor.donning writes it (default: the shipped one)");
  command->add_option("--out", o->out, "write the new model document here")->required();
}

}  // namespace flexor::cli::recalibrate_command
