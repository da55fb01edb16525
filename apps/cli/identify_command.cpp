#include <fmt/format.h>
#include <fmt/ranges.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>

#include "apps/cli/commands.hpp"
#include "apps/cli/progress.hpp"
#include "host/deploy/model_block.hpp"
#include "host/identify/from_poses.hpp"
#include "host/identify/identify.hpp"
#include "host/identify/joint_map.hpp"
#include "host/identify/results.hpp"
#include "host/io/folder_lock.hpp"
#include "host/io/interrupt.hpp"
#include "host/io/json.hpp"
#include "host/io/output.hpp"
#include "host/recording/csv.hpp"
#include "host/report/render.hpp"
#include "host/study/cohort.hpp"

namespace flexor::cli {
namespace identify_command {

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
  std::vector<std::string> reference_error;  // JOINT=DEG
  std::string refit;
  std::string initial;
  std::string poses;
  std::string first_pose;
  std::vector<std::string> pose_angles;  // JOINT=OPEN:FIST
  std::string lead_for;
  std::string leave_out;
  std::string manifest;
  std::string out;
  std::string shard;
  std::optional<double> time_limit_s;
  bool json = false;
};

// The search goes on until a signal or the time limit, and shows how far it is. Then the best so far is taken.
class Search {
 public:
  explicit Search(std::optional<double> limit_s) : limit_s_(limit_s) {
    if (limit_s && !(*limit_s > 0)) throw io::InputError("--time-limit must be positive");
  }

  bool operator()(std::size_t done, std::size_t of, const std::string& what) {
    line_->step(what, done, of);
    const bool interrupted = *stop_->flag();
    if (interrupted && !said_ && done > 0) {
      log("interrupted: what is found so far is finished and scored; once more ends it at once");
      said_ = true;
    }
    return !interrupted && !(limit_s_ && seconds() > *limit_s_);
  }

  template <typename Work>
  auto run(const Work& work) {
    try {
      auto result = work();
      line_.reset();
      stop_.reset();
      return result;
    } catch (const io::Cancelled&) {
      line_.reset();
      if (!*stop_->flag())
        throw io::JobError("nothing was fitted within the time limit: a larger --time-limit");
      throw io::Cancelled("interrupted");
    }
  }

 private:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }

  std::optional<double> limit_s_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  std::optional<io::StopOnSignal> stop_{std::in_place};
  bool said_ = false;
  std::optional<ProgressLine> line_{std::in_place};
};

// The video's angles as a file: in the report's folder, or in `folder` for the time being.
std::filesystem::path angles_of_video(const Options& o, io::Worker& camera,
                                      const std::filesystem::path& folder) {
  const std::filesystem::path video = o.files.reference;
  TrackOptions track;
  track.video = video;
  track.joints = fmt::format("{}", fmt::join(o.joints, ","));
  track.lens = o.lens;
  track.out = folder / (video.stem().string() + "_angles.csv");
  const nlohmann::ordered_json tracked = track_video(camera, track, [] { return true; });
  for (const auto& warning : tracked.at("warnings")) log_warning(warning.get<std::string>());
  return track.out;
}

// All candidates of a joint that stands alone.
void show_structures(const identify::JointFit& joint) {
  print(fmt::format("\n{:>4}{:>7}{:>7} {:>19}   structure\n", "par.", "fitted", "cross", "fold loss"));
  for (const identify::CandidateRow& row : joint.rows) {
    const auto degrees = [](double value) { return std::isnan(value) ? "-" : fmt::format("{:.2f}", value); };
    print(fmt::format("{:>4.0f}{:>7}{:>7} {:>19} {} {}\n", row.parameters, degrees(row.fitted_rmse_deg),
                      degrees(row.cross_validated_deg.value_or(std::nan(""))),
                      row.fold_loss ? fmt::format("{:.3g} +- {:.2g}", *row.fold_loss, row.fold_loss_se) : "-",
                      row.chosen ? "*" : " ", row.structure));
    if (!row.refusal.empty()) print(fmt::format("{:38}not: {}\n", "", row.refusal));
  }
  print(
      "fitted, cross: RMSE of the fitted part in degrees, as fitted and cross-validated\n"
      "*: the smallest that can be worn of sums that lose at most 6.1 % and err at most 3 %\n"
      "   (cross) more than the best of all, or a smaller chain within a standard error of it\n");
}

