#include "host/identify/hand.hpp"

#include <fmt/format.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <chrono>

#include "host/deploy/model_block.hpp"
#include "host/identify/from_poses.hpp"
#include "host/identify/joint_map.hpp"
#include "host/identify/recalibrate_files.hpp"
#include "host/recording/csv.hpp"
#include "host/study/cohort.hpp"
#include "python/bindings/job.hpp"
#include "python/bindings/model.hpp"
#include "python/bindings/rooms.hpp"

namespace flexor::python {
namespace {

using Map = std::vector<std::tuple<std::string, std::vector<std::string>, std::string>>;
using Ends = std::map<std::string, std::pair<double, double>>;

std::map<std::string, model::Ends> to_ends(const Ends& from) {
  std::map<std::string, model::Ends> out;
  for (const auto& [joint, ends] : from) out[model::joint_name(joint)] = {ends.first, ends.second};
  return out;
}

identify::LeaveOut to_leave_out(const std::string& name) {
  if (name.empty()) return identify::LeaveOut::none;
  if (name == "take") return identify::LeaveOut::take;
  if (name == "block") return identify::LeaveOut::block;
  throw io::InputError(fmt::format("leave_out \"{}\": take or block", name));
}

// Covariances of each joint's parameters, with their names.
nb::dict covariances(const identify::HandIdentification& r) {
  nb::dict out;
  for (const identify::JointResult& joint : r.joints) {
    const Eigen::MatrixXd& c = joint.covariance;
    const auto n = static_cast<std::size_t>(c.rows());
    std::vector<std::string> names;
    for (const identify::Parameter& p : joint.parameters) names.push_back(p.name);
    out[joint.name.c_str()] = nb::make_tuple(names, to_array({c.data(), c.data() + c.size()}, {n, n}));
  }
  return out;
}

// (results, model, model of the fitted part, covariances)
nb::tuple identify_takes(const nb::list& pairs, const std::optional<Map>& map, double rate_hz, double split,
                         const std::string& structure, double lead_s, std::optional<double> clock_offset_s,
                         bool fit_all, const std::string& leave_out, const std::string& input_unit,
                         const std::string& output_unit,
                         const std::map<std::string, double>& reference_error_deg, const Ends& ends_deg,
                         const Compensator* initial, const Compensator* refit,
                         std::optional<double> time_limit_s, int threads, const nb::object& show) {
  identify::HandRequest request;
  for (const nb::handle pair : pairs) {
    const auto [sensor, reference] = nb::cast<std::pair<nb::object, nb::object>>(pair);
    const recording::Log log = to_log(sensor);
    request.pairs.push_back({log, sensor.is(reference) ? log : to_log(reference)});
  }
  if (request.pairs.empty()) throw io::InputError("no recordings: pairs of a sensor's and a reference's");
  request.rate_hz = rate_hz;
  request.split = split;
  request.structure = structure;
  request.lead_s = lead_s;
  request.clock_offset_s = clock_offset_s;
  request.fit_all = fit_all;
  request.leave_out = to_leave_out(leave_out);
  request.input_unit = input_unit;
  request.output_unit = output_unit;
  request.ends = to_ends(ends_deg);
  request.room = deploy::share_of_room;
  request.threads = threads;
  for (const auto& [joint, error_deg] : reference_error_deg)
    request.reference_error_deg[model::joint_name(joint)] = error_deg;
  if (initial != nullptr) request.initial = initial->model();
  if (refit != nullptr) request.refit = refit->model();
  if (!map) request.map = identify::map_by_name(request.pairs.front(), {});
  for (const auto& [joint, sensors, angle] : map.value_or(Map()))
    request.map.push_back({model::joint_name(joint), sensors, angle});
  const identify::HandIdentification found = run(show, [&](Progress& progress) {
    const auto begin = std::chrono::steady_clock::now();
    const auto step = [&](std::size_t done, std::size_t of, const std::string& what) {
      progress.step(done, of, what);
      const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begin;
      return !time_limit_s || elapsed.count() < *time_limit_s;
    };
    try {
      return identify::identify_hand(request, step);
    } catch (const io::Cancelled&) {
      throw io::JobError("nothing was fitted within the time limit: a larger time_limit_s");
    }
  });
  return nb::make_tuple(to_python(to_json(found)), Compensator(found.model), Compensator(found.proven),
                        covariances(found));
}

// The fit alone, to all of one recording that holds readings and angles.
Compensator fit(const nb::object& log, const Map& map, double rate_hz, const std::string& structure,
                const nb::object& show) {
  identify::HandRequest request;
  identify::HandRecordings take{to_recording(log), {}};
  for (const auto& [joint, sensors, angle] : map) {
    request.map.push_back({joint, sensors, angle});
    take.reference.push_back(take.sensor);
  }
  request.rate_hz = rate_hz;
  request.structure = structure;
  return run(show, [&](Progress& progress) {
    return Compensator(
        identify::fit_hand(request, {take}, [&](std::size_t done, std::size_t of, const std::string& what) {
          progress.step(done, of, what);
          return true;
        }));
  });
}

// (results, aligned recording)
nb::tuple align(const nb::object& sensor, const nb::object& reference, const std::string& input,
                const std::string& output, double rate_hz, std::optional<double> clock_offset_s,
                const std::string& output_unit, const nb::object& show) {
  const recording::Log log = to_log(sensor);
  const identify::SourceFiles logs{
      log, sensor.is(reference) ? log : to_log(reference), input, output, output_unit, {}};
  const auto [pair, aligned] = run(show, [&](Progress&) {
    recording::Pair loaded = identify::load_pair(logs, clock_offset_s.has_value());
    recording::Aligned found = recording::align_pair(loaded, rate_hz, clock_offset_s);
    return std::pair(std::move(loaded), std::move(found));
  });
  return nb::make_tuple(to_python(to_json(aligned)), to_python(recording::to_recording(aligned, pair)));
}

// (results, model)
nb::tuple recalibrate(const Compensator& compensator, const nb::object& motion,
                      const std::vector<std::string>& poses, const nb::object& poses_log,
                      const nb::object& sensor, const nb::object& reference, const std::string& map,
                      const std::vector<std::string>& inputs, const nb::object& show) {
  identify::RecalibrationFiles request;
  request.model = compensator.model();
  request.recording = to_log(motion);
  request.poses = poses;
  request.poses_log = to_log(poses_log);
  request.pair_sensor = to_log(sensor);
  request.pair_camera = to_log(reference);
  request.map = map;
  request.inputs = inputs;
  const identify::Recalibration found =
      run(show, [&](Progress&) { return identify::recalibrate_files(request); });
  return nb::make_tuple(to_python(to_json(found)), Compensator(found.model));
}

// (model, warnings)
nb::tuple from_poses(const nb::object& log, double rate_hz, const Ends& ends_deg,
                     const std::vector<std::string>& joints) {
  const recording::Recording poses = recording::read(*recording::open_log(to_log(log), {}));
  identify::FromPoses found = identify::model_from_poses(poses, {rate_hz, to_ends(ends_deg), joints});
  found.warnings.insert(found.warnings.begin(), poses.warnings.begin(), poses.warnings.end());
  return nb::make_tuple(Compensator(found.model), found.warnings);
}

// A manifest's takes (host/study/cohort.hpp): how many, and why which failed.
nb::tuple cohort(const std::filesystem::path& manifest, const std::filesystem::path& out, double rate_hz,
                 double split, const std::string& structure, double lead_s, bool fit_all,
                 const std::string& leave_out, const std::string& shard, int threads,
                 const nb::object& show) {
  study::CohortRequest request;
  request.manifest = study::read_manifest(manifest);
  request.options.rate_hz = rate_hz;
  request.options.split = split;
  request.options.structure = structure;
  request.options.lead_s = lead_s;
  request.options.fit_all = fit_all;
  if (!leave_out.empty() && leave_out != "person") throw io::InputError("leave_out: person, or none");
  if (!leave_out.empty()) request.options.leave_out = identify::LeaveOut::person;
  request.folder = out;
  if (!shard.empty()) request.shard = study::parse_shard(shard);
  request.threads = threads;
  const study::CohortResult found = run(show, [&](Progress& progress) {
    request.goes_on = [&] {
      const std::lock_guard lock(progress.mutex);
      return !progress.stop;
    };
    return study::run_cohort(request,
                             [&](std::size_t done, std::size_t of) { progress.step(done, of, "take"); });
  });
  return nb::make_tuple(found.takes, found.failed);
}

}  // namespace

void add_identify(nb::module_& m) {
  m.def("identify", &identify_takes, nb::arg("pairs"), nb::arg("map").none(), nb::kw_only(),
        nb::arg("rate_hz"), nb::arg("split"), nb::arg("structure"), nb::arg("lead_s"),
        nb::arg("clock_offset_s").none(), nb::arg("fit_all"), nb::arg("leave_out"), nb::arg("input_unit"),
        nb::arg("output_unit"), nb::arg("reference_error_deg"), nb::arg("ends_deg"),
        nb::arg("initial").none(), nb::arg("refit").none(), nb::arg("time_limit_s").none(),
        nb::arg("threads"), nb::arg("progress").none());
  m.def("fit", &fit, nb::arg("recording"), nb::arg("map"), nb::arg("rate_hz"), nb::arg("structure"),
        nb::arg("progress").none());
  m.def("align", &align, nb::arg("sensor"), nb::arg("reference"), nb::kw_only(), nb::arg("input"),
        nb::arg("output"), nb::arg("rate_hz"), nb::arg("clock_offset_s").none(), nb::arg("output_unit"),
        nb::arg("progress").none());
  m.def("recalibrate", &recalibrate, nb::arg("model"), nb::kw_only(), nb::arg("recording").none(),
        nb::arg("poses"), nb::arg("poses_log").none(), nb::arg("sensor").none(), nb::arg("reference").none(),
        nb::arg("map"), nb::arg("inputs"), nb::arg("progress").none());
  m.def("cohort", &cohort, nb::arg("manifest"), nb::arg("out"), nb::kw_only(), nb::arg("rate_hz"),
        nb::arg("split"), nb::arg("structure"), nb::arg("lead_s"), nb::arg("fit_all"), nb::arg("leave_out"),
        nb::arg("shard"), nb::arg("threads"), nb::arg("progress").none());
  m.def("cohort_takes",
        [](const std::filesystem::path& manifest) { return study::read_manifest(manifest).takes.size(); });
  m.def("merge_cohort", &study::merge_cohort, nb::arg("parts"), nb::arg("out"));
  m.def("from_poses", &from_poses, nb::arg("recording"), nb::kw_only(), nb::arg("rate_hz"),
        nb::arg("ends_deg"), nb::arg("joints"));
}

}  // namespace flexor::python
