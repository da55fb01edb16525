#include "host/posture/complete_file.hpp"

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "host/model/model.hpp"
#include "host/posture/posture.hpp"
#include "host/study/builtin.hpp"
#include "python/bindings/job.hpp"
#include "python/bindings/recording.hpp"

namespace flexor::python {
namespace {

// `document`: of flexor posture learn; empty: the shipped one.
nb::tuple complete(const recording::Log& log, const std::string& document,
                   const std::vector<std::string>& from, const std::vector<std::string>& bends, double rest_s,
                   bool flexion_is_positive, const model::Model* model, const nb::object& show) {
  const posture::Posture known =
      posture::parse(document.empty() ? study::builtin("posture.json") : document, "posture");
  posture::CompleteOptions options{from, bends, rest_s, flexion_is_positive || model != nullptr};
  if (model != nullptr) {
    for (const model::Joint& joint : model->joints) {
      const model::Ends ends = model::ends(*model, joint);
      options.ends_deg[joint.name] = {ends.open_deg, ends.fist_deg};
    }
  }
  const std::unique_ptr<recording::LogReader> reader =
      recording::open_log(log, {{}, {}, recording::Holes::all});
  return to_python(run(show, [&](Progress& progress) {
    std::string text;
    const posture::Completion done = posture::complete_table(
        known, *reader, options, [&](const std::string& more) { text += more; },
        [&](std::size_t rows) { progress.step(rows, 0, "rows"); });
    recording::Recording out = recording::parse_csv(text, reader->name(), {});
    out.warnings.insert(out.warnings.begin(), done.notes.begin(), done.notes.end());
    return out;
  }));
}

}  // namespace

void add_posture(nb::module_& m) {
  m.def("complete", &complete, nb::arg(), nb::arg(), nb::arg(), nb::arg(), nb::arg(), nb::arg(),
        nb::arg().none(), nb::arg().none());
}

}  // namespace flexor::python
