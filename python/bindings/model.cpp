#include "python/bindings/model.hpp"

#include <fmt/format.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "host/identify/map_check.hpp"
#include "host/io/json.hpp"
#include "python/bindings/job.hpp"
#include "python/bindings/rooms.hpp"

namespace flexor::python {

class Compensator::Stepper {
 public:
  virtual ~Stepper() = default;
  virtual void step(const Matrix& readings, std::vector<double>& angle_deg, std::vector<double>& status) = 0;
};

template <class Arithmetic>
class Compensator::StepperOf : public Compensator::Stepper {
 public:
  explicit StepperOf(const model::Model& model) : estimator_(model), period_s_(model.sample_period_s) {}

  void step(const Matrix& readings, std::vector<double>& angle_deg, std::vector<double>& status) override {
    const std::size_t inputs = readings.shape(1);
    for (std::size_t k = 0; k < readings.shape(0); ++k) {
      const double t_s = static_cast<double>(next_++) * period_s_;
      estimator_.push(t_s, {readings.data() + k * inputs, inputs}, [&](const identify::Estimate& e) {
        angle_deg.insert(angle_deg.end(), e.angle_deg.begin(), e.angle_deg.end());
        status.insert(status.end(), e.status.begin(), e.status.end());
      });
    }
  }

 private:
  identify::Estimator<Arithmetic> estimator_;
  double period_s_;
  std::uint64_t next_ = 0;
};

Compensator::Compensator(model::Model model, const std::string& arithmetic)
    : model_(std::move(model)), arithmetic_(arithmetic) {
  model::check(model_);
  reset();
}

void Compensator::reset() {
  if (arithmetic_ == "double") {
    stepper_ = std::make_shared<StepperOf<model::DoubleArithmetic>>(model_);
  } else if (arithmetic_ == "float") {
    stepper_ = std::make_shared<StepperOf<model::FloatArithmetic>>(model_);
  } else if (arithmetic_ == "fixed") {
    stepper_ = std::make_shared<StepperOf<model::FixedArithmetic>>(model_);
  } else {
    throw io::InputError(fmt::format("arithmetic \"{}\": double, float or fixed", arithmetic_));
  }
}

nb::tuple Compensator::step(const Matrix& readings) {
  if (readings.shape(1) != model_.inputs.size())
    throw io::InputError(fmt::format("rows of {} readings: the model has {} input(s)", readings.shape(1),
                                     model_.inputs.size()));
  const std::vector<std::size_t> shape = {readings.shape(0), model_.joints.size()};
  std::vector<double> angle_deg;
  std::vector<double> status;
  angle_deg.reserve(shape[0] * shape[1]);
  status.reserve(shape[0] * shape[1]);
  stepper_->step(readings, angle_deg, status);
  return nb::make_tuple(to_array(std::move(angle_deg), shape), to_array(std::move(status), shape));
}

namespace {

// As flexor apply: the log's clock is repaired, its readings come to the model's grid. `out` has JOINT_deg, JOINT_status and, with
// intervals, JOINT_se_deg of each joint.
template <class Arithmetic>
void follow(const model::Model& model, bool intervals, bool track, recording::LogReader& reader,
            Progress& progress, recording::Recording& out) {
  identify::Estimator<Arithmetic> estimator(model);
  if (track) estimator.track({});
  if (track && !estimator.trackers()->any())
    throw io::InputError(
        "no input says what its strip reads at the open hand and at the fist, against which it is "
        "tracked: identify the model anew from a recording with both");
  const std::size_t each = intervals ? 3 : 2;
  recording::Stream stream(reader, recording::Resets::follow);
  recording::Row row;
  for (std::size_t rows = 0; stream.next(row); ++rows) {
    if (rows % 4096 == 0) progress.step(rows, 0, "rows");
    estimator.push(row.t_s, row.value, [&](const identify::Estimate& e) {
      out.t_s.push_back(e.t_s);
      for (std::size_t j = 0; j < e.angle_deg.size(); ++j) {
        out.columns[each * j].value.push_back(e.angle_deg[j]);
        out.columns[each * j + 1].value.push_back(e.status[j]);
        if (intervals)
          out.columns[each * j + 2].value.push_back(model.joints[j].accuracy->at(e.angle_deg[j]));
      }
    });
  }
  if (out.t_s.empty())
    throw io::InputError(fmt::format("{}: no row with a reading of every input", reader.name()));
  out.warnings = stream.notes();
}

nb::tuple predict(const Compensator& compensator, const nb::handle& log,
                  const std::vector<std::string>& inputs, const std::string& arithmetic, bool intervals,
                  bool track, const nb::object& show) {
  const model::Model& model = compensator.model();
  const std::unique_ptr<recording::LogReader> reader =
      recording::open_log(to_log(log), {model::columns_of(model, inputs), {}});
  recording::Recording out;
  out.source = model.name;
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
    out.columns.push_back({joint.name + "_deg", {}, "deg"});
    out.columns.push_back({joint.name + "_status", {}});
    if (intervals) out.columns.push_back({joint.name + "_se_deg", {}, "deg"});
  }
  out = run(show, [&](Progress& progress) {
    if (arithmetic == "fixed") {
      follow<model::FixedArithmetic>(model, intervals, track, *reader, progress, out);
    } else if (arithmetic == "float") {
      follow<model::FloatArithmetic>(model, intervals, track, *reader, progress, out);
    } else {
      follow<model::DoubleArithmetic>(model, intervals, track, *reader, progress, out);
    }
    return std::move(out);
  });
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
      .def("predict", &predict, nb::arg("recording"), nb::arg("inputs"), nb::arg("arithmetic"),
           nb::arg("intervals"), nb::arg("track"), nb::arg("progress").none());
}

}  // namespace flexor::python
