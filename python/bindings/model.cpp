#include "host/model/model.hpp"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "host/identify/apply.hpp"
#include "host/model/standard_error.hpp"
#include "python/bindings/job.hpp"
#include "python/bindings/recording.hpp"

namespace flexor::python {
namespace {

// A row for each sample, a column for each joint.
struct Angles {
  std::size_t joints;
  const model::StandardErrors* errors;  // none: not asked for
  std::vector<double> t_s = {};
  std::vector<double> angle_deg = {};
  std::vector<double> status = {};
  std::vector<double> se_deg = {};

  void operator()(const identify::Estimate& e) {
    t_s.push_back(e.t_s);
    angle_deg.insert(angle_deg.end(), e.angle_deg.begin(), e.angle_deg.end());
    status.insert(status.end(), e.status.begin(), e.status.end());
    for (std::size_t j = 0; errors != nullptr && j < joints; ++j)
      se_deg.push_back(errors->of(j, e.angle_deg[j], e.reading));
  }
  nb::object table(std::vector<double>& of) const {
    const std::size_t rows = of.size() / joints;
    return to_array(std::move(of), {rows, joints});
  }
};

// A compensator that remembers what was stepped before. In one thread at a time.
class Steps {
 public:
  Steps(const model::Model& model, const std::string& arithmetic)
      : period_s_(model.sample_period_s),
        inputs_(model.inputs.size()),
        joints_(model.joints.size()),
        estimator_(identify::estimator_of(model, arithmetic)) {}

  // (angles, status), a row for each of `readings`, which are a sample period apart.
  nb::tuple step(const Matrix& readings) {
    if (readings.shape(1) != inputs_)
      throw io::InputError("rows of {} readings: the model has {} input(s)", readings.shape(1), inputs_);
    Angles out{joints_, nullptr};
    out.angle_deg.reserve(readings.shape(0) * joints_);
    out.status.reserve(readings.shape(0) * joints_);
    std::visit(
        [&](auto& estimator) {
          for (std::size_t k = 0; k < readings.shape(0); ++k)
            estimator.push(static_cast<double>(next_++) * period_s_, {readings.data() + k * inputs_, inputs_},
                           out);
        },
        estimator_);
    return nb::make_tuple(out.table(out.angle_deg), out.table(out.status));
  }

 private:
  double period_s_;
  std::size_t inputs_;
  std::size_t joints_;
  identify::AnyEstimator estimator_;
  std::uint64_t next_ = 0;
};

// As flexor apply. (times, angles, status, standard errors,
// warnings)
nb::tuple predict(const model::Model& model, const std::string& arithmetic, const recording::Log& log,
                  const std::vector<std::string>& inputs, bool intervals, bool track,
                  const nb::object& show) {
  const auto reader =
      recording::open_log(log, {model::columns_of(model, inputs), {}, recording::Holes::some});
  std::vector<std::string> notes;
  const model::StandardErrors errors(model);
  Angles out{model.joints.size(), intervals ? &errors : nullptr};
  run(show, [&](Progress& progress) {
    const auto note = [&](const std::string& text) { notes.push_back(text); };
    const auto step = [&](std::size_t rows) {
      if (rows % 4096 == 0) progress.step(rows, 0, "rows");
    };
    const auto done =
        identify::apply(model, *reader, {"model", arithmetic, intervals, track, note, step}, std::ref(out));
    identify::check_ranges(model, reader->name(), reader->columns(), done.ranges, note, done.row_period_s);
  });
  return nb::make_tuple(to_array(std::move(out.t_s)), out.table(out.angle_deg), out.table(out.status),
                        out.table(out.se_deg), notes);
}

}  // namespace

void add_model(nb::module_& m) {
  nb::class_<model::Model>(m, "Model", "A model document.").def("to_json", [](const model::Model& self) {
    return model::to_json(self);
  });
  m.def("model", [](const std::string& text, const std::string& source) {
    model::Model out = model::from_json(text, source);
    model::check(out);
    return out;
  });
  nb::class_<Steps>(m, "Steps").def(nb::init<model::Model, std::string>()).def("step", &Steps::step);
  m.def("predict", &predict, nb::arg(), nb::arg(), nb::arg(), nb::arg(), nb::arg(), nb::arg(),
        nb::arg().none());
}

}  // namespace flexor::python
