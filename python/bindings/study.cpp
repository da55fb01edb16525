// The kernels of flexor.laboratories: how likely the published table is beside the twin's, and the experiment in one laboratory.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <nlohmann/json.hpp>

#include "host/model/model.hpp"
#include "host/study/laboratory.hpp"
#include "host/study/twin_table.hpp"
#include "host/twin/random.hpp"
#include "python/bindings/bindings.hpp"

namespace nb = nanobind;

namespace flexor::python {
namespace {

using Strings = std::vector<std::string>;

twin::Parameters parameters_of(const Strings& assignments) {
  twin::Parameters out;
  for (const std::string& one : assignments) twin::assign(out, one);
  twin::check(out);
  return out;
}

double table_log_likelihood(const Strings& assignments, int gestures, int trials, std::uint64_t seed) {
  const study::TwinTable table(1, gestures, trials, seed);
  return study::log_likelihood(table.errors(parameters_of(assignments)), study::published_table(1, gestures));
}

std::string published_table() {
  nlohmann::json out = nlohmann::json::array();
  for (int g = 1; g <= 6; ++g) {
    for (const std::string& c : study::published_compensators())
      out.push_back({{"gesture", g}, {"compensator", c}, {"error_deg_s", *study::published_error_deg_s(g, c)}});
  }
  return out.dump();
}

std::string play_laboratory(const Strings& assignments, std::uint64_t number, const std::string& gestures,
                            int trials, std::uint64_t seed, std::uint64_t glove_seed, double rate_hz,
                            bool scenarios) {
  study::LaboratoryPlan plan;
  plan.plan.parameters = parameters_of(assignments);
  plan.plan.motions = study::motions(gestures);
  plan.plan.compensators = study::compensators(study::published_compensators(), rate_hz);
  plan.plan.trials = trials;
  plan.plan.threads = 1;
  plan.plan.seed = twin::seed_of(seed, number);
  plan.rate_hz = rate_hz;
  plan.glove_seed = twin::seed_of(glove_seed, number);
  if (scenarios) plan.scenarios = study::changed_scenarios();
  return study::play_laboratory(plan).dump();
}

}  // namespace

void bind_study(nb::module_& m) {
  const nb::call_guard<nb::gil_scoped_release> free;
  m.def("published_model", [](const std::string& name) {
    return model::to_json(study::compensator(name, study::kPublishedRate_hz).model);
  });
  m.def("published_table", &published_table);
  m.def("table_log_likelihood", &table_log_likelihood, free);
  m.def("play_laboratory", &play_laboratory, free);
}

}  // namespace flexor::python
