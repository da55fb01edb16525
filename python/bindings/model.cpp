#include "python/bindings/model.hpp"

#include <fmt/format.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "host/identify/map_check.hpp"
#include "host/io/json.hpp"
#include "host/model/standard_error.hpp"
#include "python/bindings/job.hpp"
#include "python/bindings/rooms.hpp"

namespace flexor::python {

namespace {

std::shared_ptr<Estimator> estimator_of(const model::Model& model, const std::string& arithmetic) {
  if (arithmetic == "double")
    return std::make_shared<Estimator>(identify::Estimator<model::DoubleArithmetic>(model));
  if (arithmetic == "float")
    return std::make_shared<Estimator>(identify::Estimator<model::FloatArithmetic>(model));
  if (arithmetic == "fixed")
    return std::make_shared<Estimator>(identify::Estimator<model::FixedArithmetic>(model));
  throw io::InputError(fmt::format("arithmetic \"{}\": double, float or fixed", arithmetic));
}

}  // namespace

Compensator::Compensator(model::Model model, std::string arithmetic)
    : model_(std::move(model)), arithmetic_(std::move(arithmetic)) {
  model::check(model_);
  reset();
}

void Compensator::reset() {
  estimator_ = estimator_of(model_, arithmetic_);
  next_ = 0;
}

nb::tuple Compensator::step(const Matrix& readings) {
  const std::size_t rows = readings.shape(0);
  const std::size_t inputs = readings.shape(1);
  if (inputs != model_.inputs.size())
    throw io::InputError(
        fmt::format("rows of {} readings: the model has {} input(s)", inputs, model_.inputs.size()));
  std::vector<double> angle_deg;
  std::vector<double> status;
  angle_deg.reserve(rows * model_.joints.size());
  status.reserve(rows * model_.joints.size());
  const auto keep = [&](const identify::Estimate& e) {
    angle_deg.insert(angle_deg.end(), e.angle_deg.begin(), e.angle_deg.end());
    status.insert(status.end(), e.status.begin(), e.status.end());
  };
  std::visit(
      [&](auto& estimator) {
        for (std::size_t k = 0; k < rows; ++k)
          estimator.push(static_cast<double>(next_++) * model_.sample_period_s,
                         {readings.data() + k * inputs, inputs}, keep);
      },
      *estimator_);
  return nb::make_tuple(to_array(std::move(angle_deg), {rows, model_.joints.size()}),
                        to_array(std::move(status), {rows, model_.joints.size()}));
}

namespace {

// As flexor apply: the log's clock is repaired, its readings come to the model's grid. JOINT_deg, JOINT_status and, with intervals,
// JOINT_se_deg of each joint.
recording::Recording follow(const model::Model& model, Estimator& estimator, bool intervals,
                            recording::LogReader& reader, Progress& progress) {
  recording::Recording out;
  for (const model::Joint& joint : model.joints) {
    out.columns.push_back({joint.name + "_deg", {}, "deg"});
    out.columns.push_back({joint.name + "_status", {}});
    if (intervals) out.columns.push_back({joint.name + "_se_deg", {}, "deg"});
  }
  const model::StandardErrors errors(model);
  const auto keep = [&](const identify::Estimate& e) {
    out.t_s.push_back(e.t_s);
    auto column = out.columns.begin();
    for (std::size_t j = 0; j < e.angle_deg.size(); ++j) {
      (column++)->value.push_back(e.angle_deg[j]);
      (column++)->value.push_back(e.status[j]);
      if (intervals) (column++)->value.push_back(errors.of(j, e.angle_deg[j], e.reading));
    }
  };
  recording::Stream stream(reader, recording::Resets::follow);
  recording::Row row;
  for (std::size_t rows = 0; stream.next(row); ++rows) {
    if (rows % 4096 == 0) progress.step(rows, 0, "rows");
    std::visit([&](auto& one) { one.push(row.t_s, row.value, keep); }, estimator);
  }
  if (out.t_s.empty())
    throw io::InputError(fmt::format("{}: no row with a reading of every input", reader.name()));
  out.source = model.name;
  out.warnings = stream.notes();
  return out;
}

nb::tuple predict(const Compensator& compensator, const nb::handle& log,
                  const std::vector<std::string>& inputs, bool intervals, bool track,
                  const nb::object& show) {
  const model::Model& model = compensator.model();
  const auto reader =
      recording::open_log(to_log(log), {model::columns_of(model, inputs), {}, recording::Holes::some});
  std::vector<std::string> notes;
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    if (auto note =
            identify::unit_note(model.inputs[i], reader->name(), reader->columns()[i], reader->units()[i]))
      notes.push_back(std::move(*note));
  }
  for (const model::Joint& joint : model.joints) {
    if (intervals && !joint.accuracy)
      throw io::InputError(
          fmt::format("{} does not say how accurate it is: identify it from measured angles", joint.name));
  }
  const std::shared_ptr<Estimator> estimator = estimator_of(model, compensator.arithmetic());
  const auto tracks_any = [](auto& one) {
    one.track({});
    return one.trackers()->any();
  };
  if (track && !std::visit(tracks_any, *estimator))
    throw io::InputError(
        "no input says what its strip reads at the open hand and at the fist, against which it is tracked: "
        "identify the model anew from a recording with both");
  recording::Recording out =
      run(show, [&](Progress& progress) { return follow(model, *estimator, intervals, *reader, progress); });
  out.warnings.insert(out.warnings.begin(), notes.begin(), notes.end());
  return to_python(std::move(out));
}

}  // namespace

void add_model(nb::module_& m) {
  nb::class_<Compensator>(m, "Compensator", "A model document and what it remembers between steps.")
      .def(
          "__init__",
          [](Compensator* self, const std::string& text, const std::string& source,
             const std::string& arithmetic) {
            new (self) Compensator(model::from_json(text, source), arithmetic);
          },
          nb::arg("text"), nb::arg("source"), nb::arg("arithmetic") = "double")
      .def("to_json", [](const Compensator& self) { return model::to_json(self.model()); })
      .def("step", &Compensator::step, nb::arg("readings"))
      .def("reset", &Compensator::reset)
      .def("predict", &predict, nb::arg("recording"), nb::arg("inputs"), nb::arg("intervals"),
           nb::arg("track"), nb::arg("progress").none());
}

}  // namespace flexor::python