// RMSE in degrees, the compensator's and each baseline's under its own name.
std::string scores_header(const std::string& what, std::size_t width) {
  return fmt::format("\n{:<{}}{:>8}{:>8}{:>9}{:>8}{:>8}{:>8}", what, width, "model", "line", "limited",
                     "lead", "curve", "publ.");
}

std::string scores_row(const identify::ScoreRow& row, std::size_t width) {
  std::string out = fmt::format("{:<{}}{:>8.2f}", io::start_of(row.name, width - 1), width, row.rmse_deg);
  for (const char* name : {"line", "limited_line", "line_lead", "static_curve", "published_form"}) {
    const auto it = row.baseline_deg.find(name);
    out += fmt::format("{:>{}}", it == row.baseline_deg.end() ? "-" : fmt::format("{:.2f}", it->second),
                       name == std::string("limited_line") ? 9 : 8);
  }
  return out;
}

// A row for each pair or part that was left out.
void show_rows(const std::string& joint, const std::string& what,
               const std::vector<identify::ScoreRow>& rows) {
  constexpr std::size_t kName = 30;
  print(scores_header(joint + ", " + what, kName) + "\n");
  for (const identify::ScoreRow& row : rows) print(scores_row(row, kName) + "\n");
}

void show(const identify::Result& r) {
  for (const std::string& warning : r.warnings) log_warning(warning);
  const std::vector<std::string> names = identify::names_of(r.files);
  for (std::size_t p = 0; p < r.clocks.size(); ++p) {
    print(fmt::format("{}: clock offset {:+.3f} s +- {:.3f}, confidence {:.2f}\n", names[p],
                      r.clocks[p].offset_s, r.clocks[p].standard_error_s, r.clocks[p].confidence));
    if (r.clocks[p].drift_ppm != 0) {
      print(fmt::format("  the reference's clock runs {:+.0f} ppm +- {:.0f} fast: taken out of its times\n",
                        r.clocks[p].drift_ppm, r.clocks[p].drift_se_ppm));
    }
  }
  if (r.joints.size() == 1) show_structures(r.joints.front());
  constexpr std::size_t kName = 19;
  print(fmt::format("{}{:>9}\n", scores_header("held out, RMSE deg", kName), "drift"));
  for (const identify::JointResult& joint : r.joints)
    print(fmt::format("{}{:>9.2f}\n", scores_row(joint.all(), kName), joint.hold_drift_deg));
  print(
      "line, limited, lead, curve, publ.: baselines fitted to the same part, a straight\n"
      "  line, between limits, with a lead; a static curve; the published form\n"
      "drift: of the model's angle within a minute of held readings, deg\n\n");
  for (const identify::JointResult& joint : r.joints)
    print(fmt::format("{}: {}\n  {}\n", joint.name, joint.structure, score::in_words(joint.verdict)));
  for (const model::Joint& joint : r.model.joints) {
    const model::Ends ends = model::ends(r.model, joint);
    const bool stated = r.options.ends.contains(joint.name);
    print(fmt::format("{}: open hand {:.1f} deg, fist {:.1f}{}\n", joint.name, ends.open_deg, ends.fist_deg,
                      stated ? "" : ", by its angles; --pose-angles states others"));
  }
  for (const identify::JointResult& joint : r.joints) {
    if (r.options.lead_s > 0)
      print(fmt::format(
          "{}: {:.3f} s ahead; where what follows takes {:g} s less {:.2f} deg, more {:.2f} deg\n",
          joint.name, r.options.lead_s, identify::kLeadOff_s, joint.sooner_deg, joint.later_deg));
    if (joint.pairs.size() > 1) show_rows(joint.name, "held out of each pair", joint.pairs);
    if (!joint.left_out.empty()) show_rows(joint.name, "left out", joint.left_out);
    if (!joint.left_out_verdict) continue;
    print(fmt::format("{}, left out: {}\n", joint.name, score::in_words(*joint.left_out_verdict)));
  }
}

