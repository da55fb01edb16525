#include <fmt/format.h>

#include <memory>
#include <sstream>

#include "apps/cli/commands.hpp"
#include "apps/cli/progress.hpp"
#include "host/experiment/calibration.hpp"
#include "host/experiment/trial_report.hpp"
#include "host/io/json.hpp"

namespace flexor::cli {
namespace {

struct Options {
  std::string gestures = "1-6";
  std::string compensators = "raw,published-w,published-hw";
  std::string twin;
  std::vector<std::string> set;
  double rate_hz = 10;
  experiment::Plan plan;
  std::string folder;
  std::string engine = "twin";
  std::string camera = "angles";
  std::string vcd;
  bool scenarios = false;
  bool json = false;
};

void table(const experiment::Result& r, const experiment::Plan& plan) {
  print(fmt::format("total error E_T in deg s, mean and 95 % interval of {} trial(s), {:g} Hz, seed {}\n\n",
                    plan.trials, 1 / plan.compensators.front().model.sample_period_s, plan.seed));
  print(fmt::format("{:<22}{:<16}{:>16}{:>11}{:>9}{:>9}{:>15}{:>8}\n", "gesture", "compensator", "causal",
                    "published", "to raw", "to W", "lag removed", "lag"));
  const auto index = [&](const char* name) {
    return static_cast<std::size_t>(std::ranges::find(r.compensators, name) - r.compensators.begin());
  };
  const std::size_t raw = index("raw");
  const std::size_t wiener = index("published-w");
  const auto ratio = [&](std::size_t m, std::size_t to, const experiment::Cell& cell) {
    if (to >= r.compensators.size()) return std::string("-");
    return fmt::format("{:.3f}", cell.total_deg_s.mean() / r.cell(m, to).total_deg_s.mean());
  };
  for (std::size_t m = 0; m < r.motions.size(); ++m) {
    for (std::size_t c = 0; c < r.compensators.size(); ++c) {
      const experiment::Cell& cell = r.cell(m, c);
      const std::string gesture =
          c > 0 ? "" : (cell.gesture > 0 ? fmt::format("{} {}", cell.gesture, cell.motion) : cell.motion);
      print(fmt::format(
          "{:<22}{:<16}{:>16}{:>11}{:>9}{:>9}{:>15}{:>8}\n", gesture.substr(0, 21), cell.compensator,
          fmt::format("{:.1f} +- {:.1f}", cell.total_deg_s.mean(), cell.total_deg_s.ci95()),
          cell.published_deg_s ? fmt::format("{:.1f}", *cell.published_deg_s) : "-", ratio(m, raw, cell),
          ratio(m, wiener, cell),
          fmt::format("{:.1f} +- {:.1f}", cell.lag_removed_deg_s.mean(), cell.lag_removed_deg_s.ci95()),
          fmt::format("{:.0f} ms", 1000 * cell.lag_s.mean())));
    }
  }
  print("\n");
  if (r.log_rms.gestures_1_to_4) {
    print(fmt::format(
        "distance from the published table, rms of ln(ours/published): {:.3f} on gestures 1-4 (fitted)",
        *r.log_rms.gestures_1_to_4));
    if (r.log_rms.gestures_5_and_6)
      print(fmt::format(", {:.3f} on 5 and 6 (predicted)", *r.log_rms.gestures_5_and_6));
    print("\n");
  }
  if (r.wall_s > 0 && r.simulated_s > 0) {
    print(fmt::format("{:.0f} times real time on {} thread(s)\n", r.real_time_factor(), r.threads));
  }
}

// Mean over the motions, and how much worse than as calibrated.
void show_scenarios(const std::vector<experiment::ScenarioResult>& scenarios) {
  if (scenarios.empty()) return;
  const auto mean = [](const experiment::Result& r, std::size_t c) {
    double sum = 0;
    for (std::size_t m = 0; m < r.motions.size(); ++m) sum += r.cell(m, c).total_deg_s.mean();
    return sum / static_cast<double>(r.motions.size());
  };
  const experiment::Result& base = scenarios.front().result;
  print(fmt::format("\n{:<26}", "scenario, mean deg s"));
  for (const std::string& c : base.compensators) print(fmt::format("{:>18}", c));
  print(fmt::format("{:>18}\n", "outside limits"));
  for (const experiment::ScenarioResult& s : scenarios) {
    print(fmt::format("{:<26}", s.scenario.name));
    double excess = 0;
    for (const experiment::Cell& cell : s.result.cells) excess = std::max(excess, cell.worst_excess_deg);
    for (std::size_t c = 0; c < base.compensators.size(); ++c) {
      print(fmt::format(
          "{:>18}", fmt::format("{:.1f} (x{:.2f})", mean(s.result, c), mean(s.result, c) / mean(base, c))));
    }
    print(fmt::format("{:>18}\n", fmt::format("{:.2f} deg", excess)));
  }
  print("\n");
}

void run(Options& o, const Program& program) {
  experiment::Plan& plan = o.plan;
  if (o.engine == "avr") plan.engine = &program.require_boards();
  std::unique_ptr<experiment::Engine> filmed;
  if (o.camera == "rendered") {
    filmed = program.require_cameras().rendered(plan.engine);
    plan.engine = filmed.get();
    log("both hands are filmed and tracked, frame by frame: some seconds a trial");
  }
  if (!o.vcd.empty() && o.engine != "avr") throw io::InputError("--vcd records the boards: add --engine avr");
  if (!o.vcd.empty()) io::require_writable(o.vcd);
  plan.parameters = twin_parameters(o.twin, o.set);
  plan.motions = experiment::motions(o.gestures);
  std::istringstream names(o.compensators);
  for (std::string name; std::getline(names, name, ',');) {
    plan.compensators.push_back(experiment::compensator(name, o.rate_hz));
  }
  plan.folder = o.folder;
  if (!o.folder.empty()) io::require_folder(o.folder);
  const auto run_plan = [](const experiment::Plan& p, const std::string& what) {
    ProgressLine line;
    return experiment::run(p, [&](std::size_t done, std::size_t of) {
      line.show(fmt::format("{}: {} of {} batches", what, done, of));
    });
  };
  const experiment::Result result = run_plan(plan, "experiment");
  if (!o.vcd.empty()) {
    log("tracing one trial ...");
    program.boards->trace(experiment::first_setup(plan, plan.motions.front(), plan.compensators.front()),
                          o.vcd);
  }
  std::vector<experiment::ScenarioResult> scenarios;
  if (o.scenarios) {
    for (const experiment::Scenario& scenario : experiment::scenarios()) {
      experiment::Plan changed = plan;
      for (const std::string& assignment : scenario.set) twin::assign(changed.parameters, assignment);
      if (!o.folder.empty())
        changed.folder = plan.folder / "scenarios" / std::to_string(scenarios.size() + 1);
      scenarios.push_back({scenario, run_plan(changed, scenario.name)});
    }
  }
  if (!o.folder.empty()) {
    log("drawing figures ...");
    experiment::write_trial_report(plan, result, scenarios, plan.folder);
  }
  if (o.json) {
    nlohmann::ordered_json json = experiment::to_json(result, plan);
    for (const experiment::ScenarioResult& s : scenarios) {
      json["scenarios"].push_back(
          {{"name", s.scenario.name}, {"cells", experiment::to_json(s.result, plan).at("cells")}});
    }
    print(io::dump(json));
    return;
  }
  table(result, plan);
  show_scenarios(scenarios);
  if (!o.folder.empty()) print(fmt::format("report    {}/report.html\n", o.folder));
}

struct TwinOptions {
  std::string out;
  int evaluations = 1500;
  int trials = 16;
  std::uint64_t seed = 7;
  bool json = false;
};

void run_twin(const TwinOptions& o) {
  io::require_writable(o.out);
  experiment::TwinFit fit;
  {
    ProgressLine line;
    fit = experiment::calibrate_twin(
        twin::Parameters(), o.evaluations, o.trials, o.seed, [&](int n, int of, double best) {
          line.show(fmt::format("evaluation {} of {}: rms of ln(ours/published) {:.3f}", n, of, best));
        });
  }
  io::write_file(o.out, twin::to_json(fit.parameters));
  if (o.json) {
    const nlohmann::ordered_json json = {{"log_rms_gestures_1_to_4", fit.log_rms},
                                         {"cost", fit.cost},
                                         {"evaluations", fit.evaluations},
                                         {"file", o.out},
                                         {"seed", o.seed},
                                         {"version", FLEXOR_VERSION}};
    print(io::dump(json));
    return;
  }
  print(fmt::format(
      "rms of ln(ours/published) on gestures 1-4: {:.3f}, {} evaluations of {} trials\nwritten to {}\n",
      fit.log_rms, fit.evaluations, o.trials, o.out));
}

struct GloveOptions {
  experiment::GloveRequest request;
  std::string twin;
  std::vector<std::string> set;
  std::string folder;
  bool json = false;
};

void run_glove(GloveOptions& o) {
  o.request.parameters = twin_parameters(o.twin, o.set);
  o.request.folder = o.folder;
  io::require_folder(o.folder);
  experiment::GloveCalibration result;
  {
    ProgressLine line;
    result = experiment::calibrate_glove(o.request, [&](const std::string& what) { line.show(what); });
  }
  if (o.json) {
    nlohmann::ordered_json steps = nlohmann::ordered_json::array();
    for (const experiment::Step& step : result.steps) {
      steps.push_back({{"name", step.name},
                       {"what", step.what},
                       {"file", o.folder + "/" + step.name + ".json"},
                       {"fit", step.model.fit}});
    }
    const nlohmann::ordered_json json = {{"steps", std::move(steps)},
                                         {"lag_s", result.lag_s},
                                         {"warnings", result.warnings},
                                         {"seed", o.request.seed},
                                         {"version", FLEXOR_VERSION}};
    print(io::dump(json));
    return;
  }
  for (const experiment::Step& step : result.steps) {
    print(fmt::format("{:<14}", step.name));
    for (const auto& finger : step.model.fit.items()) {
      print(fmt::format("  {} {:.2f}", finger.key(), finger.value().at("fitted_rmse_deg").get<double>()));
    }
    print(fmt::format(" deg RMSE  {}\n", step.what));
  }
  print(fmt::format(
      "lag from finger to hand {:.0f} ms; {} detail(s) that the motion does not tell keep a safe value\n",
      1000 * result.lag_s, result.warnings.size()));
  print(fmt::format("compensator {}/identified.json\n", o.folder));
}

}  // namespace

twin::Parameters twin_parameters(const std::string& file, const std::vector<std::string>& set) {
  twin::Parameters p = file.empty() ? experiment::shipped_parameters() : twin::load(file);
  for (const std::string& assignment : set) twin::assign(p, assignment);
  twin::check(p);
  return p;
}

void add_experiment(CLI::App& app, const Program& program) {
  auto o = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "experiment", "The published experiment in the twin: gestures x compensators x trials");
  command
      ->add_option("--gestures", o->gestures,
                   "1-6, 2,4, or files: .json gesture, .csv or .txt recorded motion")
      ->capture_default_str();
  command->add_option("--trials", o->plan.trials, "trials of each gesture with each compensator")
      ->capture_default_str();
  command
      ->add_option("--compensators", o->compensators,
                   "raw, published-w, published-hw, or model files, with commas")
      ->capture_default_str();
  command->add_option("--seed", o->plan.seed, "everything random follows from it")->capture_default_str();
  command->add_option(
      "--out", o->folder,
      "write trials.csv, results.json, figures and report.html here; goes on where a run was cut off");
  command->add_option("--rate", o->rate_hz, "sample rate of the glove, Hz")->capture_default_str();
  command->add_option("--threads", o->plan.threads, "0: as many as the machine has")->capture_default_str();
  command->add_option("--twin", o->twin,
                      "configuration of the twin (default: the shipped one; flexor twin --json prints it)");
  command->add_option("--set", o->set, "change one parameter of the twin: radio.loss=0.05; may be repeated");
  command
      ->add_option(
          "--engine", o->engine,
          "twin, or avr: the firmware of both boards, instruction by instruction, with the twin around it")
      ->check(CLI::IsMember({"twin", "avr"}))
      ->capture_default_str();
  command
      ->add_option("--camera", o->camera,
                   "angles: both cameras say the angle and a little noise; rendered: they take pictures of "
                   "both hands, "
                   "which are tracked")
      ->check(CLI::IsMember({"angles", "rendered"}))
      ->capture_default_str();
  command->add_option("--vcd", o->vcd,
                      "with --engine avr: write all signals of the first trial here, for a waveform viewer");
  command->add_flag("--scenarios", o->scenarios, "also with drift, put on anew, lost and late frames");
  command->add_flag("--json", o->json, "one JSON object on standard output");
  command->callback([o, program] { run(*o, program); });
}

