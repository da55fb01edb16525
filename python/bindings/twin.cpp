#include "host/twin/parameters.hpp"

#include <fmt/format.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "host/deploy/hardware.hpp"
#include "host/study/glove_recording.hpp"
#include "host/study/laboratory.hpp"
#include "host/study/log_rms.hpp"
#include "host/study/shards.hpp"
#include "host/study/trials.hpp"
#include "host/study/twin_table.hpp"
#include "host/twin/random.hpp"
#include "python/bindings/job.hpp"
#include "python/bindings/model.hpp"
#include "python/bindings/rooms.hpp"

namespace flexor::python {
namespace {

// `document`: of flexor twin --json; empty: the shipped one.
twin::Parameters to_parameters(const std::string& document, const std::vector<std::string>& changes) {
  twin::Parameters out = document.empty() ? twin::Parameters() : twin::from_json(document, "twin");
  for (const std::string& change : changes) twin::assign(out, change);
  twin::check(out);
  return out;
}

// (glove, camera, hand) of each donning
nb::list record(const std::string& document, const std::vector<std::string>& changes, int donnings,
                double rate_hz, std::uint64_t seed, const nb::object& show) {
  const study::GloveRequest request{to_parameters(document, changes), rate_hz, donnings, seed};
  std::vector<study::GloveRecording> recordings =
      run(show, [&](Progress&) { return study::record_glove(request); });
  nb::list out;
  for (study::GloveRecording& one : recordings)
    out.append(nb::make_tuple(to_python(std::move(one.glove)), to_python(std::move(one.camera)),
                              to_python(std::move(one.hand))));
  return out;
}

// Compensators by name, or (name, model).
std::vector<study::Compensator> to_compensators(const nb::list& list, double rate_hz) {
  std::vector<study::Compensator> out;
  for (const nb::handle item : list) {
    std::string name;
    if (nb::try_cast(item, name)) {
      out.push_back(study::compensator(name, rate_hz));
      continue;
    }
    const auto [called, compensator] = nb::cast<std::pair<std::string, const Compensator*>>(item);
    out.push_back({called, compensator->model()});
    out.back().model.sample_period_s = 1 / rate_hz;
    model::check(out.back().model);
  }
  for (const study::Compensator& one : out) study::require_name(one.name, "compensator " + one.name);
  return out;
}

nb::object experiment(const std::string& gestures, const nb::list& compensators, int trials,
                      std::uint64_t seed, double rate_hz, const std::string& document,
                      const std::vector<std::string>& changes, int threads,
                      const std::filesystem::path& folder, const std::string& shard, const nb::object& show) {
  study::Plan plan;
  if (!shard.empty()) plan.shard = study::parse_shard(shard);
  std::vector<std::string> notes;
  plan.parameters = to_parameters(document, changes);
  plan.motions = study::motions(gestures, notes);
  plan.compensators = to_compensators(compensators, rate_hz);
  for (study::Compensator& one : plan.compensators)
    one.model = deploy::on_hand(std::move(one.model), plan.parameters, notes);
  plan.trials = trials;
  plan.seed = seed;
  plan.threads = threads;
  plan.folder = folder;
  study::check(plan);
  const study::Result result = run(show, [&](Progress& progress) {
    return study::run(
        plan, [&](std::size_t done, std::size_t of) { progress.step(done, of, "experiment: batch"); });
  });
  nlohmann::ordered_json json = study::to_json(result, plan);
  for (const std::string& note : notes) json["warnings"].push_back(note);
  return to_python(json);
}

// From the folders of all shards.
nb::object merge(const std::vector<std::filesystem::path>& folders, const std::filesystem::path& out,
                 const nb::object& show) {
  study::Shards shards = study::read_shards(folders, [](const std::string& engine) -> study::Engine* {
    if (engine != "twin") throw io::InputError(engine + ": flexor merge puts shards of that engine together");
    return nullptr;
  });
  shards.plan.folder = out;
  const study::Result result = run(show, [&](Progress& progress) {
    return study::merge(shards.plan, shards.folders, [&](std::size_t done, std::size_t of) {
      progress.step(done, of, "experiment: batch");
    });
  });
  return to_python(study::to_json(result, shards.plan));
}

// How likely the published averages of gestures 1 to last are beside the twin's (host/study/twin_table.hpp).
double table_log_likelihood(const std::vector<std::string>& changes, int last, int trials,
                            std::uint64_t seed) {
  const study::TableErrors ours = study::twin_table(to_parameters("", changes), last, trials, seed);
  return study::log_likelihood(ours, study::published_table(last));
}

nb::object published_table() {
  nlohmann::ordered_json out;
  for (int g = 1; g <= study::kLastGesture; ++g) {
    for (const std::string& c : study::published_compensators())
      out.push_back(
          {{"gesture", g}, {"compensator", c}, {"error_deg_s", *study::published_error_deg_s(g, c)}});
  }
  return to_python(out);
}

// The laboratory is one of many: `number` makes its random numbers its own.
nb::object play_laboratory(const std::vector<std::string>& changes, std::uint64_t number,
                           const std::string& gestures, int trials, std::uint64_t seed,
                           std::uint64_t glove_seed, double rate_hz, bool scenarios) {
  study::LaboratoryPlan laboratory;
  study::Plan& plan = laboratory.plan;
  plan.parameters = to_parameters("", changes);
  plan.motions = study::motions(gestures);
  plan.compensators = study::compensators(study::published_compensators(), rate_hz);
  plan.trials = trials;
  plan.threads = 1;
  plan.seed = twin::seed_of(seed, number);
  laboratory.rate_hz = rate_hz;
  laboratory.glove_seed = twin::seed_of(glove_seed, number);
  if (scenarios) laboratory.scenarios = study::changed_scenarios();
  study::check(plan);
  nlohmann::ordered_json played;
  {
    const nb::gil_scoped_release released;
    played = study::play_laboratory(laboratory);
  }
  return to_python(played);
}

}  // namespace

void add_twin(nb::module_& m) {
  m.def("twin_record", &record, nb::arg("document"), nb::arg("changes"), nb::arg("donnings"),
        nb::arg("rate_hz"), nb::arg("seed"), nb::arg("progress").none());
  m.def(
      "twin_parameters",
      [](const std::string& document, const std::vector<std::string>& changes) {
        return twin::to_json(to_parameters(document, changes));
      },
      nb::arg("document"), nb::arg("changes"));
  m.def("experiment", &experiment, nb::arg("gestures"), nb::arg("compensators"), nb::kw_only(),
        nb::arg("trials"), nb::arg("seed"), nb::arg("rate_hz"), nb::arg("document"), nb::arg("changes"),
        nb::arg("threads"), nb::arg("folder"), nb::arg("shard"), nb::arg("progress").none());
  m.def("merge", &merge, nb::arg("folders"), nb::arg("out"), nb::arg("progress").none());
  m.def(
      "published_model",
      [](const std::string& name) {
        return model::to_json(study::compensator(name, study::kPublishedRate_hz).model);
      },
      nb::arg("name"));
  m.def("published_table", &published_table);
  m.def("table_log_likelihood", &table_log_likelihood, nb::arg("changes"), nb::arg("last"), nb::arg("trials"),
        nb::arg("seed"), nb::call_guard<nb::gil_scoped_release>());
  m.def("play_laboratory", &play_laboratory, nb::arg("changes"), nb::arg("number"), nb::arg("gestures"),
        nb::arg("trials"), nb::arg("seed"), nb::arg("glove_seed"), nb::arg("rate_hz"), nb::arg("scenarios"));
}

}  // namespace flexor::python