std::map<std::string, double> reference_errors(const std::vector<std::string>& items) {
  std::map<std::string, double> out;
  for (const std::string& item : items) {
    const std::size_t equals = item.find('=');
    const auto error_deg = recording::to_number(equals == std::string::npos ? "" : item.substr(equals + 1));
    if (!error_deg)
      throw io::InputError(fmt::format("--reference-error {}: write JOINT=DEGREES, as index_mcp=6", item));
    out[model::joint_name(item.substr(0, equals))] = *error_deg;
  }
  return out;
}

std::map<std::string, model::Ends> pose_angles(const std::vector<std::string>& items) {
  std::map<std::string, model::Ends> out;
  for (const std::string& item : items) {
    const std::size_t equals = std::min(item.find('='), item.size());
    const std::size_t colon = std::min(item.find(':', equals), item.size());
    const auto open_deg =
        recording::to_number(equals < colon ? item.substr(equals + 1, colon - equals - 1) : "");
    const auto fist_deg = recording::to_number(colon < item.size() ? item.substr(colon + 1) : "");
    if (!open_deg || !fist_deg)
      throw io::InputError(
          fmt::format("--pose-angles {}: write JOINT=OPEN:FIST in degrees, as thumb=90:170", item));
    out[model::joint_name(item.substr(0, equals))] = {*open_deg, *fist_deg};
  }
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
  const auto total =
      budget.is_object() ? budget.value("total", nlohmann::ordered_json()) : nlohmann::ordered_json();
  if (!total.is_object() || !total.contains("mean_ms") || !total["mean_ms"].is_number())
    throw io::InputError(fmt::format("--for {}: hand, vr, or a file that flexor latency --json wrote", what));
  return total["mean_ms"].get<double>() / 1000 + kHand_s;
}

// What finds no partner is said.
std::vector<identify::JointMap> map_by_name(const identify::Request& r) {
  const std::vector<identify::JointMap> map = identify::map_by_name(r.pairs.front(), r.time);
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
  if (mapped && (!o.files.input.empty() || !o.files.output.empty() || !o.joints.empty())) {
    throw io::InputError(
        "--pair and --map say which sensors and angles belong together: leave out --input, --output and "
        "--joints");
  }
  if (o.pairs.empty() && (o.files.sensor.empty() || o.files.reference.empty()))
    throw io::InputError("--sensor and --reference are needed, or --pair and --map");
  for (const auto& [sensor, reference] : o.pairs) {
    if (reference.empty()) throw io::InputError(fmt::format("--pair {}: its second file is missing", sensor));
    r.pairs.push_back({sensor, reference});
  }
  if (!o.files.sensor.empty()) r.pairs.push_back({o.files.sensor, o.files.reference});
  if (!mapped) {
    const auto [map, is_named] = identify::one_joint(o.files);
    o.is_named = is_named;
    r.map = {map};
  } else {
    r.map = o.map.empty() ? map_by_name(r) : identify::parse_map(o.map);
  }
}

// What all takes have in common.
void add_common(Options& o) {
  identify::Request& r = o.request;
  r.ends = pose_angles(o.pose_angles);
  r.room = deploy::share_of_room;
  r.reference_error_deg = reference_errors(o.reference_error);
  if (!o.lead_for.empty()) r.lead_s = lead_for(o.lead_for, r.rate_hz);
  if (o.leave_out == "take") r.leave_out = identify::LeaveOut::take;
  if (o.leave_out == "person") r.leave_out = identify::LeaveOut::person;
  if (o.leave_out == "block") r.leave_out = identify::LeaveOut::block;
  if (!o.initial.empty()) r.initial = model::load(o.initial);
  if (o.refit.empty()) return;
  if (r.structure != "auto") throw io::InputError("--refit is a structure of its own: leave out --structure");
  r.initial = model::load(o.refit);
  r.refit = true;
}

