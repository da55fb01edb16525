#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "apps/cli/commands.hpp"
#include "apps/cli/ensemble_text.hpp"
#include "apps/cli/progress.hpp"
#include "host/io/interrupt.hpp"
#include "host/io/json.hpp"
#include "host/study/null_model.hpp"
#include "host/study/twin_ensemble.hpp"
#include "host/study/twin_fit.hpp"

namespace flexor::cli {
namespace calibrate_twin_command {

using Json = nlohmann::ordered_json;

struct TwinOptions {
  std::string out;
  std::optional<int> evaluations;
  std::optional<int> trials;
  std::uint64_t seed = 7;
  std::optional<int> ensemble;
  int threads = 0;
  bool json = false;
};

void fit_twin(const TwinOptions& o) {
  const int trials = o.trials.value_or(twin::kTrialsAtOnce);
  study::TwinFit fit;
  {
    ProgressLine line;
    const auto progress = [&](int n, int of, double best) {
      line.step(fmt::format("rms of ln(ours/published) {:.3f}: evaluation", best),
                static_cast<std::size_t>(n), static_cast<std::size_t>(of));
    };
    fit = study::calibrate_twin(twin::Parameters(), o.evaluations.value_or(2000), trials, o.seed, progress);
    io::write_file(o.out, twin::to_json(fit.parameters));
  }
  if (o.json) {
    const Json json = {{"log_rms_gestures_1_to_4", fit.log_rms},
                       {"null_model", study::to_json(study::null_model())},
                       {"cost", fit.cost},
                       {"evaluations", fit.evaluations},
                       {"file", o.out},
                       {"seed", o.seed},
                       {"version", FLEXOR_VERSION}};
    return print(io::dump(json));
  }
  print(fmt::format(
      "rms of ln(ours/published) on gestures 1-4: {:.3f} (one constant for each compensator: {:.3f}), {} "
      "evaluations of {} trials\nwritten to {}\n",
      fit.log_rms, study::null_model().fitted_log_rms, fit.evaluations, trials, o.out));
}

void draw_twins(const TwinOptions& o) {
  study::EnsembleRequest request;
  request.laboratories = *o.ensemble;
  request.evaluations = o.evaluations.value_or(request.evaluations);
  request.trials = o.trials.value_or(request.trials);
  request.seed = o.seed;
  request.threads = o.threads;
  io::StopOnSignal stop;
  request.stop = stop.flag();
  study::Ensemble ensemble;
  try {
    ProgressLine line;
    ensemble = study::draw_ensemble(request, [&](int step, int of) {
      line.step("drawing laboratories: step", static_cast<std::size_t>(step), static_cast<std::size_t>(of));
    });
  } catch (const io::Cancelled&) {
    io::set_interruption_note("stopped: nothing is written before all laboratories are drawn");
    stop.end();
  }
  io::write_file(o.out, study::to_json(ensemble));
  if (const std::string doubt = ensemble.doubt(); !doubt.empty()) log_warning(doubt);
  if (!o.json) {
    print(ensemble_text(ensemble));
    print(fmt::format("written to {}\n", o.out));
    return;
  }
  Json parameters = Json::array();
  for (const study::Posterior& q : ensemble.posterior) {
    parameters.push_back({{"name", q.name},
                          {"median", q.median},
                          {"low", q.low},
                          {"high", q.high},
                          {"r_hat", q.r_hat},
                          {"effective", q.effective}});
  }
  print(io::dump(Json{{"laboratories", ensemble.values.size()},
                      {"acceptance", ensemble.acceptance},
                      {"worst_r_hat", ensemble.worst_r_hat()},
                      {"least_effective", ensemble.least_effective()},
                      {"chains", ensemble.chains},
                      {"warm_up", ensemble.warm_up},
                      {"kept", ensemble.kept},
                      {"parameters", std::move(parameters)},
                      {"file", o.out},
                      {"seed", o.seed},
                      {"version", FLEXOR_VERSION}}));
}

void run_twin(const TwinOptions& o) {
  if (o.evaluations.value_or(1) < 1 || o.trials.value_or(1) < 1 || o.ensemble.value_or(1) < 1) {
    throw io::InputError("--evaluations, --trials and --ensemble must be at least 1");
  }
  if (o.threads < 0 || o.threads > io::kMaxThreads) {
    throw io::InputError(
        fmt::format("--threads must be 0, as many as the machine has, to {}", io::kMaxThreads));
  }
  io::require_writable(o.out);
  o.ensemble ? draw_twins(o) : fit_twin(o);
}

}  // namespace calibrate_twin_command

void add_calibrate_twin(CLI::App& app) {
  using namespace calibrate_twin_command;
  const auto [o, command] =
      add_command(app, "calibrate-twin",
                  "Fit the twin's free parameters to the published averages of gestures 1 to 4, or draw "
                  "the laboratories that these leave plausible. The same machine and libraries give the "
                  "same bytes each time; on others the fit ends within 0.02 of the same distance, rms of "
                  "ln(ours/published)",
                  run_twin);
  command->add_option("--out", o->out, "write the configuration, or with --ensemble the laboratories, here")
      ->required();
  command->add_option("--evaluations", o->evaluations,
                      "of the whole table (default: 2000; with --ensemble 12000, all chains together)");
  command->add_option("--trials", o->trials,
                      "of each cell in an evaluation (default: 16; with --ensemble 8)");
  command->add_option("--seed", o->seed, "other than the experiment's")
      ->check(seed_fault)
      ->capture_default_str();
  command->add_option(
      "--ensemble", o->ensemble,
      "draw so many twins by Markov chains, prior times likelihood of the published averages");
  command->add_option("--threads", o->threads, "with --ensemble; 0: as many as the machine has")
      ->capture_default_str();
}

}  // namespace flexor::cli
