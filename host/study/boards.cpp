#include "host/study/boards.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "host/deploy/pair_key.hpp"
#include "host/io/json.hpp"
#include "host/study/builtin.hpp"
#include "host/study/exact_json.hpp"
#include "host/twin/glove.hpp"
#include "host/twin/random.hpp"

namespace flexor::study {
namespace {

// Finite angles of one length: what a trial of this program's own worker has.
bool is_sane(const twin::Trial& trial) {
  const std::size_t frames = trial.glove_deg[0].size();
  const auto good = [&](const std::vector<float>& angles) {
    return angles.size() == frames && std::ranges::all_of(angles, [](float a) { return std::abs(a) < 1e4F; });
  };
  return frames > 0 && std::ranges::all_of(trial.glove_deg, good) &&
         std::ranges::all_of(trial.hand_deg, good) && trial.frames_sent >= 0 && trial.frames_lost >= 0;
}

}  // namespace

deploy::Key bench_key() { return deploy::key_from_hex("000102030405060708090a0b0c0d0e0f"); }

deploy::Glove twin_glove(const twin::TrialInput& input) {
  const twin::Divider divider(input.parameters);
  const model::Wiring wiring = model::wiring_of(input.compensator);
  deploy::CalibrationDocument calibration;
  for (std::size_t i = 0; i < kFingers; ++i) {
    if (!wiring.input[i]) continue;
    const model::Input& one = input.compensator.inputs[*wiring.input[i]];
    if (one.unit == "count" || deploy::reads_alpha(one)) continue;
    calibration.unit = one.unit;
    calibration.sensor[i] = deploy::at_knots(divider.reading(one.unit, one.name));
  }
  return deploy::glove_for(input.parameters, input.compensator, bench_key(), calibration);
}

Counts gesture_counts(const twin::Parameters& p, const model::Model& model) {
  model::Model raw = compensator("raw", 1 / model.sample_period_s).model;
  for (model::Input& input : raw.inputs) input.unit = "count";
  Counts out;
  for (const twin::Motion& motion : motions("1-6")) {
    const twin::TrialInput input{p, motion, raw, 1, true};
    const twin::Trial trial = twin::simulate(input, 0, 1).front();
    for (std::size_t k = 0; k < trial.sample_s.size(); ++k) {
      std::array<int, kFingers>& counts = out.emplace_back();
      for (std::size_t i = 0; i < kFingers; ++i) counts[i] = static_cast<int>(trial.reading[i][k]);
    }
  }
  return out;
}

std::vector<twin::Trial> Boards::simulate(const twin::TrialInput& input, std::uint64_t first,
                                          int count) const {
  auto out = workers_.run("simulate", {{"input", input}, {"first", first}, {"count", count}})
                 .get<std::vector<twin::Trial>>();
  if (out.size() != static_cast<std::size_t>(count) || !std::ranges::all_of(out, is_sane)) {
    throw io::JobError(
        "the boards' simulation was asked for {} trials, and not as many of finite angles came back", count);
  }
  return out;
}

deploy::GloveFigures Boards::run_glove(const deploy::Glove& glove, const Counts& counts) const {
  return workers_.run("run_glove", {{"glove", glove}, {"counts", counts}}).get<deploy::GloveFigures>();
}

deploy::HandFigures Boards::run_hand(const model::Hardware& hardware, const deploy::Glove& glove,
                                     double seconds) const {
  const Json request = {{"hardware", model::to_json(hardware)}, {"glove", glove}, {"seconds", seconds}};
  return workers_.run("run_hand", request).get<deploy::HandFigures>();
}

std::vector<Latency> Boards::latency(const twin::Parameters& parameters, const model::Model& model, int edges,
                                     std::uint64_t seed) const {
  const Json stages = workers_.run(
      "latency", {{"parameters", parameters}, {"model", model}, {"edges", edges}, {"seed", seed}});
  return stages.get<std::vector<Latency>>();
}

Json budget_of(const std::vector<Latency>& edges, int asked) {
  if (edges.empty()) throw io::JobError("no edge came through to the motor");
  const auto row = [&](const auto& ms_of) -> Json {
    std::vector<double> ms;
    for (const Latency& edge : edges) ms.push_back(ms_of(edge));
    double mean_ms = 0;
    for (const double one : ms) mean_ms += one / static_cast<double>(ms.size());
    return {{"mean_ms", mean_ms}, {"min_ms", std::ranges::min(ms)}, {"max_ms", std::ranges::max(ms)}};
  };
  Json stages = Json::array();
  for (std::size_t i = 0; i < kLatencyStages.size(); ++i) {
    stages.push_back(row([i](const Latency& edge) { return edge[i]; }));
    stages.back()["name"] = kLatencyStages[i];
  }
  const auto whole = [](const Latency& edge) { return std::accumulate(edge.begin(), edge.end(), 0.0); };
  return {{"edges", edges.size()},
          {"lost", asked - std::ssize(edges)},
          {"stages", std::move(stages)},
          {"total", row(whole)}};
}

void save_results(const Json& budget, const std::string& title, const std::filesystem::path& folder) {
  io::make_folder(folder);
  Json rows = budget.at("stages");
  rows.push_back(budget.at("total"));
  rows.back()["name"] = "total";
  std::string csv = "stage,mean_ms,min_ms,max_ms\n";
  for (const Json& r : rows)
    csv += fmt::format("{},{:.4f},{:.4f},{:.4f}\n", r.at("name").get<std::string>(),
                       r.at("mean_ms").get<double>(), r.at("min_ms").get<double>(),
                       r.at("max_ms").get<double>());
  io::write_file(folder / "latency.csv", csv);
  Json json = {{"kind", "latency"}, {"title", title}, {"version", FLEXOR_VERSION}};
  json.update(budget);
  io::write_file(folder / "results.json", io::dump(json));
}

std::vector<twin::Trial> RenderedCameras::simulate(const twin::TrialInput& input, std::uint64_t first,
                                                   int count) const {
  twin::TrialInput exact = input;
  exact.parameters.camera_noise_deg = 0;
  std::vector<twin::Trial> trials =
      inner_ != nullptr ? inner_->simulate(exact, first, count) : twin::simulate(exact, first, count);
  for (std::size_t t = 0; t < trials.size(); ++t) {
    const Json seen =
        workers_.run("see", {{"joints", Json::parse(builtin("joints/paper_hand.json"))},
                             {"seed", twin::seed_of(input.seed, first + t, twin::seed_of(1, 'f'))},
                             {"rate_hz", input.parameters.camera_rate_hz},
                             {"glove_deg", trials[t].glove_deg},
                             {"hand_deg", trials[t].hand_deg}});
    seen.at("glove_deg").get_to(trials[t].glove_deg);
    seen.at("hand_deg").get_to(trials[t].hand_deg);
  }
  return trials;
}

}  // namespace flexor::study
