#include "apps/camera/cameras.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <map>
#include <new>
#include <string>
#include <vector>

#include "apps/camera/film.hpp"
#include "host/camera/draw.hpp"
#include "host/camera/lens.hpp"
#include "host/camera/mark_proposal.hpp"
#include "host/camera/tracker.hpp"
#include "host/camera/video.hpp"
#include "host/io/json.hpp"
#include "host/io/output.hpp"
#include "host/io/pipe_json.hpp"
#include "host/recording/csv.hpp"
#include "host/twin/exact_json.hpp"
#include "host/twin/random.hpp"

// Bytes, whatever they are in a name.
template <>
struct nlohmann::adl_serializer<std::filesystem::path> {
  static void to_json(ordered_json& json, const std::filesystem::path& path) {
    json = flexor::io::bytes_to_json(path.string());
  }
  static void from_json(const ordered_json& json, std::filesystem::path& path) {
    path = flexor::io::bytes_from_json(json);
  }
};

namespace flexor::camera {

FLEXOR_PIPE(Unsure, from_s, to_s, frames, quality)

}  // namespace flexor::camera

namespace flexor::filming {
namespace {

using std::filesystem::path;

struct TrackRequest {
  path video;  // or a camera device
  path joints;
  path lens;           // empty: none
  path out;            // angles.csv
  path preview;        // empty: none
  path report;         // a folder; empty: none
  double seconds = 0;  // stop after these; 0: at the end
};
FLEXOR_PIPE(TrackRequest, video, joints, lens, out, preview, report, seconds)

struct Tracked {
  camera::Summary summary;
  std::vector<std::string> warnings;
  double decoding_s = 0;
  double tracking_s = 0;  // decoding and drawing left out
  int width = 0;
  int height = 0;
};

using Clock = std::chrono::steady_clock;

constexpr double kDefaultRate_hz = 30;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// Of angles.csv.
std::string lines_of(const std::vector<camera::FilteredRow>& rows) {
  std::string out;
  for (const camera::FilteredRow& row : rows) {
    out += fmt::format("{:.6f}", row.t_s);
    for (const camera::FilteredAngle& a : row.angles)
      out += fmt::format(",{:.4f},{:.4f},{}", a.deg, a.se_deg, static_cast<int>(a.quality));
    out += '\n';
  }
  return out;
}

Json to_json(const Tracked& r, const TrackRequest& request) {
  Json angles = Json::object();
  for (const camera::AngleSummary& a : r.summary.angles) {
    angles[a.name] = {
        {"frames_good", a.frames[0]}, {"frames_doubtful", a.frames[1]},      {"frames_hidden", a.frames[2]},
        {"frames_lost", a.frames[3]}, {"standard_error_deg", a.mean_se_deg}, {"min_deg", a.min_deg},
        {"max_deg", a.max_deg}};
  }
  return {{"video", request.video.string()},
          {"joints", request.joints.string()},
          {"out", request.out.string()},
          {"frames", r.summary.frames},
          {"frames_labelled", r.summary.labelled},
          {"frames_dropped", r.summary.dropped},
          {"from_s", r.summary.from_s},
          {"to_s", r.summary.to_s},
          {"width", r.width},
          {"height", r.height},
          {"angles", std::move(angles)},
          {"unsure_stretches", r.summary.unsure_stretches},
          {"unsure", r.summary.unsure},
          {"decoding_s", r.decoding_s},
          {"tracking_s", r.tracking_s},
          {"warnings", r.warnings},
          {"version", FLEXOR_VERSION}};
}

// For the report: angles.csv, results.json, and one picture with its marks.
void save_results(const Tracked& r, const TrackRequest& request, const camera::Picture& labelled) {
  const std::filesystem::path& folder = request.report;
  io::make_folder(folder);
  std::error_code error;
  if (!std::filesystem::equivalent(request.out, folder / "angles.csv", error))
    io::write_file(folder / "angles.csv", io::read_file(request.out));
  labelled.empty() ? void(std::filesystem::remove(folder / "frame.jpg", error))
                   : camera::write_picture(folder / "frame.jpg", labelled);
  Json json = {{"kind", "tracking"}};
  json.update(to_json(r, request));
  json["lens"] = io::to_utf8(request.lens.string());
  json["most_hidden_frames"] = camera::kMaxHidden;
  io::write_file(folder / "results.json", io::dump(json));
}

// Of a picture that shows every mark; 0: there are no links. Short bones turn most when a lens bends them.
double typical_bone_px(const camera::Joints& joints, const std::vector<camera::Observation>& seen) {
  double sum = 0;
  int count = 0;
  for (std::size_t s = 0; s < joints.skeletons.size(); ++s) {
    for (const camera::Link& l : joints.skeletons[s].links) {
      sum += cv::norm(seen[s].marks[l.from].at - seen[s].marks[l.to].at);
      ++count;
    }
  }
  return count > 0 ? sum / count : 0;
}

// Angles of a few dots that happened to look like a finger are no measurement of a hand.
void require_fit(const camera::Summary& s, const TrackRequest& request) {
  const bool any = std::ranges::any_of(
      s.angles, [](const camera::AngleSummary& a) { return a.frames[0] + a.frames[1] + a.frames[2] > 0; });
  const bool fits = s.labelled > 0 || 2 * s.never_found.size() <= s.marks;
  if (any && fits) return;
  constexpr std::size_t kNamed = 12;
  const auto named = std::min(kNamed, s.never_found.size());
  const auto end = s.never_found.begin() + static_cast<std::ptrdiff_t>(named);
  std::string missing = fmt::format("{}", fmt::join(s.never_found.begin(), end, ", "));
  if (named < s.never_found.size()) missing += ", ...";
  throw io::JobError(
      "{}: {} in any of {} frame(s); {} does not fit it: {} of its {} marks were never found "
      "({}){}{}; flexor track --setup shows what is seen, --assign names it",
      request.video.string(), any ? "not all marks" : "no angle", s.frames, request.joints.string(),
      s.never_found.size(), s.marks, missing, s.trouble.empty() ? "" : "; ",
      s.trouble.empty() ? "" : s.trouble.front());
}

void add_warnings(Tracked& out, const camera::Joints& joints, bool has_lens, double bone_px) {
  for (const std::string& trouble : out.summary.trouble) out.warnings.push_back(trouble);
  if (out.summary.dropped > 0) {
    out.warnings.push_back(
        fmt::format("{} frame(s) are missing by the video's own clock", out.summary.dropped));
  }
  if (has_lens) return;
  const bool printed = std::ranges::any_of(
      joints.skeletons, [](const camera::Skeleton& s) { return s.kind == camera::MarkKind::printed; });
  out.warnings.push_back(
      fmt::format("no lens calibration: an ordinary lens bends bones as long as these by {:.1f} degrees at "
                  "the picture's corner, less towards its middle{}; flexor camera calibrate",
                  camera::edge_error_deg(out.width, out.height, bone_px),
                  printed ? ", and printed marks are taken as seen by a lens of 49 degrees" : ""));
}

Tracked run(const TrackRequest& request, const io::JobProgress& progress) {
  const camera::Joints joints = camera::load_joints(request.joints);
  std::optional<camera::Lens> lens;
  if (!request.lens.empty()) lens = camera::load_lens(request.lens);
  io::require_outputs({request.out, request.preview});
  if (!request.preview.empty()) io::require_file(request.preview);
  if (!request.report.empty()) io::require_file(request.out);  // which the report reads back
  camera::VideoReader video(request.video);
  Tracked out;
  camera::Picture picture;
  camera::Picture labelled;
  std::optional<camera::Tracker> tracker;
  std::optional<io::Output> file;
  std::optional<camera::VideoWriter> preview;
  double bone_px = 0;
  double t_s = 0;
  for (;;) {
    const auto decode = Clock::now();
    if (!video.next(picture, t_s)) break;
    out.decoding_s += seconds_since(decode);
    if (!tracker) {
      out.width = picture.cols;
      out.height = picture.rows;
      if (lens) lens->require_size(out.width, out.height, request.video.string());
      tracker.emplace(joints, lens, out.width, out.height);
      file.emplace(request.out);
      file->write("t_s");
      for (const std::string& name : tracker->angles())
        file->write(fmt::format(",{0}_deg,{0}_se_deg,{0}_quality", name));
      file->write("\n");
      if (!request.preview.empty()) {
        const double rate = video.nominal_rate_hz();
        preview.emplace(request.preview, out.width, out.height, rate > 0 ? rate : kDefaultRate_hz);
      }
    }
    const auto begin = Clock::now();
    const std::vector<camera::FilteredRow> rows = tracker->push(picture, t_s);
    out.tracking_s += seconds_since(begin);
    file->write(lines_of(rows));
    if (preview) preview->add(camera::draw_seen(picture, joints, tracker->seen()));
    const bool all = std::ranges::all_of(tracker->seen(), &camera::Observation::labelled);
    if (all && labelled.empty()) {
      labelled = camera::draw_seen(picture, joints, tracker->seen());
      bone_px = typical_bone_px(joints, tracker->seen());
    }
    if (!progress(video.frames(), video.declared_frames())) break;
    if (request.seconds > 0 && t_s >= request.seconds) break;
  }
  file->write(lines_of(tracker->flush()));
  out.summary = tracker->summary();
  require_fit(out.summary, request);
  out.warnings = video.warnings();
  add_warnings(out, joints, lens.has_value(), bone_px > 0 ? bone_px : out.width / 12.0);
  file->commit();
  if (preview) preview->finish();
  if (!request.report.empty()) save_results(out, request, labelled);
  return out;
}

// Its number; the first without a name.
std::size_t skeleton_index(const camera::Joints& joints, const std::string& wanted) {
  if (wanted.empty()) return 0;
  const auto it = std::ranges::find(joints.skeletons, wanted, &camera::Skeleton::name);
  if (it != joints.skeletons.end()) return static_cast<std::size_t>(it - joints.skeletons.begin());
  std::vector<std::string> names;
  for (const camera::Skeleton& s : joints.skeletons) names.push_back(s.name);
  throw io::InputError("{}: no skeleton is called \"{}\"; there are: {}", joints.source, wanted,
                       fmt::join(names, ", "));
}

// What the glove logs and the camera sees, one motion after the other.
struct Played {
  recording::Recording glove;
  recording::Recording truth;
  double frame_rate_hz = 0;
};

Played play(const std::vector<twin::TrialInput>& inputs, std::uint64_t seed) {
  // Somewhere in a minute, as clocks are that were started by hand.
  twin::Random random(twin::seed_of(seed, 'c'));
  const double glove_clock_s = std::round(100 + 6e7 * random.uniform()) / 1e6 + 20;
  Played out;
  for (const std::string& finger : model::finger_names()) {
    out.glove.columns.push_back({finger + "_alpha", {}});
    out.truth.columns.push_back({finger + "_mcp_deg", {}});
  }
  double start_s = 0;
  for (twin::TrialInput input : inputs) {
    input.parameters.camera_noise_deg = 0;
    // The glove's camera looks without delay here: its clock is the picture's.
    input.parameters.glove_camera_latency_s = 0;
    twin::check(input);
    const twin::Trial trial = twin::simulate(input, 0, 1).front();
    const std::size_t frames = trial.glove_deg[0].size() - 1;  // the last is the next motion's first
    for (std::size_t k = 0; k < trial.sample_s.size(); ++k) {
      const double t = trial.sample_s[k];
      if (t < 0 || t >= input.motion.duration_s()) continue;
      out.glove.t_s.push_back(glove_clock_s + start_s + t);
      for (std::size_t i = 0; i < twin::kFingers; ++i)
        out.glove.columns[i].value.push_back(trial.reading[i][k]);
    }
    out.frame_rate_hz = input.parameters.camera_rate_hz;
    for (std::size_t k = 0; k < frames; ++k) {
      out.truth.t_s.push_back(start_s + static_cast<double>(k) / out.frame_rate_hz);
      for (std::size_t i = 0; i < twin::kFingers; ++i)
        out.truth.columns[i].value.push_back(static_cast<double>(trial.glove_deg[i][k]));
    }
    start_s += static_cast<double>(frames) / out.frame_rate_hz;
  }
  return out;
}

// Of what is drawn.
camera::Joints joints_of(const Json& arguments) {
  return drawn_hand(camera::joints_from_json(arguments.at("joints").dump(), "joints"));
}

// "9x6".
camera::Board board_of(const std::string& text) {
  camera::Board board;
  const auto x = text.find('x');
  const char* const end = text.data() + text.size();
  const bool good = x != std::string::npos &&
                    std::from_chars(text.data(), text.data() + x, board.columns).ptr == text.data() + x &&
                    std::from_chars(text.data() + x + 1, end, board.rows).ptr == end;
  if (!good) throw io::InputError("--board {}: must be COLUMNSxROWS of inner corners, as in 9x6", text);
  return board;
}

}  // namespace

Json track(const Json& arguments, const io::JobProgress& progress) {
  const auto request = arguments.get<TrackRequest>();
  for (const auto& input : {request.video, request.joints, request.lens}) io::note_input(input);
  try {
    return to_json(run(request, progress), request);
  } catch (const std::bad_alloc&) {
    throw io::JobError("{}: its pictures need more memory than there is{}: make them smaller",
                       request.video.string(), request.preview.empty() ? "" : ", with --preview");
  }
}

Json propose_marks(const Json& arguments, const io::JobProgress&) {
  const auto file = arguments.at("video").get<path>();
  const auto joints_file = arguments.at("joints").get<path>();
  const auto out = arguments.at("picture").get<path>();
  const auto save = arguments.at("save").get<path>();
  const auto at_s = arguments.at("at_s").get<double>();
  for (const auto& input : {file, joints_file}) io::note_input(input);
  camera::Joints joints = camera::load_joints(joints_file);
  camera::Skeleton& skeleton =
      joints.skeletons[skeleton_index(joints, io::bytes_from_json(arguments.at("skeleton")))];
  io::require_outputs({out, save});
  std::optional<camera::Point> mark;
  if (arguments.contains("colour_at_px")) {
    const auto [x, y] = arguments.at("colour_at_px").get<std::array<double, 2>>();
    mark = camera::Point{x, y};
  }
  std::map<int, std::string> assigned;
  for (const Json& pair : arguments.at("assigned"))
    assigned.emplace(pair.at("number").get<int>(), io::bytes_from_json(pair.at("mark")));
  camera::VideoReader video(file);
  camera::Picture picture;
  double t_s = 0;
  bool found = false;
  while (!found && video.next(picture, t_s)) found = t_s >= at_s;
  if (!found) throw io::InputError("{}: ends at {:.2f} s, before {:g} s", file.string(), t_s, at_s);
  const camera::MarkProposal proposal = camera::propose_marks(skeleton, picture, mark, assigned);
  camera::write_picture(out, camera::draw_proposal(picture, proposal));
  if (!save.empty()) {
    skeleton = camera::with_start(skeleton, proposal);
    io::write_file(save, camera::to_json(joints));
  }
  Json candidates = Json::array();
  for (std::size_t i = 0; i < proposal.candidates.size(); ++i) {
    const camera::Mark& m = proposal.candidates[i];
    candidates.push_back({{"number", i + 1},
                          {"mark", proposal.name[i]},
                          {"x_px", m.centre.x},
                          {"y_px", m.centre.y},
                          {"area_px", m.area_px}});
  }
  return {{"candidates", std::move(candidates)},
          {"trouble", proposal.trouble},
          {"picture", out.string()},
          {"joints", save.string()},
          {"version", FLEXOR_VERSION}};
}

Json fit_lens(const Json& arguments, const io::JobProgress& progress) {
  const auto pictures = arguments.at("pictures").get<std::vector<path>>();
  const camera::Board board = board_of(io::bytes_from_json(arguments.at("board")));
  const auto out = arguments.at("out").get<path>();
  progress(0, pictures.size());
  for (const path& picture : pictures) io::note_input(picture);
  io::require_writable(out);
  const camera::LensFit result = camera::fit_lens(pictures, board);
  io::write_file(out, camera::to_json(result.lens));
  Json json = Json::parse(camera::to_json(result.lens));
  json["used"] = result.used;
  json["refused"] = result.refused;
  json["file"] = out.string();
  json["version"] = FLEXOR_VERSION;
  return json;
}

Json film(const Json& arguments, const io::JobProgress& progress) {
  const auto inputs = arguments.at("inputs").get<std::vector<twin::TrialInput>>();
  const camera::Joints joints = joints_of(arguments);
  const auto folder = arguments.at("folder").get<path>();
  const auto seed = arguments.at("seed").get<std::uint64_t>();
  io::require_folder(folder);
  const auto [glove, truth, frame_rate_hz] = play(inputs, seed);
  io::make_folder(folder);
  Renderer hand = hand_camera(seed);
  camera::VideoWriter video(folder / "video.mp4", kFilmWidth, kFilmHeight, frame_rate_hz);
  for (std::size_t k = 0; k < truth.t_s.size(); ++k) {
    twin::PerFinger pose{};
    for (std::size_t i = 0; i < twin::kFingers; ++i) pose[i] = truth.columns[i].value[k];
    video.add(hand.draw(hand_scene(pose), k));
    if (!progress(k + 1, truth.t_s.size())) throw io::Cancelled("stopped");
  }
  video.finish();
  io::write_file(folder / "glove.csv", recording::to_csv(glove));
  io::write_file(folder / "truth.csv", recording::to_csv(truth));
  io::write_file(folder / "joints.json", camera::to_json(joints));
  return {
      {"folder", folder.string()}, {"frames", truth.t_s.size()}, {"seed", seed}, {"version", FLEXOR_VERSION}};
}

Json see(const Json& arguments, const io::JobProgress&) {
  const camera::Joints joints = joints_of(arguments);
  Renderer film = hand_camera(arguments.at("seed").get<std::uint64_t>());
  Json out;
  for (const auto& [hand, paint] : {std::pair("glove_deg", kGreen), {"hand_deg", kBlue}}) {
    auto angles = arguments.at(hand).get<FingerAngles>();
    track_drawn(joints, film, angles, arguments.at("rate_hz").get<double>(), paint);
    out[hand] = angles;
  }
  return out;
}

}  // namespace flexor::filming
