#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/cli/commands.hpp"
#include "apps/cli/ensemble_text.hpp"
#include "apps/cli/progress.hpp"
#include "apps/cli/stop.hpp"
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
  bool sensitivity = false;
  bool json = false;
};

Json to_json(const study::Sensitivity::At& at) {
  Json table = Json::object();
  for (std::size_t g = 0; g < at.errors_deg_s.size(); ++g) {
    Json row = Json::object();
    for (std::size_t c = 0; c < study::kPublishedCompensators; ++c) {
      row[study::published_compensators()[c]] = at.errors_deg_s[g][c];
    }
    table[std::to_string(g + 1)] = std::move(row);
  }
  return {{"value", at.value},
          {"log_rms_gestures_1_to_4", at.log_rms_fitted},
          {"log_rms_gestures_5_and_6", at.log_rms_other},
          {"total_error_deg_s", std::move(table)}};
}

Json to_json(const std::vector<study::Sensitivity>& all) {
  Json out = Json::array();
  for (std::size_t i = 1; i < all.size(); ++i) {
    out.push_back({{"parameter", all[i].name}, {"low", to_json(all[i].low)}, {"high", to_json(all[i].high)}});
  }
  Json here = to_json(all.front().low);
  here.erase("value");
  return {{"at_the_fit", std::move(here)}, {"parameters", std::move(out)}};
}

// A compensator's error at `at` beside that at the fit: geometric mean over the gestures.
double change(const study::Sensitivity::At& at, const study::Sensitivity::At& fit, std::size_t c) {
  double sum = 0;
  for (std::size_t g = 0; g < at.errors_deg_s.size(); ++g) {
    sum += std::log(at.errors_deg_s[g][c] / fit.errors_deg_s[g][c]);
  }
  return std::exp(sum / static_cast<double>(at.errors_deg_s.size()));
}

void show(const std::vector<study::Sensitivity>& all) {
  constexpr const char* kRow = "{:<32}{:>10}{:>12}{:>12}{:>8}{:>8}{:>8}\n";
  print(
      "\none parameter at the 5 and the 95 % quantile of what is plausible, all others at the fit: distance "
      "from "
      "the published table, and E_T beside that at the fit (geometric mean of six gestures)\n");
  print(fmt::format(fmt::runtime(kRow), "parameter", "value", "gest. 1-4", "gest. 5-6", "Raw", "W", "HW"));
  const study::Sensitivity::At& fit = all.front().low;
  for (const study::Sensitivity& s : all) {
    for (const study::Sensitivity::At* at : {&s.low, &s.high}) {
      const bool is_fit = s.name.empty();
      print(fmt::format(
          fmt::runtime(kRow), is_fit ? "the fit" : s.name, is_fit ? "" : fmt::format("{:.4g}", at->value),
          fmt::format("{:.3f}", at->log_rms_fitted), fmt::format("{:.3f}", at->log_rms_other),
          fmt::format("{:.2f}", change(*at, fit, 0)), fmt::format("{:.2f}", change(*at, fit, 1)),
          fmt::format("{:.2f}", change(*at, fit, 2))));
      if (is_fit) break;
    }
  }
}

void fit_twin(const TwinOptions& o) {
  const int trials = o.trials.value_or(twin::kTrialsAtOnce);
  study::TwinFit fit;
  std::vector<study::Sensitivity> sensitivity;
  {
    ProgressLine line;
    const auto progress = [&](int n, int of, double best) {
      line.step(fmt::format("rms of ln(ours/published) {:.3f}: evaluation", best),
                static_cast<std::size_t>(n), static_cast<std::size_t>(of));
    };
    fit = study::calibrate_twin(twin::Parameters(), o.evaluations.value_or(2000), trials, o.seed, progress);
    io::write_file(o.out, twin::to_json(fit.parameters));
    if (o.sensitivity) {
      sensitivity = study::sensitivity(fit.parameters, trials, o.seed, [&](int n, int of, double) {
        line.step("sensitivity: parameter", static_cast<std::size_t>(n), static_cast<std::size_t>(of));
      });
    }
  }
  if (o.json) {
    Json json = {{"log_rms_gestures_1_to_4", fit.log_rms},
                 {"null_model", study::to_json(study::null_model())},
                 {"cost", fit.cost},
                 {"evaluations", fit.evaluations},
                 {"file", o.out},
                 {"seed", o.seed},
                 {"version", FLEXOR_VERSION}};
    if (o.sensitivity) json["sensitivity"] = to_json(sensitivity);
    print(io::dump(json));
    return;
  }
  print(fmt::format(
      "rms of ln(ours/published) on gestures 1-4: {:.3f} (one constant for each compensator: {:.3f}), {} "
      "evaluations of {} trials\nwritten to {}\n",
      fit.log_rms, study::null_model().fitted_log_rms, fit.evaluations, trials, o.out));
  if (o.sensitivity) show(sensitivity);
}

void draw_twins(const TwinOptions& o) {
  if (o.sensitivity) throw io::InputError("--sensitivity is of one twin: leave out --ensemble");
  study::EnsembleRequest request;
  request.base = study::shipped_parameters();
  request.laboratories = *o.ensemble;
  request.evaluations = o.evaluations.value_or(request.evaluations);
  request.trials = o.trials.value_or(request.trials);
  request.seed = o.seed;
  request.threads = o.threads;
  StopOnSignal stop;
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
  if (const std::string doubt = ensemble.doubt(); !doubt.empty()) log("warning: " + doubt);
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
  command->add_flag("--sensitivity", o->sensitivity,
                    "also what each free parameter does to the distance and to the table");
  command->add_flag("--json", o->json, "one JSON object on standard output");
}

}  // namespace flexor::cli
