#include "host/score/score.hpp"

#include <nanobind/stl/map.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "host/recording/pair.hpp"
#include "host/recording/resample.hpp"
#include "host/score/judge.hpp"
#include "python/bindings/recording.hpp"

namespace flexor::python {
namespace {

nb::object score_columns(const recording::Log& measured, const std::string& measured_column,
                         const recording::Log& estimated, const std::string& estimated_column) {
  const auto angles = [](const recording::Log& log, const std::string& column) {
    recording::Recording out = recording::read_angle(log, column, {});
    recording::to_degrees(out, column, "");
    return out;
  };
  const recording::Recording reference = angles(measured, measured_column);
  const recording::Recording estimate = angles(estimated, estimated_column);
  const auto series = [](const recording::Recording& r, const std::string& column) {
    const recording::Series s = r.series(column);
    return score::Angles{s.t_s, s.value, recording::default_max_gap_s(s.t_s)};
  };
  return to_python(
      Json(score::compare(series(reference, measured_column), series(estimate, estimated_column))));
}

nb::object judge(const std::vector<double>& error_deg,
                 const std::map<std::string, std::vector<double>>& baselines, double period_s,
                 const std::vector<std::size_t>& part_ends) {
  return to_python(score::to_json(score::judge(error_deg, baselines, period_s, part_ends)));
}

}  // namespace

void add_score(nb::module_& m) {
  m.def("score", &score_columns);
  m.def("judge", &judge);
}

}  // namespace flexor::python
