#include "host/twin/parameters.hpp"

#include <nanobind/stl/array.h>
#include <nanobind/stl/pair.h>

#include "host/deploy/hardware.hpp"
#include "host/study/glove_fit.hpp"
#include "host/study/published.hpp"
#include "host/study/results.hpp"
#include "host/study/shards.hpp"
#include "host/study/trials.hpp"
#include "host/twin/random.hpp"
#include "python/bindings/bindings.hpp"

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
nb::list record(const twin::Parameters& parameters, int donnings, double rate_hz, std::uint64_t seed,
                const nb::object& show) {
  std::vector<study::GloveRecording> recordings = run(show, [&](Progress&) {
    return study::record_glove({parameters, rate_hz, donnings, seed});
  });
  nb::list out;
  for (study::GloveRecording& one : recordings)
    out.append(nb::make_tuple(to_python(std::move(one.glove)), to_python(std::move(one.camera)),
                              to_python(std::move(one.hand))));
  return out;
}

nb::object experiment(study::Plan plan, const std::string& gestures, double rate_hz, const std::string& shard,
                      const nb::object& show) {
  if (!shard.empty()) plan.shard = study::parse_shard(shard);
  std::vector<std::string> notes;
  plan.motions = study::motions(gestures, &notes);
  for (study::Compensator& one : plan.compensators) {
    one.model.sample_period_s = 1 / rate_hz;
    model::check(one.model);
    study::require_name(one.name, "compensator " + one.name);
    one.model = deploy::on_hand(std::move(one.model), plan.parameters, notes);
  }
  study::check(plan);
  const study::Result result =
      run(show, [&](Progress& progress) { return study::run(plan, progress.counts("experiment: batch")); });
  Json json = study::to_json(result, plan);
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
    return study::merge(shards.plan, shards.folders, progress.counts("experiment: batch"));
  });
  return to_python(study::to_json(result, shards.plan));
}

// What is fitted to a glove that is worn and recorded once (host/study/glove_fit.hpp): compensators; the lead, or none.
std::pair<std::vector<study::Compensator>, std::optional<double>> fit_glove(
    const twin::Parameters& parameters, double rate_hz, std::uint64_t seed) {
  const study::GloveRequest request{parameters, rate_hz, 1, seed};
  study::GloveFit glove = study::fit_glove(request, study::record_glove(request));
  glove.baselines.push_back({"identified", glove.identified});
  return {glove.baselines, glove.lead_s};
}

}  // namespace

void add_twin(nb::module_& m) {
  nb::class_<twin::Parameters>(m, "Parameters").def("to_json", [](const twin::Parameters& self) {
    return twin::to_json(self);
  });
  nb::class_<study::Compensator>(m, "NamedModel")
      .def(nb::init<std::string, model::Model>())
      .def_ro("model", &study::Compensator::model);
  using study::Plan;
  FLEXOR_REQUEST(Plan, parameters, compensators, trials, seed, threads, folder)
  m.def("parameters", &to_parameters);
  m.def("named_model", &study::compensator);
  m.def("twin_record", &record, nb::arg(), nb::arg(), nb::arg(), nb::arg(), nb::arg().none());
  m.def("experiment", &experiment, nb::arg(), nb::arg(), nb::arg(), nb::arg(), nb::arg().none());
  m.def("merge", &merge, nb::arg(), nb::arg(), nb::arg().none());
  m.def("published_error_deg_s", &study::published_error_deg_s);
  m.def("published_trials_deg_s", &study::published_trials_deg_s);
  m.def("fit_glove", &fit_glove, nb::call_guard<nb::gil_scoped_release>());
  nb::class_<study::Scenario>(m, "Scenario")
      .def_ro("name", &study::Scenario::name)
      .def_ro("set", &study::Scenario::set);
  m.def("changed_scenarios", &study::changed_scenarios);
  m.def("seed_of", [](std::uint64_t seed, std::uint64_t number) { return twin::seed_of(seed, number); });
}

}  // namespace flexor::python
