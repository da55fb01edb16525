#include <array>

#include "apps/cli/commands.hpp"
#include "apps/cli/progress.hpp"
#include "host/io/output.hpp"
#include "host/posture/complete_file.hpp"

namespace flexor::cli::posture_command {

struct CompleteOptions {
  std::string posture;
  std::string file;
  posture::CompleteOptions job;
  std::string model;
  recording::TimeOptions time;
  std::string out;
};

Json json_of(const posture::Completion& c, const std::vector<std::string>& warnings) {
  constexpr std::array kQualities = {"used", "missing", "implausible", "noisy", "stuck", "beyond"};
  Json inputs = Json::object();
  for (const auto& input : c.inputs) {
    for (std::size_t q = 0; q < kQualities.size(); ++q) inputs[input.name][kQualities[q]] = input.rows[q];
  }
  Json error_deg = Json::object();
  for (int j = 0; j < posture::kJoints; ++j)
    error_deg[std::string(posture::joint_name(j))] = c.mean_se_deg[j];
  return {{"rows", c.rows},
          {"inputs", inputs},
          {"shown_s", c.shown_s},
          {"shown_joints", c.shown_joints},
          {"mean_se_deg", error_deg},
          {"left_out_rmse_deg", c.left_out_rmse_deg},
          {"shape", {{"noise", c.shape.noise}, {"share", c.shape.share}}},
          {"warnings", warnings}};
}

std::vector<std::string> warnings_of(const CompleteOptions& o, const posture::Completion& c) {
  std::vector<std::string> warnings;
  const auto warn = [&](const std::string& what) { warnings.push_back(o.file + ": " + what); };
  for (const auto& [name, rows, extended] : c.inputs) {
    if (rows[1] + rows[2] + rows[3] + rows[4] > 0) {
      warn(fmt::format("{}: {} row(s) missing, {} implausible, {} noisy, {} stuck: estimated from others",
                       name, rows[1], rows[2], rows[3], rows[4]));
    }
    if (rows[5] > 0)
      warn(fmt::format("{}: {} row(s) beyond what its joints do: they end at their limits", name, rows[5]));
  }
  if (!c.extended.empty() && !o.model.empty()) {
    warn(fmt::format("{}: mostly further extended than straight: are the ends of {} right?",
                     fmt::join(c.extended, ", "), o.model));
  } else if (!c.extended.empty()) {
    warn(fmt::format("{0}: mostly further extended than straight: is flexion {1} there? then --flexion {1}",
                     fmt::join(c.extended, ", "), o.job.flexion_is_positive ? "negative" : "positive"));
  }
  if (o.job.rest_s > 0 && !c.rest_ended)
    warn(fmt::format("it ends before the {:g} s of --rest: all of it was taken for what shows the person",
                     o.job.rest_s));
  if (o.job.rest_s > 0 && c.shown_joints < posture::kJoints) {
    warn(fmt::format(
        "while at rest {} of 23 joints are shown; of the others the person's own rest is not known",
        c.shown_joints));
  }
  return warnings;
}

posture::Completion complete(const CompleteOptions& o) {
  const posture::Posture known = posture::load(o.posture);
  recording::CsvReader table(o.file, {{}, o.time, recording::Holes::all});
  io::Output out(o.out);
  ProgressLine progress;
  progress.show("learning what these inputs tell ...");
  posture::Completion completion = posture::complete_table(
      known, table, o.job, [&](const std::string& text) { out.write(text); },
      [&](std::size_t rows) {
        if (rows % 256 == 0) progress.show(fmt::format("row {}", rows));
      });
  out.commit();
  return completion;
}

Output run_complete(CompleteOptions& o) {
  if (!o.model.empty()) o.job.flexion_is_positive = true;
  o.job.ends_deg = ends_deg(o.model);
  if (!(o.job.rest_s >= 0 && o.job.rest_s <= 3600))
    throw io::InputError("--rest must be from 0 to 3600 seconds");
  io::require_writable(o.out);
  const posture::Completion c = complete(o);
  const std::vector<std::string> warnings = warnings_of(o, c);
  std::vector<std::string> inputs;
  for (const auto& input : c.inputs) inputs.push_back(input.name);
  return {
      json_of(c, warnings),
      fmt::format(
          "rows      {}\ninputs    {}\n{}expected  {:.1f} deg, mean standard error of the 23 joints\n"
          "written   {}\n",
          c.rows, fmt::join(inputs, ", "),
          c.shown_s > 0 ? fmt::format("shown     {:.2f} s of {} joints\n", c.shown_s, c.shown_joints) : "",
          c.mean_se_deg.mean(), o.out),
      warnings, c.notes};
}

void add_complete(CLI::App& posture) {
  const auto [o, command] = add_command(
      posture, "complete", "All 23 joints, with standard errors, from those that are sensed", run_complete);
  command->footer(
      "Writes t_s, NAME_deg and NAME_se_deg of each joint on the rows of FILE, and INPUT_quality of each "
      "input:\n"
      "Flexion of fingers is negative in both, unless --flexion says positive.\n"
      "Quality: 0 used, 1 missing, 2 implausible, 3 noisy (weighed against the others), 4 stuck, 5 beyond "
      "its joints' limits.");
  command->add_option("posture", o->posture, "posture document")->required();
  command
      ->add_option("file", o->file, "CSV with t_s and the sensed columns; an empty cell is a missing reading")
      ->required();
  command->add_option("--from", o->job.from, "the sensed columns: NAME_deg of a joint, or of a bend")
      ->delimiter(',')
      ->required();
  command
      ->add_option("--bends", o->job.bends,
                   "sensors of the sum of joints: index=index_mcp+index_pip; their column is "
                   "index_deg where FILE has it, else the joints' columns are summed")
      ->delimiter(',');
  add_shown(*command, "--rest", o->job.rest_s,
            "seconds at the start in which the person is shown, at rest first: every joint that FILE "
            "has is read there, later only what is sensed");
  add_choice(*command, "--flexion", o->job.flexion_is_positive, {{"negative", false}, {"positive", true}},
             "sign of bent fingers (MCP, PIP, IP, DIP), in FILE and in what is written: negative, as in "
             "posture documents, or positive, as flexor apply writes angles");
  command
      ->add_option("--model", o->model,
                   "the model that the sensed angles are of: read as flexion by the ends of its joints, 0 at "
                   "the open hand; written is positive flexion")
      ->excludes("--flexion");
  add_time_options(*command, o->time);
  command->add_option("--out", o->out, "the completed CSV")->required();
}

void add(CLI::App& app) {
  CLI::App* posture = app.add_subcommand("posture", "What sensed joints say of the whole hand");
  posture->require_subcommand(1);
  add_complete(*posture);
}

}  // namespace flexor::cli::posture_command
