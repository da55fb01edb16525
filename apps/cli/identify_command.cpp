#include <chrono>

#include "apps/cli/commands.hpp"
#include "apps/cli/progress.hpp"
#include "host/deploy/model_block.hpp"
#include "host/identify/from_poses.hpp"
#include "host/identify/identify.hpp"
#include "host/identify/joint_map.hpp"
#include "host/io/folder_lock.hpp"
#include "host/io/interrupt.hpp"
#include "host/io/output.hpp"
#include "host/recording/csv.hpp"
#include "host/report/render.hpp"
#include "host/study/cohort.hpp"

namespace flexor::cli::identify_command {

struct Options {
  identify::SourceFiles files;
  bool is_named = true;  // the finger, by a column
  identify::Request request;
  std::string model;
  std::string report;
  std::vector<std::string> joints;
  std::string lens;
  std::vector<std::pair<std::string, std::string>> pairs;  // sensor, reference
  std::string map;
  bool neighbours = false;
  std::vector<std::string> reference_error;  // JOINT=DEG
  std::string refit;
  std::string initial;
  std::string poses;
  identify::FirstPose first_pose = identify::FirstPose::unstated;
  std::vector<std::string> pose_angles;  // JOINT=OPEN:FIST
  std::string lead_for;
  std::string manifest;
  std::string out;
  std::string shard;
  std::optional<double> time_limit_s;
  bool json = false;
};

// The search goes on until a signal or the time limit, and shows how far it is. Then the best so far is taken.
identify::Result search(const Options& o) {
  const auto begin = std::chrono::steady_clock::now();
  const io::StopOnSignal stop;
  ProgressLine line;
  bool noted = false;
  const auto goes_on = [&](std::size_t done, std::size_t of, const std::string& what) {
    line.step(what, done, of);
    const bool interrupted = *stop.flag();
    if (interrupted && !noted && done > 0) {
      log("interrupted: what is found so far is finished and scored; once more ends it at once");
      noted = true;
    }
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
    return !interrupted && !(o.time_limit_s && taken.count() > *o.time_limit_s);
  };
  try {
    return identify::identify_files(o.request, goes_on);
  } catch (const io::Cancelled&) {
    if (!*stop.flag()) throw io::JobError("nothing was fitted within the time limit: a larger --time-limit");
    throw io::Cancelled("interrupted");
  }
}

// JOINT=NUMBER, or so many numbers with ":" between them, by the joint.
std::map<std::string, std::vector<double>> by_joint(const std::vector<std::string>& items,
                                                    std::size_t numbers, const char* as) {
  std::map<std::string, std::vector<double>> out;
  for (const std::string& item : items) {
    const std::size_t equals = std::min(item.find('='), item.size());
    std::vector<double>& values = out[model::joint_name(item.substr(0, equals))];
    for (const std::string& text : CLI::detail::split(item.substr(std::min(equals + 1, item.size())), ':'))
      if (const auto value = recording::to_number(text)) values.push_back(*value);
    if (values.size() != numbers) throw io::InputError("{}: write {}", item, as);
  }
  return out;
}

std::map<std::string, model::Ends> pose_angles(const std::vector<std::string>& items) {
  std::map<std::string, model::Ends> out;
  for (const auto& [joint, deg] :
       by_joint(items, 2, "--pose-angles JOINT=OPEN:FIST in degrees, as thumb=90:170"))
    out[joint] = {deg[0], deg[1]};
  return out;
}

// How long after a movement what follows the glove shows it: half a sample, then what lies behind it.
double lead_for(const std::string& what, double rate_hz) {
  constexpr double kRadio_s = 0.032;  // from a sample to the motor's command at 9600 baud (flexor latency)
  constexpr double kHand_s = 0.022;   // until a finger of the hand follows
  constexpr double kText_s = 0.005;   // of five fingers at 115200 baud, and a turn of USB
  const double sample_s = 0.5 / rate_hz;
  if (what == "hand") return sample_s + kRadio_s + kHand_s;
  if (what == "vr") return sample_s + kText_s;
  const auto budget = io::parse_json(io::read_document(what), what);
  const auto total = budget.is_object() ? budget.value("total", Json()) : Json();
  if (!total.is_object() || !total.contains("mean_ms") || !total["mean_ms"].is_number())
    throw io::InputError("--for {}: hand, vr, or a file that flexor latency --json wrote", what);
  return total["mean_ms"].get<double>() / 1000 + kHand_s;
}

// A column without a partner is a warning.
std::vector<identify::JointMap> map_by_name(const identify::Request& r) {
  std::vector<identify::JointMap> map = identify::map_by_name(r.pairs.front(), r.time);
  for (const std::string& angle : identify::columns_of(r.pairs.front(), true, r.time)) {
    const std::string finger = angle.substr(0, angle.find('_'));
    if (std::ranges::count(model::finger_names(), finger) > 0 && !angle.ends_with("_quality") &&
        std::ranges::count(map, angle, &identify::JointMap::reference) == 0)
      log_note(fmt::format("{} is left out: {} has no column of numbers called {}", angle,
                           r.pairs.front().sensor.string(), finger));
  }
  for (const recording::Log& log : {r.pairs.front().sensor, r.pairs.front().reference}) {
    const auto numbers = recording::open_log(log, {{}, r.time});
    const auto all = recording::open_log(log, {{}, r.time, recording::Holes::all});
    for (const std::string& name : all->columns()) {
      if (std::ranges::count(numbers->columns(), name) == 0)
        log_note(fmt::format("{} is left out: {} has no number in it", name, log.string()));
    }
  }
  return map;
}

// Pairs and map, as they are or as one pair and its columns.
void add_takes(Options& o) {
  identify::Request& r = o.request;
  const bool mapped = !o.map.empty() || !o.pairs.empty();
  if (o.pairs.empty() && (o.files.sensor.empty() || o.files.reference.empty()))
    throw io::InputError("--sensor and --reference are needed, or --pair and --map");
  for (const auto& [sensor, reference] : o.pairs) {
    if (reference.empty()) throw io::InputError("--pair {}: its second file is missing", sensor);
    r.pairs.push_back({sensor, reference});
  }
  if (!o.files.sensor.empty()) r.pairs.push_back({o.files.sensor, o.files.reference});
  if (!mapped) {
    const auto [map, is_named] = identify::one_joint(o.files);
    o.is_named = is_named;
    r.map = {map};
  } else {
    r.map = o.map.empty() ? map_by_name(r) : identify::parse_map(o.map);
    if (o.neighbours) {
      auto map = identify::with_neighbours(r.map, identify::columns_of(r.pairs.front(), false, r.time));
      if (map == r.map)
        log_note(
            "--neighbours: no sensor is known by its name or its joint to be of a finger beside; --map "
            "index=A1+A2:index_deg says it");
      r.map = std::move(map);
    }
  }
}

// What all takes have in common.
void add_common(Options& o) {
  identify::Request& r = o.request;
  r.ends = pose_angles(o.pose_angles);
  r.room = deploy::share_of_room;
  for (const auto& [joint, deg] :
       by_joint(o.reference_error, 1, "--reference-error JOINT=DEGREES, as index_mcp=6"))
    r.reference_error_deg[joint] = deg[0];
  if (!o.lead_for.empty()) r.lead_s = lead_for(o.lead_for, r.rate_hz);
  r.refit = !o.refit.empty();
  if (const std::string& from = r.refit ? o.refit : o.initial; !from.empty()) r.initial = model::load(from);
}

void run_manifest(Options& o) {
  using identify::LeaveOut;
  if (o.request.leave_out == LeaveOut::take || o.request.leave_out == LeaveOut::block)
    throw io::InputError("--manifest: --leave-out person, which is each subject");
  add_common(o);
  study::CohortRequest request{study::read_manifest(o.manifest), o.request, o.out, {}, o.request.threads, {}};
  if (!o.shard.empty()) request.shard = study::parse_shard(o.shard);
  study::CohortResult result;
  {
    io::StopOnSignal stop;
    request.goes_on = [&] { return !*stop.flag(); };
    ProgressLine line;
    try {
      result = study::run_cohort(
          request, [&](std::size_t done, std::size_t of) { line.step("identify: fit", done, of); });
    } catch (const io::Cancelled& stopped) {
      log(std::string("flexor: ") + stopped.what());
      throw JobEnded{kGoOnLater};
    }
  }
  for (const std::string& failed : result.failed) log_warning(failed);
  if (result.warned > 0)
    log_warning(fmt::format("{} take(s) have warnings: the table's column of that name", result.warned));
  const bool is_whole = request.shard.of == 1;
  const std::size_t good = result.takes - result.failed.size();
  print({{{"takes", result.takes},
          {"failed", result.failed},
          {"warned", result.warned},
          {"folder", io::to_utf8(o.out)}},
         is_whole ? fmt::format("table    {0}/cohort.csv\nmodels   {0}/models\n", o.out) : ""},
        o.json);
  const std::string summary = fmt::format("{} of {} takes identified", good, result.takes);
  if (good == 0 && result.takes > 0) throw io::JobError(summary + ": " + result.failed.front());
  log(summary + (is_whole ? "" : fmt::format("; when all shards are: flexor merge FOLDER... --out FOLDER")));
}

// Without a camera.
Output run_poses(const Options& o) {
  io::require_writable(o.model);
  identify::PosesOptions options{o.request.rate_hz, pose_angles(o.pose_angles), o.joints, o.first_pose};
  recording::Recording poses = recording::read_csv(o.poses, {}, o.request.time);
  for (const recording::Column& c : std::vector(poses.columns))
    recording::state_unit(poses, c.name, c.unit.empty() ? o.request.input_unit : "");
  const identify::FromPoses r = identify::model_from_poses(poses, options);
  model::save(r.model, o.model);
  std::vector<std::string> warnings = poses.warnings;
  warnings.insert(warnings.end(), r.warnings.begin(), r.warnings.end());
  Json joints = Json::object();
  std::string text;
  for (std::size_t j = 0; j < r.model.joints.size(); ++j) {
    const model::Input& input = r.model.inputs[j];
    joints[r.model.joints[j].name] = {{"open", input.poses->open},
                                      {"fist", input.poses->fist},
                                      {"expected_error_deg", identify::kPosesError_deg}};
    text += fmt::format("{:<16}open {:.5g}, fist {:.5g} {}\n", r.model.joints[j].name, input.poses->open,
                        input.poses->fist, input.unit);
  }
  return {{{"joints", std::move(joints)},
           {"open_holds", r.open_holds},
           {"fist_holds", r.fist_holds},
           {"warnings", warnings}},
          text + fmt::format(
                     "a straight line for each: nothing was measured, about {:.0f} deg are to be expected\n"
                     "model    {}\n",
                     identify::kPosesError_deg, o.model),
          warnings};
}

// The reference is a video, which is tracked first: its angles lie beside the report, or in `temporary` until the end.
void track_reference(Options& o, std::optional<io::TemporaryFolder>& temporary) {
  if (o.joints.empty()) return;
  io::Worker camera(io::program_beside(kCameraWorker));
  if (o.report.empty()) temporary.emplace();
  TrackOptions track;
  track.video = o.files.reference;
  track.joints = fmt::format("{}", fmt::join(o.joints, ","));
  track.lens = o.lens;
  track.out = (temporary ? temporary->path() : std::filesystem::path(o.report)) /
              (track.video.stem().string() + "_angles.csv");
  log_warnings(track_video(camera, track, [] { return true; }).at("warnings"));
  o.files.reference = track.out;
}

void run(Options& o) {
  o.files.time = o.request.time;
  if (!o.manifest.empty()) return run_manifest(o);
  if (!o.poses.empty()) return print(run_poses(o), o.json);
  io::require_outputs({o.model}, o.report);
  std::optional<io::FolderLock> lock;
  if (!o.report.empty()) lock.emplace(o.report, "hand");
  std::optional<io::TemporaryFolder> temporary;
  track_reference(o, temporary);
  add_takes(o);
  add_common(o);
  identify::Result result = search(o);
  if (!o.is_named)
    result.warnings.emplace_back(
        "no column names a finger: the joint is called index; --map ring=INPUT:OUTPUT says otherwise");
  // The model first: a report that cannot be drawn must not cost the fit.
  if (!o.model.empty()) model::save(result.model, o.model);
  if (!o.report.empty()) {
    report::clear_hand(o.report);
    identify::save_results(result, o.report);
    report::render(o.report);
  }
  const Json json = to_json(result);
  print({json,
         report::summary("hand", json) + line_of("model", o.model) +
             line_of("report", o.report, "/report.html"),
         result.warnings},
        o.json);
  if (std::ranges::any_of(result.joints, [](const auto& joint) { return joint.untried > 0; }))
    throw io::Doubt(identify::kStopped);
  if (result.leave_out_stopped)
    throw io::Doubt("stopped before each part was left out: their verdict is missing");
}

void add_cohort(CLI::App& command, Options& o) {
  CLI::Option* manifest =
      command.add_option("--manifest", o.manifest,
                         "COHORT.csv: many takes, a row each with subject, session, glove, reference (files "
                         "beside the manifest), map (as --map, a file with that, or empty) and further "
                         "columns, which the table carries along; with --out");
  CLI::Option* out = add_folder(command, "--out", o.out,
                                "of --manifest: cohort.csv, a row a subject, session and joint, and "
                                "models/SUBJECT_SESSION.json; goes on where a run was cut off (75: "
                                "stopped, give the command again)")
                         ->needs(manifest);
  manifest->needs(out);
  for (const char* other : {"--pair", "--sensor", "--reference", "--joints", "--map", "--poses", "--model",
                            "--report", "--time-limit"})
    manifest->excludes(command.get_option(other));
  command
      .add_option(
          "--shard", o.shard,
          "2/8: only that part of --manifest, on one of eight machines; flexor merge puts them together")
      ->needs(manifest);
  add_shown(command, "--threads", o.request.threads, "0: as many as the machine has");
}

void add_structure(CLI::App& command, identify::Request& r) {
  add_shown(command, "--structure", r.structure,
            "auto; line (by least squares); a sum of curves: limited-line, line-lead, curve, "
            "hysteresis or e.g. \"curve(20) + play(0.08) > curve(20) + motion(0.3)\"; a chain: "
            "linear-dynamic, hammerstein, wiener, hw, wh, hysteresis-hw or e.g. \"hysteresis(2) > "
            "curve(10) > lti(2) > saturation\" or \"curve > pair > curve\"");
}

// What several joints or recordings take.
void add_pairs(CLI::App& command, Options& o) {
  CLI::Option* pair =
      command
          .add_option("--pair", o.pairs,
                      "GLOVE CAMERA: a log and its measured angles; may be repeated, one for each donning")
          ->type_name("GLOVE CAMERA");
  CLI::Option* poses = command.add_option(
      "--poses", o.poses,
      "LOG of held poses, for a glove without a camera: the open hand for three seconds, a fist for three, "
      "and again; a straight line for each sensor, its angles not measured");
  using identify::FirstPose;
  add_choice(command, "--first-pose", o.first_pose, {{"open", FirstPose::open}, {"fist", FirstPose::fist}},
             "the pose that --poses begins with (default: open; fist where all readings fall)")
      ->needs(poses);
  command
      .add_option("--pose-angles", o.pose_angles,
                  "JOINT=OPEN:FIST, the angles of the open hand and of a fist: thumb=90:170,index=28:113 "
                  "(default: 0:90, the thumb's 0:60)")
      ->delimiter(',');
  CLI::Option* map =
      command.add_option("--map", o.map,
                         "joints from sensors: thumb=SensorA0:thumb_deg,index=SensorA1+SensorA2:index_deg "
                         "(own sensor first; default: by name, index_adc with index_deg)");
  command
      .add_flag("--neighbours", o.neighbours,
                "to each joint the sensors of the fingers beside it too, which pull at its own: taken where "
                "they pay")
      ->needs(pair);
  for (const char* one : {"--input", "--output", "--joints"})
    command.get_option(one)->excludes(pair)->excludes(map);
  for (const char* one : {"--pair", "--sensor", "--map", "--report"})
    poses->excludes(command.get_option(one));
  poses->needs(command.get_option("--model"));
  using identify::LeaveOut;
  add_choice(command, "--leave-out", o.request.leave_out,
             {{"take", LeaveOut::take}, {"person", LeaveOut::person}, {"block", LeaveOut::block}},
             "take, person (whose logs lie in a folder of their own) or block (eighths of the time): each in "
             "turn is left out of a fit to all the rest and scored");
  command.add_flag("--fit-all", o.request.fit_all,
                   "once proven on held-out data, fit the model in the same way to all of it");
  command
      .add_option("--reference-error", o.reference_error,
                  "RMS error of the measured angles themselves, index_mcp=6,index_pip=11; the model then "
                  "states it too")
      ->delimiter(',');
  CLI::Option* refit = command
                           .add_option("--refit", o.refit,
                                       "a model of which only gains and dead zones are fitted to the wearer")
                           ->excludes(command.get_option("--structure"));
  command
      .add_option("--initial", o.initial,
                  "a model whose chains are fitted again from their own values, beside the usual starts; "
                  "--structure may ask for the like")
      ->excludes(refit);
}

void add(CLI::App& app) {
  const auto [o, command] = add_command(
      app, "identify", "From a glove log and measured angles to a compensator proven on unseen data", run);
  identify::Request& r = o->request;
  command->add_option("--sensor", o->files.sensor, "CSV log of the glove");
  command->add_option("--reference", o->files.reference,
                      "CSV of the measured angle, or with --joints the video itself");
  CLI::Option* joints =
      command
          ->add_option(
              "--joints", o->joints,
              "with --poses what the sensors bend with, in their order: thumb,index,middle,ring,pinky; else "
              "a joint file (models/joints): the reference is a video, which is tracked first")
          ->delimiter(',');
  command->add_option("--lens", o->lens, "lens file of flexor camera calibrate, for the video")
      ->needs(joints);
  command->add_option("--input", o->files.input, "column of the sensor log (default: its only one)");
  command->add_option("--output", o->files.output,
                      "column of the reference, degrees (default: its only one)");
  add_shown(*command, "--rate", r.rate_hz, "sample rate of the compensator, Hz");
  add_shown(*command, "--split", r.split, "share of the recording, from its start, that is fitted");
  add_structure(*command, r);
  add_positive(*command, "--time-limit", o->time_limit_s,
               "seconds after which the search of structures ends with the best so far, as at an "
               "interrupt (Ctrl-C); reading, clocks and scoring come on top");
  command->add_option("--clock-offset", r.clock_offset_s,
                      "use this offset in seconds (reference minus sensor) and check it against the signals");
  CLI::Option* lead = command->add_option(
      "--lead", r.lead_s,
      "estimate the angle this many seconds ahead, to make up for lag behind the compensator");
  command
      ->add_option("--for", o->lead_for,
                   "the lead for what follows the glove: hand (radio of 9600 baud and bionic hand), vr (text "
                   "over USB), or a file that flexor latency --json wrote for your boards")
      ->excludes(lead)
      ->type_name("hand|vr|FILE");
  command->add_option(
      "--input-unit", r.input_unit,
      "count, V, mV, ohm, kohm, deg or rad: of the sensor, where its column's name states none");
  command->add_option("--output-unit", r.output_unit,
                      "deg or rad: of the angle, where its column's name states none (default: deg)");
  add_time_options(*command, r.time);
  command
      ->add_option("--segment", r.time.segments,
                   "of files that hold several trials: the column whose change begins another, or clock, "
                   "where it starts again; each trial is a take; once more for a second file")
      ->type_name("COLUMN|clock");
  command->add_option("--model", o->model, "write the model document here");
  add_folder(*command, "--report", o->report,
             "write report.html, a page for each joint, figures and samples into this folder");
  add_pairs(*command, *o);
  add_cohort(*command, *o);
}

}  // namespace flexor::cli::identify_command
