#include <fmt/format.h>

#include <charconv>
#include <cstdint>
#include <memory>
#include <optional>

#include "apps/cli/commands.hpp"
#include "apps/cli/progress.hpp"
#include "apps/cli/stop.hpp"
#include "host/io/interrupt.hpp"
#include "host/io/json.hpp"
#include "host/report/render.hpp"
#include "host/study/boards.hpp"
#include "host/study/calibration.hpp"
#include "host/study/rendered_cameras.hpp"
#include "host/study/results.hpp"

namespace flexor::cli {
namespace {

struct Options {
  std::string gestures = "1-6";
  std::string compensators = "raw,published-w,published-hw";
  std::string twin;
  std::vector<std::string> set;
  double rate_hz = 10;
  study::Plan plan;
  std::string folder;
  std::string engine = "twin";
  std::string camera = "angles";
  std::string vcd;
  bool scenarios = false;
  bool json = false;
};

// "12.3 +- 0.4"; a single trial has no interval.
std::string with_interval(const study::Statistic& s) {
  const std::optional<double> half = s.ci95();
  return fmt::format("{:.1f} +- {}", s.mean(), half ? fmt::format("{:.1f}", *half) : "-");
}

void distances(const study::Distances& d) {
  if (!d.all) return;
  std::string line = "distance from the published table, rms of ln(ours/published): ";
  if (d.fitted) line += fmt::format("{:.3f} on {} (fitted)", d.fitted->log_rms, describe(*d.fitted));
  if (d.fitted && d.predicted) line += ", ";
  if (d.predicted)
    line += fmt::format("{:.3f} on {} (predicted)", d.predicted->log_rms, describe(*d.predicted));
  print(line + "\n");
}

void table(const study::Result& r, const study::Plan& plan) {
  constexpr const char* kRow = "{:<22}{:<16}{:>18}{:>11}{:>9}{:>9}{:>18}{:>8}{:>12}{:>10}\n";
  print(fmt::format("total error E_T in deg s, mean and 95 % interval of {} trial(s), {:g} Hz, seed {}\n\n",
                    plan.trials, 1 / plan.compensators.front().model.sample_period_s, plan.seed));
  print(fmt::format(fmt::runtime(kRow), "gesture", "compensator", "causal", "published", "to raw", "to W",
                    "lag removed", "lag", "stop hit", "pressed"));
  const auto index = [&](const char* name) {
    return static_cast<std::size_t>(std::ranges::find(r.compensators, name) - r.compensators.begin());
  };
  const std::size_t raw = index("raw");
  const std::size_t wiener = index("published-w");
  const auto ratio = [&](std::size_t m, std::size_t to, const study::Cell& cell) {
    if (to >= r.compensators.size()) return std::string("-");
    return fmt::format("{:.3f}", cell.total_deg_s.mean() / r.cell(m, to).total_deg_s.mean());
  };
  for (std::size_t m = 0; m < r.motions.size(); ++m) {
    for (std::size_t c = 0; c < r.compensators.size(); ++c) {
      const study::Cell& cell = r.cell(m, c);
      const std::string gesture =
          c > 0 ? "" : (cell.gesture > 0 ? fmt::format("{} {}", cell.gesture, cell.motion) : cell.motion);
      print(fmt::format(fmt::runtime(kRow), gesture.substr(0, 21), cell.compensator,
                        with_interval(cell.total_deg_s),
                        cell.published_deg_s ? fmt::format("{:.1f}", *cell.published_deg_s) : "-",
                        ratio(m, raw, cell), ratio(m, wiener, cell), with_interval(cell.lag_removed_deg_s),
                        fmt::format("{:.0f} ms", 1000 * cell.lag_s.mean()),
                        fmt::format("{:.0f} deg/s", cell.fastest_impact_deg_s()),
                        fmt::format("{:.2f} s", cell.total_pressed_s())));
    }
  }
  print("\n");
  distances(r.distance);
  if (r.wall_s > 0 && r.simulated_s > 0) {
    print(fmt::format("{:.0f} times real time on {} thread(s)\n", r.real_time_factor(), r.threads));
  }
}

// Mean over the motions, and how much worse than as calibrated.
void show_scenarios(const std::vector<study::ScenarioResult>& scenarios) {
  if (scenarios.empty()) return;
  const auto mean = [](const study::Result& r, std::size_t c) {
    double sum = 0;
    for (std::size_t m = 0; m < r.motions.size(); ++m) sum += r.cell(m, c).total_deg_s.mean();
    return sum / static_cast<double>(r.motions.size());
  };
  const study::Result& base = scenarios.front().result;
  print(fmt::format("\n{:<26}", "scenario, mean deg s"));
  for (const std::string& c : base.compensators) print(fmt::format("{:>18}", c));
  print(fmt::format("{:>18}{:>12}\n", "stop hit", "pressed"));
  for (const study::ScenarioResult& s : scenarios) {
    print(fmt::format("{:<26}", s.scenario.name));
    for (std::size_t c = 0; c < base.compensators.size(); ++c) {
      print(fmt::format(
          "{:>18}", fmt::format("{:.1f} (x{:.2f})", mean(s.result, c), mean(s.result, c) / mean(base, c))));
    }
    const study::Stops stops = study::stops_of(s.result);
    print(fmt::format("{:>18}{:>12}\n", fmt::format("{:.0f} deg/s", stops.impact_deg_s),
                      fmt::format("{:.2f} s", stops.pressed_s)));
  }
  print("\n");
}

std::vector<study::ScenarioResult> run_scenarios(const study::Plan& plan,
                                                 const study::TrialProgress& progress) {
  std::vector<study::ScenarioResult> out;
  for (const study::Scenario& scenario : study::scenarios()) {
    study::Plan changed = plan;
    for (const std::string& assignment : scenario.set) twin::assign(changed.parameters, assignment);
    if (!plan.folder.empty()) changed.folder = plan.folder / "scenarios" / std::to_string(out.size() + 1);
    changed.lock = nullptr;
    out.push_back({scenario, study::run(changed, progress)});
  }
  return out;
}

void show(const Options& o, const study::Result& result,
          const std::vector<study::ScenarioResult>& scenarios) {
  if (!o.json) {
    table(result, o.plan);
    show_scenarios(scenarios);
    if (!o.folder.empty()) print(fmt::format("report    {}/report.html\n", o.folder));
    return;
  }
  nlohmann::ordered_json json = study::to_json(result, o.plan);
  if (result.simulated_s > 0) {
    json["real_time_factor"] = result.real_time_factor();
  } else {
    json["real_time_factor"] = nullptr;
  }
  json["threads"] = result.threads;
  json["resumed_rows"] = result.resumed_rows;
  for (const study::ScenarioResult& s : scenarios) {
    json["scenarios"].push_back(
        {{"name", s.scenario.name}, {"cells", study::to_json(s.result, o.plan).at("cells")}});
  }
  print(io::dump(json));
}

void draw(const study::Plan& plan, const study::Result& result,
          const std::vector<study::ScenarioResult>& scenarios) {
  log("drawing figures ...");
  try {
    study::save_results(plan, result, scenarios, plan.folder);
    report::render(plan.folder, plan.stop);
  } catch (const std::exception&) {
    if (!plan.stop->load()) throw;  // gnuplot, for one, hears Ctrl-C too
    throw io::Cancelled(fmt::format(
        "stopped: all trials are kept in {}, and the same command draws the report", plan.folder.string()));
  }
}

void play(Options& o, study::Boards* boards) {
  const study::Plan& plan = o.plan;
  study::check(plan);
  std::optional<study::FolderLock> lock;  // until the report is written
  if (!o.folder.empty()) o.plan.lock = &lock.emplace(plan.folder);
  study::Result result;
  std::vector<study::ScenarioResult> scenarios;
  {
    ProgressLine line;
    const auto progress = [&](std::size_t done, std::size_t of) { line.step("experiment: batch", done, of); };
    result = study::run(plan, progress);
    if (o.scenarios) scenarios = run_scenarios(plan, progress);
  }
  if (!o.vcd.empty()) {
    log("tracing one trial ...");
    boards->trace(study::first_setup(plan, plan.motions.front(), plan.compensators.front()), o.vcd);
  }
  if (!o.folder.empty()) {
    draw(plan, result, scenarios);
  }
  show(o, result, scenarios);
}

void run(Options& o) {
  study::Plan& plan = o.plan;
  std::optional<study::Boards> boards;
  if (o.engine == "avr") plan.engine = &boards.emplace(io::program_beside(kBoardsWorker));
  std::optional<study::RenderedCameras> cameras;
  if (o.camera == "rendered") {
    plan.engine = &cameras.emplace(io::program_beside(kCameraWorker), plan.engine);
    log("both hands are filmed and tracked, frame by frame: some seconds a trial");
  }
  if (!o.vcd.empty() && o.engine != "avr") throw io::InputError("--vcd records the boards: add --engine avr");
  if (!o.vcd.empty()) io::require_writable(o.vcd);
  plan.parameters = twin_parameters(o.twin, o.set);
  std::vector<std::string> notes;
  plan.motions = study::motions(o.gestures, notes);
  for (const std::string& note : notes) log("warning: " + note);
  plan.compensators = study::compensators(o.compensators, o.rate_hz);
  plan.folder = o.folder;
  StopOnSignal stop;
  plan.stop = stop.flag();
  try {
    play(o, boards ? &*boards : nullptr);
  } catch (const io::Cancelled& stopped) {
    io::set_interruption_note(stopped.what());
    stop.end();
  }
}

struct TwinOptions {
  std::string out;
  int evaluations = 1500;
  int trials = 16;
  std::uint64_t seed = 7;
  bool json = false;
};

void run_twin(const TwinOptions& o) {
  if (o.evaluations < 1 || o.trials < 1) {
    throw io::InputError("--evaluations and --trials must be at least 1");
  }
  io::require_writable(o.out);
  study::TwinFit fit;
  {
    ProgressLine line;
    fit = study::calibrate_twin(twin::Parameters(), o.evaluations, o.trials, o.seed,
                                [&](int n, int of, double best) {
                                  line.step(fmt::format("rms of ln(ours/published) {:.3f}: evaluation", best),
                                            static_cast<std::size_t>(n), static_cast<std::size_t>(of));
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
  study::GloveRequest request;
  std::string twin;
  std::vector<std::string> set;
  std::string folder;
  bool json = false;
};

void run_glove(GloveOptions& o) {
  o.request.parameters = twin_parameters(o.twin, o.set);
  o.request.folder = o.folder;
  io::require_folder(o.folder);
  study::GloveCalibration result;
  {
    ProgressLine line;
    result = study::calibrate_glove(o.request, [&](const std::string& what) { line.show(what); });
  }
  if (o.json) {
    nlohmann::ordered_json steps = nlohmann::ordered_json::array();
    for (const study::Step& step : result.steps) {
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
  for (const study::Step& step : result.steps) {
    print(fmt::format("{:<14}", step.name));
    for (const auto& finger : step.model.fit.items()) {
      print(fmt::format("  {} {:.2f}", finger.key(), finger.value().at("fitted_rmse_deg").get<double>()));
    }
    print(fmt::format(" deg RMSE  {}\n", step.what));
  }
  print(fmt::format("lag from finger to hand {:.0f} ms; {} detail(s) that the motion does not tell\n",
                    1000 * result.lag_s, result.warnings.size()));
  print(fmt::format("compensator {}/identified.json\n", o.folder));
}

}  // namespace

std::string seed_fault(const std::string& text) {
  std::uint64_t seed = 0;
  const char* const end = text.data() + text.size();
  const auto [at, error] = std::from_chars(text.data(), end, seed);
  if (error == std::errc() && at == end) return {};
  return fmt::format("{} is no whole number from 0 to {}", text, UINT64_MAX);
}

twin::Parameters twin_parameters(const std::string& file, const std::vector<std::string>& set) {
  twin::Parameters p = file.empty() ? study::shipped_parameters() : twin::load(file);
  for (const std::string& assignment : set) twin::assign(p, assignment);
  twin::check(p);
  return p;
}

void add_experiment(CLI::App& app) {
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
  command->add_option("--seed", o->plan.seed, "everything random follows from it")
      ->check(seed_fault)
      ->capture_default_str();
  command->add_option(
      "--out", o->folder,
      "write trials.csv, results.json, figures and report.html here; goes on where a run was cut off, "
      "however it ended");
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
  command->callback([o] { run(*o); });
}

void add_calibrate_twin(CLI::App& app) {
  auto o = std::make_shared<TwinOptions>();
  CLI::App* command = app.add_subcommand("calibrate-twin",
                                         "Fit the twin's free parameters to the published averages of "
                                         "gestures 1 to 4. Gives the same bytes each "
                                         "time, and ends within 1.6 degrees and 5 % of the shipped "
                                         "configuration, which an earlier twin was fitted "
                                         "with");
  command->add_option("--out", o->out, "write the configuration here")->required();
  command->add_option("--evaluations", o->evaluations, "of the whole table")->capture_default_str();
  command->add_option("--trials", o->trials, "of each cell in an evaluation")->capture_default_str();
  command->add_option("--seed", o->seed, "other than the experiment's")
      ->check(seed_fault)
      ->capture_default_str();
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
  command->add_option("--seed", o->request.seed, "other than the experiment's")
      ->check(seed_fault)
      ->capture_default_str();
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
    const twin::Parameters p = study::shipped_parameters();
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
