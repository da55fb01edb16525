#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "apps/cli/commands.hpp"
#include "apps/cli/ensemble_text.hpp"
#include "apps/cli/progress.hpp"
#include "host/io/interrupt.hpp"
#include "host/io/json.hpp"
#include "host/study/twin_ensemble.hpp"

namespace flexor::cli {
namespace calibrate_twin_command {

using Json = nlohmann::ordered_json;

struct TwinOptions {
  std::string out;
  std::optional<int> evaluations;
  std::optional<int> trials;
  std::uint64_t seed = 7;
  int ensemble = 200;
  int threads = 0;
  bool json = false;
};

void draw_twins(const TwinOptions& o) {
  study::EnsembleRequest request;
  request.laboratories = o.ensemble;
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
  if (o.evaluations.value_or(1) < 1 || o.trials.value_or(1) < 1 || o.ensemble < 1) {
    throw io::InputError("--evaluations, --trials and --ensemble must be at least 1");
  }
  if (o.threads < 0 || o.threads > io::kMaxThreads) {
    throw io::InputError(
        fmt::format("--threads must be 0, as many as the machine has, to {}", io::kMaxThreads));
  }
  io::require_writable(o.out);
  draw_twins(o);
}

}  // namespace calibrate_twin_command

void add_calibrate_twin(CLI::App& app) {
  using namespace calibrate_twin_command;
  const auto [o, command] =
      add_command(app, "calibrate-twin",
                  "Draw the laboratories, values of the twin's free parameters, that the published averages "
                  "of gestures 1 to 4 leave plausible. The same machine and libraries give the same bytes",
                  run_twin);
  command->add_option("--out", o->out, "write the laboratories here")->required();
  command->add_option("--evaluations", o->evaluations,
                      "of the whole table, all chains together (default: 12000)");
  command->add_option("--trials", o->trials, "of each cell in an evaluation (default: 8)");
  command->add_option("--seed", o->seed, "other than the experiment's")
      ->check(seed_fault)
      ->capture_default_str();
  command
      ->add_option("--ensemble", o->ensemble,
                   "draw so many by Markov chains, prior times likelihood of the published averages")
      ->capture_default_str();
  command->add_option("--threads", o->threads, "0: as many as the machine has")->capture_default_str();
}

}  // namespace flexor::cli