void add_calibrate_twin(CLI::App& app) {
  auto o = std::make_shared<TwinOptions>();
  CLI::App* command = app.add_subcommand(
      "calibrate-twin", "Fit the twin's free parameters to the published averages of gestures 1 to 4");
  command->add_option("--out", o->out, "write the configuration here")->required();
  command->add_option("--evaluations", o->evaluations, "of the whole table")->capture_default_str();
  command->add_option("--trials", o->trials, "of each cell in an evaluation")->capture_default_str();
  command->add_option("--seed", o->seed, "other than the experiment's")->capture_default_str();
  command->add_flag("--json", o->json, "one JSON object on standard output");
  command->callback([o] { run_twin(*o); });
}

void add_calibrate_glove(CLI::App& app) {
  auto o = std::make_shared<GloveOptions>();
  CLI::App* command = app.add_subcommand(
      "calibrate-glove",
      "Play a calibration motion on the twin, record it, identify a compensator for all five fingers");
  command->add_option("--out", o->folder, "write the recordings and the models into this folder")->required();
  command->add_option("--rate", o->request.rate_hz, "sample rate of the glove, Hz")->capture_default_str();
  command
      ->add_option("--rounds", o->request.rounds, "of the motion, 30 s each, the glove put on anew for each")
      ->capture_default_str();
  command->add_option("--seed", o->request.seed, "other than the experiment's")->capture_default_str();
  command->add_option("--twin", o->twin, "configuration of the twin (default: the shipped one)");
  command->add_option("--set", o->set, "change one parameter of the twin; may be repeated");
  command->add_flag("--json", o->json, "one JSON object on standard output");
  command->callback([o] { run_glove(*o); });
}

void add_twin(CLI::App& app) {
  auto json = std::make_shared<bool>(false);
  CLI::App* command =
      app.add_subcommand("twin", "The twin's parameters: value, unit and where each comes from");
  command->add_flag("--json", *json, "as a configuration file, to edit and give to --twin");
  command->callback([json] {
    const twin::Parameters p = experiment::shipped_parameters();
    if (*json) {
      print(twin::to_json(p));
      return;
    }
    for (const twin::Entry& entry : twin::table()) {
      print(fmt::format("{:<31}{:<34}{:<10}{}\n", entry.name, twin::value_text(p, entry), entry.unit,
                        entry.source));
    }
  });
}

}  // namespace flexor::cli