void run_manifest(Options& o) {
  if (o.out.empty()) throw io::InputError("--manifest needs a folder for table and models: --out");
  if (!o.model.empty() || !o.report.empty() || !o.map.empty() || !o.pairs.empty() || !o.poses.empty() ||
      !o.files.sensor.empty() || !o.files.reference.empty() || !o.joints.empty() || o.time_limit_s)
    throw io::InputError(
        "--manifest says which files and maps, and --out where models go: leave out --pair, --sensor, "
        "--reference, --joints, --map, --poses, --model, --report and --time-limit");
  if (!o.leave_out.empty() && o.leave_out != "person")
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
  const bool is_whole = request.shard.of == 1;
  const std::size_t good = result.takes - result.failed.size();
  if (o.json)
    print(io::dump({{"takes", result.takes},
                    {"failed", result.failed},
                    {"folder", io::to_utf8(o.out)},
                    {"version", FLEXOR_VERSION}}));
  else if (is_whole)
    print(fmt::format("table    {0}/cohort.csv\nmodels   {0}/models\n", o.out));
  const std::string summary = fmt::format("{} of {} takes identified", good, result.takes);
  if (good == 0 && result.takes > 0) throw io::JobError(summary + ": " + result.failed.front());
  log(summary + (is_whole ? "" : fmt::format("; when all shards are: flexor merge FOLDER... --out FOLDER")));
}

// Without a camera.
void run_poses(const Options& o) {
  if (!o.map.empty() || !o.pairs.empty() || !o.files.sensor.empty() || !o.report.empty())
    throw io::InputError(
        "--poses is a log of held poses alone: leave out --pair, --sensor, --map and --report");
  if (o.model.empty()) throw io::InputError("--poses: say with --model where the model goes");
  io::require_writable(o.model);
  identify::PosesOptions options{o.request.rate_hz, pose_angles(o.pose_angles), o.joints};
  if (!o.first_pose.empty())
    options.first = o.first_pose == "fist" ? identify::FirstPose::fist : identify::FirstPose::open;
  recording::Recording poses = recording::read_csv(o.poses, {}, o.request.time);
  for (const recording::Column& c : std::vector(poses.columns))
    recording::state_unit(poses, c.name, c.unit.empty() ? o.request.input_unit : "");
  if (!o.json)
    for (const std::string& warning : poses.warnings) log_warning(warning);
  const identify::FromPoses r = identify::model_from_poses(poses, options);
  model::save(r.model, o.model);
  if (o.json) {
    nlohmann::ordered_json joints = nlohmann::ordered_json::object();
    for (std::size_t j = 0; j < r.model.joints.size(); ++j) {
      joints[r.model.joints[j].name] = {{"open", r.model.inputs[j].poses->open},
                                        {"fist", r.model.inputs[j].poses->fist},
                                        {"expected_error_deg", identify::kPosesError_deg}};
    }
    std::vector<std::string> warnings = poses.warnings;
    warnings.insert(warnings.end(), r.warnings.begin(), r.warnings.end());
    return print(io::dump({{"joints", std::move(joints)},
                           {"open_holds", r.open_holds},
                           {"fist_holds", r.fist_holds},
                           {"warnings", warnings},
                           {"version", FLEXOR_VERSION}}));
  }
  for (const std::string& warning : r.warnings) log_warning(warning);
  for (std::size_t j = 0; j < r.model.joints.size(); ++j) {
    print(fmt::format("{:<16}open {:.5g}, fist {:.5g} {}\n", r.model.joints[j].name,
                      r.model.inputs[j].poses->open, r.model.inputs[j].poses->fist, r.model.inputs[j].unit));
  }
  print(fmt::format(
      "a straight line for each: nothing was measured, about {:.0f} deg are to be expected\nmodel    {}\n",
      identify::kPosesError_deg, o.model));
}

