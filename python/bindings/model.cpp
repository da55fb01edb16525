#include "host/model/model.hpp"

#include "host/identify/apply.hpp"
#include "host/model/standard_error.hpp"
#include "host/posture/complete_file.hpp"
#include "host/posture/posture.hpp"
#include "host/study/builtin.hpp"
#include "python/bindings/bindings.hpp"

namespace flexor::python {
namespace {

// A compensator that remembers what was stepped before. In one thread at a time.
class Steps {
 public:
  Steps(const model::Model& model, const std::string& arithmetic)
      : model_(model), estimator_(identify::estimator_of(model_, arithmetic)) {}

  // (angles, status), a row for each of `readings`, which are a sample period apart, and a column for each joint.
  nb::tuple step(const Matrix& readings) {
    const std::size_t inputs = model_.inputs.size();
    if (readings.shape(1) != inputs)
      throw io::InputError("rows of {} readings: the model has {} input(s)", readings.shape(1), inputs);
    std::vector<double> angle_deg;
    std::vector<double> status;
    const auto add = [&](const identify::Estimate& e) {
      angle_deg.insert(angle_deg.end(), e.angle_deg.begin(), e.angle_deg.end());
      status.insert(status.end(), e.status.begin(), e.status.end());
    };
    for (std::size_t k = 0; k < readings.shape(0); ++k) {
      const double t_s = static_cast<double>(next_++) * model_.sample_period_s;
      std::visit([&](auto& e) { e.push(t_s, {readings.data() + k * inputs, inputs}, add); }, estimator_);
    }
    const std::vector<std::size_t> shape = {readings.shape(0), model_.joints.size()};
    return nb::make_tuple(to_array(std::move(angle_deg), shape), to_array(std::move(status), shape));
  }

 private:
  model::Model model_;
  identify::AnyEstimator estimator_;
  std::uint64_t next_ = 0;
};

// As flexor apply: of each joint angle, status, and where asked for standard error.
nb::tuple predict(const model::Model& model, const std::string& arithmetic, const recording::Log& log,
                  const std::vector<std::string>& inputs, bool intervals, bool track,
                  const nb::object& show) {
  const auto reader =
      recording::open_log(log, {model::columns_of(model, inputs), {}, recording::Holes::some});
  const model::StandardErrors errors(model);
  recording::Recording out;
  out.source = model.name;
  for (const model::Joint& joint : model.joints) {
    out.columns.push_back({joint.name + "_deg", {}});
    out.columns.push_back({joint.name + "_status", {}});
    if (intervals) out.columns.push_back({joint.name + "_se_deg", {}});
  }
  const auto add = [&](const identify::Estimate& e) {
    out.t_s.push_back(e.t_s);
    auto column = out.columns.begin();
    for (std::size_t j = 0; j < model.joints.size(); ++j) {
      (column++)->value.push_back(e.angle_deg[j]);
      (column++)->value.push_back(e.status[j]);
      if (intervals) (column++)->value.push_back(errors.of(j, e.angle_deg[j], e.reading));
    }
  };
  run(show, [&](Progress& progress) {
    const auto note = [&](const std::string& text) { out.warnings.push_back(text); };
    const auto step = [&](std::size_t rows) { progress.step(rows, 0, "rows"); };
    const auto done =
        identify::apply(model, *reader, {"model", arithmetic, intervals, track, note, step}, add);
    identify::check_ranges(model, reader->name(), reader->columns(), done.ranges, note, done.row_period_s);
  });
  return to_python(std::move(out));
}

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
  m.def("complete", &complete, nb::arg(), nb::arg(), nb::arg(), nb::arg(), nb::arg(), nb::arg(),
        nb::arg().none(), nb::arg().none());
}

}  // namespace flexor::python
