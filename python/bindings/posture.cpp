#include "host/posture/complete_file.hpp"

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <sstream>

#include "host/posture/posture.hpp"
#include "host/study/builtin.hpp"
#include "python/bindings/job.hpp"
#include "python/bindings/model.hpp"
#include "python/bindings/rooms.hpp"

namespace flexor::python {
namespace {

// `document`: of flexor posture learn; empty: the shipped one.
nb::tuple complete(const nb::object& log, const std::string& document, const std::vector<std::string>& from,
                   const std::vector<std::string>& bends, double rest_s, bool flexion_is_positive,
                   const Compensator* compensator, const nb::object& show) {
  const posture::Posture known =
      posture::parse(document.empty() ? study::builtin("posture.json") : document, "posture");
  posture::CompleteOptions options{from, bends, rest_s, flexion_is_positive || compensator != nullptr};
  if (compensator != nullptr) {
    for (const model::Joint& joint : compensator->model().joints) {
      const model::Ends ends = model::ends(compensator->model(), joint);
      options.ends_deg[joint.name] = {ends.open_deg, ends.fist_deg};
    }
  }
  const std::unique_ptr<recording::LogReader> reader =
      recording::open_log(to_log(log), {{}, {}, recording::Holes::all});
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
  m.def("complete", &complete, nb::arg("recording"), nb::arg("document"), nb::arg("sensed"), nb::arg("bends"),
        nb::arg("rest_s"), nb::arg("flexion_is_positive"), nb::arg("model").none(),
        nb::arg("progress").none());
}

}  // namespace flexor::python