// The reference is a video, which is tracked first: its angles lie beside the report, or in `temporary` until the end.
void track_reference(Options& o, std::optional<io::TemporaryFolder>& temporary) {
  if (o.joints.empty()) {
    if (!o.lens.empty()) throw io::InputError("--lens goes with a video: add --joints");
    return;
  }
  io::Worker camera(io::program_beside(kCameraWorker));
  if (o.report.empty()) temporary.emplace();
  o.files.reference =
      angles_of_video(o, camera, temporary ? temporary->path() : std::filesystem::path(o.report));
}

void run(Options& o) {
  o.files.time = o.request.time;
  if (!o.manifest.empty()) return run_manifest(o);
  if (!o.out.empty() || !o.shard.empty())
    throw io::InputError("--out and --shard go with --manifest; one model goes to --model");
  if (!o.poses.empty()) return run_poses(o);
  io::require_outputs({o.model}, o.report);
  std::optional<io::FolderLock> lock;
  if (!o.report.empty()) lock.emplace(o.report, "hand");
  std::optional<io::TemporaryFolder> temporary;
  track_reference(o, temporary);
  add_takes(o);
  add_common(o);
  Search search(o.time_limit_s);
  identify::Result result = search.run([&] { return identify::identify_files(o.request, std::ref(search)); });
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
  if (o.json) {
    print(io::dump(to_json(result)));
  } else {
    show(result);
    if (!o.model.empty()) print(fmt::format("model    {}\n", o.model));
    if (!o.report.empty()) print(fmt::format("report   {}/report.html\n", o.report));
  }
  if (std::ranges::any_of(result.joints, [](const auto& joint) { return joint.untried > 0; }))
    throw io::Doubt(identify::kStopped);
  if (result.leave_out_stopped)
    throw io::Doubt("stopped before each part was left out: their verdict is missing");
}

void add_cohort(CLI::App& command, Options& o) {
  command.add_option(
      "--manifest", o.manifest,
      "COHORT.csv: many takes, a row each with subject, session, glove, reference (files beside "
      "the manifest), map (as --map, a file with that, or empty) and further columns, which the "
      "table carries along; with --out");
  command
      .add_option(
          "--out", o.out,
          "of --manifest: cohort.csv, a row a subject, session and joint, and models/SUBJECT_SESSION.json; "
          "goes on where a run was cut off (75: stopped, give the command again)")
      ->transform(kFolder);
  command.add_option(
      "--shard", o.shard,
      "2/8: only that part of --manifest, on one of eight machines; flexor merge puts them together");
  command.add_option("--threads", o.request.threads, "0: as many as the machine has")->capture_default_str();
}

void add_structure(CLI::App& command, identify::Request& r) {
  command
      .add_option("--structure", r.structure,
                  "auto; line (by least squares); a sum of curves: limited-line, line-lead, curve, "
                  "hysteresis or e.g. \"curve(20) + "
                  "play(0.08) > curve(20) + "
                  "motion(0.3)\"; a chain: linear-dynamic, hammerstein, wiener, hw, wh, "
                  "hysteresis-hw or e.g. "
                  "\"hysteresis(2) > curve(10) > lti(2) > saturation\" or \"curve > pair > curve\"")
      ->capture_default_str();
}

