#include "host/identify/identify.hpp"

#include <nanobind/eigen/dense.h>

#include "host/deploy/model_block.hpp"
#include "host/identify/from_poses.hpp"
#include "host/identify/joint_map.hpp"
#include "host/identify/recalibrate_files.hpp"
#include "host/identify/structure_text.hpp"
#include "host/study/cohort.hpp"
#include "python/bindings/bindings.hpp"

namespace flexor::python {
namespace {

// (results, model's document, that of the fitted part, covariances of each joint's parameters)
nb::tuple identify_takes(identify::Request request, std::optional<double> time_limit_s,
                         const nb::object& show) {
  if (request.pairs.empty()) throw io::InputError("no recordings: pairs of a sensor's and a reference's");
  if (request.map.empty()) request.map = identify::map_by_name(request.pairs.front(), {});
  request.room = deploy::share_of_room;
  const identify::Result found = run(show, [&](Progress& progress) {
    const auto begin = std::chrono::steady_clock::now();
    const auto step = [&](std::size_t done, std::size_t of, const std::string& what) {
      progress.step(done, of, what);
      const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begin;
      return !time_limit_s || elapsed.count() < *time_limit_s;
    };
    try {
      return identify::identify_files(request, step);
    } catch (const io::Cancelled&) {
      throw io::JobError("nothing was fitted within the time limit: a larger time_limit_s");
    }
  });
  nb::dict covariances;
  for (const identify::JointResult& joint : found.joints) covariances[joint.name.c_str()] = joint.covariance;
  return nb::make_tuple(to_python(to_json(found)), model::to_json(found.model), model::to_json(found.proven),
                        covariances);
}

// The document of the fit alone, to all of one recording that holds readings and angles.
std::string fit(const identify::Request& request, const recording::Log& log) {
  const std::vector<recording::Recording> reference(request.map.size(), *log.memory());
  return run(nb::none(), [&](Progress&) {
    return model::to_json(identify::fit_takes({{*log.memory(), reference}}, request));
  });
}

// (results, aligned recording)
nb::tuple align(const identify::SourceFiles& logs, double rate_hz, std::optional<double> clock_offset_s,
                const nb::object& show) {
  const auto [pair, aligned] = run(show, [&](Progress&) {
    recording::Pair loaded = identify::load_pair(logs, clock_offset_s.has_value());
    recording::Aligned found = recording::align_pair(loaded, rate_hz, clock_offset_s);
    return std::pair(std::move(loaded), std::move(found));
  });
  return nb::make_tuple(to_python(to_json(aligned)), to_python(recording::to_recording(aligned, pair)));
}

// (results, model's document)
nb::tuple recalibrate(const identify::RecalibrationFiles& request, const nb::object& show) {
  const identify::Recalibration found =
      run(show, [&](Progress&) { return identify::recalibrate_files(request); });
  return nb::make_tuple(to_python(to_json(found)), model::to_json(found.model));
}

// (model's document, warnings)
nb::tuple from_poses(const recording::Log& log, double rate_hz,
                     const std::map<std::string, model::Ends>& ends_deg,
                     const std::vector<std::string>& joints) {
  const recording::Recording poses = recording::read(*recording::open_log(log, {}));
  identify::FromPoses found = identify::model_from_poses(poses, {rate_hz, ends_deg, joints});
  found.warnings.insert(found.warnings.begin(), poses.warnings.begin(), poses.warnings.end());
  return nb::make_tuple(model::to_json(found.model), found.warnings);
}

// A manifest's takes (host/study/cohort.hpp): how many, and why which failed.
nb::tuple cohort(const std::filesystem::path& manifest, const std::filesystem::path& out,
                 const identify::Request& options, const std::string& shard, const nb::object& show) {
  study::CohortRequest request;
  request.manifest = study::read_manifest(manifest);
  request.options = options;
  request.folder = out;
  if (!shard.empty()) request.shard = study::parse_shard(shard);
  request.threads = options.threads;
  const study::CohortResult found = run(show, [&](Progress& progress) {
    request.goes_on = [&] {
      const std::lock_guard lock(progress.mutex);
      return !progress.stop;
    };
    return study::run_cohort(request, progress.counts("fit"));
  });
  return nb::make_tuple(found.takes, found.failed);
}

}  // namespace

// Requests are the rooms' own: Python fills in their fields.
void add_identify(nb::module_& m) {
  using identify::Request, identify::RecalibrationFiles, identify::SourceFiles;
  nb::class_<model::Ends>(m, "Ends").def(nb::init<double, double>());
  nb::class_<identify::PairFiles>(m, "PairFiles")
      .def(nb::init<const recording::Log&, const recording::Log&>());
  nb::class_<identify::JointMap>(m, "JointMap")
      .def(nb::init<std::string, std::vector<std::string>, std::string>());
  nb::enum_<identify::LeaveOut>(m, "LeaveOut")
      .value("none", identify::LeaveOut::none)
      .value("take", identify::LeaveOut::take)
      .value("person", identify::LeaveOut::person)
      .value("block", identify::LeaveOut::block);
  FLEXOR_REQUEST(Request, pairs, map, rate_hz, split, structure, initial, refit, fit_all, lead_s,
                 clock_offset_s, reference_error_deg, ends, input_unit, output_unit, leave_out, threads)
  nb::class_<SourceFiles>(m, "SourceFiles")
      .def(nb::init<const recording::Log&, const recording::Log&, std::string, std::string, std::string>());
  FLEXOR_REQUEST(RecalibrationFiles, model, recording, poses, poses_log, pair_sensor, pair_camera, map,
                 inputs)
  m.def("check_structure", [](const std::string& text) { (void)identify::parse_structure(text, 1); });
  m.def("joint_name", [](const std::string& name) { return std::string(model::joint_name(name)); });
  m.def("identify", &identify_takes, nb::arg(), nb::arg().none(), nb::arg().none());
  m.def("fit", &fit);
  m.def("align", &align, nb::arg(), nb::arg(), nb::arg().none(), nb::arg().none());
  m.def("recalibrate", &recalibrate, nb::arg(), nb::arg().none());
  m.def("from_poses", &from_poses);
  m.def("cohort", &cohort, nb::arg(), nb::arg(), nb::arg(), nb::arg(), nb::arg().none());
  m.def("cohort_takes",
        [](const std::filesystem::path& manifest) { return study::read_manifest(manifest).takes.size(); });
  m.def("merge_cohort", &study::merge_cohort);
}

}  // namespace flexor::python
