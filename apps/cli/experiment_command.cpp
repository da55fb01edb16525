#include "apps/cli/commands.hpp"
#include "apps/cli/progress.hpp"
#include "host/report/render.hpp"
#include "host/study/boards.hpp"
#include "host/study/cohort.hpp"
#include "host/study/results.hpp"
#include "host/study/shards.hpp"
#include "host/twin/glove.hpp"

namespace flexor::cli {
namespace experiment_command {

struct Options {
  std::string gestures = "1-6";
  std::vector<std::string> compensators = {"raw", "published-w", "published-hw"};
  TwinFiles twin;
  double rate_hz = 10;
  study::Plan plan;
  std::string folder;
  std::string engine = "twin";
  std::string camera = "angles";
  std::string shard;
  std::vector<std::filesystem::path> shards;  // of flexor merge
  bool json = false;
};

// `shards`: from their rows; none: played.
std::vector<study::ScenarioResult> run_scenarios(const study::Plan& plan,
                                                 const std::vector<std::filesystem::path>& shards,
                                                 const study::TrialProgress& progress) {
  std::vector<study::ScenarioResult> out;
  const bool tracks = study::tracking_of(plan.compensators).has_value();
  for (const study::Scenario& scenario : study::scenarios()) {
    // Boards are not worn for minutes, and without poses there is nothing to track.
    if (scenario.worn_s > 0 && (plan.engine != nullptr || !tracks)) continue;
    study::Plan changed = plan;
    changed.scenario = scenario;
    for (const std::string& assignment : scenario.set) twin::assign(changed.parameters, assignment);
    const std::filesystem::path folder = std::filesystem::path("scenarios") / std::to_string(out.size() + 1);
    if (!plan.folder.empty()) changed.folder = plan.folder / folder;
    changed.lock = nullptr;
    std::vector<std::filesystem::path> parts = shards;
    for (std::filesystem::path& part : parts) part /= folder;
    out.push_back(
        {scenario, shards.empty() ? study::run(changed, progress) : study::merge(changed, parts, progress)});
  }
  return out;
}

void show(const Options& o, const study::Result& result,
          const std::vector<study::ScenarioResult>& scenarios) {
  Json json = study::to_json(result, o.plan);
  json["compensators"] = result.compensators;
  for (const twin::Motion& m : o.plan.motions)
    json["motions"].push_back({{"name", m.name()}, {"gesture", m.number() > 0 ? Json(m.number()) : nullptr}});
  json["real_time_factor"] = result.simulated_s > 0 ? Json(result.real_time_factor()) : Json();
  json["threads"] = result.threads;
  json["resumed_rows"] = result.resumed_rows;
  for (const study::ScenarioResult& s : scenarios) json["scenarios"].push_back(study::to_json(s));
  print({json, report::summary("experiment", json) + line_of("report", o.folder, "/report.html")}, o.json);
}

void draw(const study::Plan& plan, const study::Result& result,
          const std::vector<study::ScenarioResult>& scenarios) {
  log("writing the report ...");
  try {
    study::save_results(plan, result, scenarios, plan.folder);
    report::render(plan.folder);
  } catch (const io::Cancelled&) {
    throw io::Cancelled("stopped: all trials are kept in {}, and the same command draws the report",
                        plan.folder.string());
  }
}

void play(Options& o) {
  const study::Plan& plan = o.plan;
  study::check(plan);
  std::optional<io::FolderLock> lock;  // until the report is written
  if (!o.folder.empty()) o.plan.lock = &lock.emplace(plan.folder, "experiment");
  study::Result result;
  std::vector<study::ScenarioResult> scenarios;
  {
    ProgressLine line;
    const auto progress = [&](std::size_t done, std::size_t of) { line.step("experiment: batch", done, of); };
    result = o.shards.empty() ? study::run(plan, progress) : study::merge(plan, o.shards, progress);
    if (plan.scenarios) scenarios = run_scenarios(plan, o.shards, progress);
  }
  if (plan.shard)
    return print(
        {{{"shard", *plan.shard}, {"folder", io::to_utf8(o.folder)}},
         fmt::format("shard {} of {} is done in {}; when all are: flexor merge FOLDER... --out FOLDER\n",
                     plan.shard->index, plan.shard->of, o.folder)},
        o.json);
  log_warnings(study::warnings(result, plan));
  if (!o.folder.empty()) draw(plan, result, scenarios);
  show(o, result, scenarios);
}

// What plays the trials in place of the twin; outlives them.
struct Engines {
  study::Engine* find(bool has_boards, bool is_filmed) {
    study::Engine* out = nullptr;
    if (has_boards) out = &boards.emplace(io::program_beside(kBoardsWorker));
    if (is_filmed) out = &cameras.emplace(io::program_beside(kCameraWorker), out);
    return out;
  }
  std::optional<study::Boards> boards;
  std::optional<study::RenderedCameras> cameras;
};

// A shard that was stopped asks for another go (75, EX_TEMPFAIL): a queue gives it one.
void play_until_stopped(Options& o) {
  try {
    play(o);
  } catch (const io::Cancelled& stopped) {
    if (!o.plan.shard) throw;
    log(std::string("flexor: ") + stopped.what());
    throw JobEnded{kGoOnLater};
  }
}

void run_merge(Options& o) {
  if (study::is_cohort(o.shards.front())) {
    study::merge_cohort(o.shards, o.folder);
    return print({{{"folder", io::to_utf8(o.folder)}},
                  fmt::format("table    {0}/cohort.csv\nmodels   {0}/models\n", o.folder)},
                 o.json);
  }
  Engines engines;
  study::Shards shards = study::read_shards(o.shards, [&](const std::string& name) {
    return engines.find(name.starts_with("avr"), name.ends_with("rendered cameras"));
  });
  o.plan = std::move(shards.plan);
  o.shards = std::move(shards.folders);
  o.plan.folder = o.folder;
  play_until_stopped(o);
}

// Whose sensors read nowhere as the twin's do.
void warn_of_another_glove(const study::Compensator& one, const twin::Parameters& p) {
  const twin::Divider divider(p);
  for (const model::Input& input : one.model.inputs) {
    if (!input.readings || input.strip.empty()) continue;
    const std::size_t finger = model::finger_index(input.strip);
    const auto reading = divider.reading(input.unit, input.name);
    const double low = reading(divider.counts(p.bend_lower_deg[finger]));
    const double high = reading(divider.counts(p.bend_upper_deg[finger]));
    const std::vector<double>& made = input.readings->reading;
    if (made.back() > low && made.front() < high) continue;
    return log_warnings(
        {fmt::format("{}: {} reads {:.4g} to {:.4g} where it was made, {:.4g} to {:.4g} in the twin: it is "
                     "of another glove, "
                     "and its errors here say nothing; flexor twin record records the twin's own",
                     one.name, input.name, made.front(), made.back(), low, high)});
  }
}

void run(Options& o) {
  study::Plan& plan = o.plan;
  if (!o.shard.empty()) plan.shard = study::parse_shard(o.shard);
  Engines engines;
  plan.engine = engines.find(o.engine == "avr", o.camera == "rendered");
  if (o.camera == "rendered") log("both hands are filmed and tracked, frame by frame: some seconds a trial");
  plan.parameters = twin_parameters(o.twin);
  std::vector<std::string> notes;
  plan.motions = study::motions(o.gestures, &notes);
  log_warnings(notes);
  plan.compensators = study::compensators(o.compensators, o.rate_hz);
  for (study::Compensator& one : plan.compensators) {
    notes.clear();
    one.model = deploy::on_hand(std::move(one.model), plan.parameters, notes);
    const std::string& unit = one.model.inputs.front().unit;
    if (unit != "deg" && !unit.empty())
      notes.push_back(fmt::format("reads {}: the twin's glove gives it that, by its divider of {:g} kohm",
                                  unit, plan.parameters.divider_kohm));
    for (const std::string& note : notes) log(fmt::format("{}: {}", one.name, note));
    warn_of_another_glove(one, plan.parameters);
  }
  plan.folder = o.folder;
  play_until_stopped(o);
}

void add(CLI::App& app) {
  const auto [o, command] = add_command(
      app, "experiment", "The published experiment in the twin: gestures x compensators x trials", run);
  add_shown(*command, "--gestures", o->gestures,
            "1-6, 2,4, or files: .json gesture, .csv or .txt recorded motion");
  add_shown(*command, "--trials", o->plan.trials, "trials of each gesture with each compensator");
  add_shown(*command, "--compensators", o->compensators,
            "raw, published-w, published-hw, or model files, with commas")
      ->delimiter(',');
  add_seed(*command, o->plan.seed);
  add_folder(*command, "--out", o->folder,
             "write trials.csv, results.json, figures and report.html here; goes on where a run was "
             "cut off, however it ended");
  add_shown(*command, "--rate", o->rate_hz, "sample rate of the glove, Hz");
  add_shown(*command, "--threads", o->plan.threads, "0: as many as the machine has");
  add_twin_options(*command, o->twin,
                   "configuration of the twin (default: the shipped one; flexor twin --json prints it)");
  add_shown(*command, "--engine", o->engine,
            "twin, or avr: the firmware of both boards, instruction by instruction, with the twin around it")
      ->check(CLI::IsMember({"twin", "avr"}));
  add_shown(*command, "--camera", o->camera,
            "angles: both cameras say the angle and a little noise; rendered: they take pictures of "
            "both hands, which are tracked")
      ->check(CLI::IsMember({"angles", "rendered"}));
  command->add_flag(
      "--scenarios", o->plan.scenarios,
      "also with half-open poses, the glove re-donned, another person, drift, lost and late frames; where a "
      "compensator has its sensors' poses, also worn for minutes, tracked and not");
  command->add_option("--shard", o->shard,
                      "2/8: only that part, on one of eight machines; flexor merge puts them together");
}

}  // namespace experiment_command

void merge_command::add(CLI::App& app) {
  using namespace experiment_command;
  const auto [o, command] = add_command(
      app, "merge",
      "Shards of an experiment or a cohort to the folder of the whole: the bytes that one machine writes",
      run_merge);
  command->add_option("DIR", o->shards, "the shards' folders, in any order")->required();
  add_folder(*command, "--out", o->folder, "the folder of the whole run")->required();
}

}  // namespace flexor::cli