// What several joints or recordings take.
void add_pairs(CLI::App& command, Options& o) {
  command
      .add_option("--pair", o.pairs,
                  "GLOVE CAMERA: a log and its measured angles; may be repeated, one for each donning")
      ->type_name("GLOVE CAMERA");
  command.add_option(
      "--poses", o.poses,
      "LOG of held poses, for a glove without a camera: the open hand for three seconds, a fist for "
      "three, and again; a straight line for each sensor, its angles not measured");
  command
      .add_option("--first-pose", o.first_pose,
                  "the pose that --poses begins with (default: open; fist where all readings fall)")
      ->check(CLI::IsMember({"open", "fist"}));
  command
      .add_option("--pose-angles", o.pose_angles,
                  "JOINT=OPEN:FIST, the angles of the open hand and of a fist: "
                  "thumb=90:170,index=28:113 (default: 0:90, the thumb's 0:60)")
      ->delimiter(',');
  command.add_option("--map", o.map,
                     "joints from sensors: thumb=SensorA0:thumb_deg,index=SensorA1+SensorA2:index_deg (own "
                     "sensor first; default: by "
                     "name, index_adc with index_deg)");
  command
      .add_option("--leave-out", o.leave_out,
                  "take, person (whose logs lie in a folder of their own) or block (eighths of the time): "
                  "each in turn is left "
                  "out of a fit to all the rest and scored")
      ->check(CLI::IsMember({"take", "person", "block"}));
  command.add_flag("--fit-all", o.request.fit_all,
                   "once proven on held-out data, fit the model in the same way to all of it");
  command
      .add_option("--reference-error", o.reference_error,
                  "RMS error of the measured angles themselves, index_mcp=6,index_pip=11; the model "
                  "then states it too")
      ->delimiter(',');
  CLI::Option* refit = command.add_option(
      "--refit", o.refit, "a model of which only gains and dead zones are fitted to the wearer");
  command
      .add_option("--initial", o.initial,
                  "a model whose chains are fitted anew from their own values, beside the usual starts; "
                  "--structure may ask for the like")
      ->excludes(refit);
}

}  // namespace identify_command

void add_identify(CLI::App& app) {
  using namespace identify_command;
  const auto [o, command] = add_command(
      app, "identify", "From a glove log and measured angles to a compensator proven on unseen data", run);
  identify::Request& r = o->request;
  command->add_option("--sensor", o->files.sensor, "CSV log of the glove");
  command->add_option("--reference", o->files.reference,
                      "CSV of the measured angle, or with --joints the video itself");
  add_pairs(*command, *o);
  add_cohort(*command, *o);
  command
      ->add_option(
          "--joints", o->joints,
          "with --poses what the sensors bend with, in their order: thumb,index,middle,ring,pinky; else a "
          "joint file (models/joints): the reference is a video, which is tracked first")
      ->delimiter(',');
  command->add_option("--lens", o->lens, "lens file of flexor camera calibrate, for the video");
  command->add_option("--input", o->files.input, "column of the sensor log (default: its only one)");
  command->add_option("--output", o->files.output,
                      "column of the reference, degrees (default: its only one)");
  command->add_option("--rate", r.rate_hz, "sample rate of the compensator, Hz")->capture_default_str();
  command->add_option("--split", r.split, "share of the recording, from its start, that is fitted")
      ->capture_default_str();
  add_structure(*command, r);
  command->add_option(
      "--time-limit", o->time_limit_s,
      "seconds after which the search of structures ends with the best so far, as at an interrupt (Ctrl-C); "
      "reading, clocks and scoring come on top");
  command->add_option("--clock-offset", r.clock_offset_s,
                      "use this offset in seconds (reference minus sensor) and check it against the signals");
  CLI::Option* lead = command->add_option(
      "--lead", r.lead_s,
      "estimate the angle this many seconds ahead, to make up for lag behind the compensator");
  command
      ->add_option("--for", o->lead_for,
                   "the lead for what follows the glove: hand (radio of 9600 baud and bionic hand), vr (text "
                   "over USB), or a "
                   "file that flexor latency --json wrote for your boards")
      ->excludes(lead)
      ->type_name("hand|vr|FILE");
  command->add_option(
      "--input-unit", r.input_unit,
      "count, V, mV, ohm, kohm, deg or rad: of the sensor, where its column's name states none");
  command->add_option("--output-unit", r.output_unit,
                      "deg or rad: of the angle, where its column's name states none (default: deg)");
  add_time_options(*command, r.time);
  command
      ->add_option(
          "--segment", r.time.segments,
          "of files that hold several trials: the column whose change begins another, or clock, where it "
          "starts again; each trial is a take; once more for a second file")
      ->type_name("COLUMN|clock");
  command->add_option("--model", o->model, "write the model document here");
  command
      ->add_option("--report", o->report,
                   "write report.html, a page for each joint, figures and samples into this folder")
      ->transform(kFolder);
}

}  // namespace flexor::cli
