#include "apps/camera/cameras.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <new>

#include "apps/camera/film.hpp"
#include "host/camera/draw.hpp"
#include "host/camera/video.hpp"
#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/io/output.hpp"
#include "host/recording/csv.hpp"
#include "host/twin/random.hpp"

namespace flexor::filming {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kDefaultRate_hz = 30;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// angles.csv, row by row, beside its name until it is whole.
class AngleFile {
 public:
  AngleFile(const std::filesystem::path& path, const std::vector<std::string>& angles) : output_(path) {
    output_.write("t_s");
    for (const std::string& name : angles) {
      output_.write(fmt::format(",{0}_deg,{0}_se_deg,{0}_quality", name));
    }
    output_.write("\n");
  }

  void add(const std::vector<camera::FilteredRow>& rows) {
    for (const camera::FilteredRow& row : rows) {
      std::string line = fmt::format("{:.6f}", row.t_s);
      for (const camera::FilteredAngle& a : row.angles) {
        line += fmt::format(",{:.4f},{:.4f},{}", a.deg, a.se_deg, static_cast<int>(a.quality));
      }
      output_.write(line + '\n');
    }
  }

  void finish() { output_.commit(); }

 private:
  io::Output output_;
};

// For the report: angles.csv, results.json, and one picture with its marks.
void save_results(const Tracked& r, const TrackRequest& request, const camera::Picture& labelled) {
  const std::filesystem::path& folder = request.report;
  io::make_folder(folder);
  std::error_code error;
  if (!std::filesystem::equivalent(request.out, folder / "angles.csv", error))
    io::write_file(folder / "angles.csv", io::read_file(request.out));
  labelled.empty() ? void(std::filesystem::remove(folder / "frame.jpg", error))
                   : camera::write_picture(folder / "frame.jpg", labelled);
  nlohmann::ordered_json json = {{"kind", "tracking"}};
  json.update(to_json(r, request));
  json["lens"] = io::to_utf8(request.lens.string());
  json["most_hidden_frames"] = camera::kMaxHidden;
  io::write_file(folder / "results.json", io::dump(json));
}

// Short bones turn most when a lens bends them.
double typical_bone_px(const camera::Joints& joints, const std::vector<camera::Observation>& seen,
                       int width) {
  double sum = 0;
  int count = 0;
  for (std::size_t s = 0; s < joints.skeletons.size(); ++s) {
    for (const camera::Link& l : joints.skeletons[s].links) {
      const camera::ObservedMark& a = seen[s].marks[l.from];
      const camera::ObservedMark& b = seen[s].marks[l.to];
      if (!a.measured || !b.measured) continue;
      sum += cv::norm(a.at - b.at);
      ++count;
    }
  }
  return count > 0 ? sum / count : width / 12.0;
}

// One video on its way through.
class Track {
 public:
  explicit Track(const TrackRequest& request)
      : request_(request), joints_(camera::load_joints(request.joints)) {
    if (!request.lens.empty()) lens_ = camera::load_lens(request.lens);
    io::require_outputs({request.out, request.preview});
    if (!request.preview.empty()) io::require_file(request.preview);
    if (!request.report.empty()) io::require_file(request.out);  // which the report reads back
  }

  Tracked run(const TrackProgress& progress) {
    camera::VideoReader video(request_.video);
    Tracked out;
    camera::Picture picture;
    camera::Picture labelled;
    std::optional<camera::Tracker> tracker;
    std::optional<AngleFile> file;
    std::optional<camera::Preview> preview;
    double bone_px = 0;
    double t_s = 0;
    for (;;) {
      const auto decode = Clock::now();
      if (!video.next(picture, t_s)) break;
      out.decoding_s += seconds_since(decode);
      if (!tracker) {
        out.width = picture.width;
        out.height = picture.height;
        if (lens_) lens_->require_size(out.width, out.height, request_.video.string());
        tracker.emplace(joints_, lens_, out.width, out.height);
        file.emplace(request_.out, tracker->angles());
        if (!request_.preview.empty()) {
          const double rate = video.nominal_rate_hz();
          preview.emplace(request_.preview, out.width, out.height, rate > 0 ? rate : kDefaultRate_hz,
                          joints_);
        }
      }
      const auto begin = Clock::now();
      const std::vector<camera::FilteredRow> rows = tracker->push(picture, t_s);
      out.tracking_s += seconds_since(begin);
      file->add(rows);
      if (preview) preview->add(picture, tracker->seen());
      const bool all = std::ranges::all_of(tracker->seen(), &camera::Observation::labelled);
      if (all && labelled.empty()) {
        labelled = camera::draw_seen(picture, joints_, tracker->seen());
        bone_px = typical_bone_px(joints_, tracker->seen(), out.width);
      }
      if (progress && !progress(video.frames(), video.declared_frames())) break;
      if (request_.seconds > 0 && t_s >= request_.seconds) break;
    }
    file->add(tracker->flush());
    out.summary = tracker->summary();
    require_fit(out.summary);
    out.warnings = video.warnings();
    add_warnings(out, bone_px > 0 ? bone_px : out.width / 12.0);
    file->finish();
    if (preview) preview->finish();
    if (!request_.report.empty()) save_results(out, request_, labelled);
    return out;
  }

 private:
  // Angles of a few dots that happened to look like a finger are no measurement of a hand.
  void require_fit(const camera::Summary& s) const {
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
        request_.video.string(), any ? "not all marks" : "no angle", s.frames, request_.joints.string(),
        s.never_found.size(), s.marks, missing, s.trouble.empty() ? "" : "; ",
        s.trouble.empty() ? "" : s.trouble.front());
  }

  void add_warnings(Tracked& out, double bone_px) const {
    for (const std::string& trouble : out.summary.trouble) out.warnings.push_back(trouble);
    if (out.summary.dropped > 0) {
      out.warnings.push_back(
          fmt::format("{} frame(s) are missing by the video's own clock", out.summary.dropped));
    }
    if (lens_) return;
    const bool printed = std::ranges::any_of(
        joints_.skeletons, [](const camera::Skeleton& s) { return s.kind == camera::MarkKind::printed; });
    out.warnings.push_back(
        fmt::format("no lens calibration: an ordinary lens bends bones as long as these by {:.1f} degrees at "
                    "the picture's corner, less towards its middle{}; flexor camera calibrate",
                    camera::edge_error_deg(out.width, out.height, bone_px),
                    printed ? ", and printed marks are taken as seen by a lens of 49 degrees" : ""));
  }

  const TrackRequest& request_;
  camera::Joints joints_;
  std::optional<camera::Lens> lens_;
};

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

Played play(const FilmRequest& request) {
  // Somewhere in a minute, as clocks are that were started by hand.
  twin::Random random(twin::seed_of(request.seed, 'c'));
  const double glove_clock_s = std::round(100 + 6e7 * random.uniform()) / 1e6 + 20;
  Played out;
  for (const std::string& finger : model::finger_names()) {
    out.glove.columns.push_back({finger + "_alpha", {}});
    out.truth.columns.push_back({finger + "_mcp_deg", {}});
  }
  double start_s = 0;
  for (twin::TrialInput input : request.inputs) {
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

}  // namespace

Tracked track(const TrackRequest& request, const TrackProgress& progress) {
  for (const auto& input : {request.video, request.joints, request.lens}) io::note_input(input);
  try {
    return Track(request).run(progress);
  } catch (const std::bad_alloc&) {
    throw io::JobError("{}: its pictures need more memory than there is{}: make them smaller",
                       request.video.string(), request.preview.empty() ? "" : ", with --preview");
  }
}

camera::MarkProposal propose_marks(const MarkProposalRequest& request) {
  for (const auto& input : {request.video, request.joints}) io::note_input(input);
  camera::Joints joints = camera::load_joints(request.joints);
  camera::Skeleton& skeleton = joints.skeletons[skeleton_index(joints, request.skeleton)];
  io::require_outputs({request.picture, request.save});
  camera::VideoReader video(request.video);
  camera::Picture picture;
  double t_s = 0;
  bool found = false;
  while (!found && video.next(picture, t_s)) found = t_s >= request.at_s;
  if (!found) {
    throw io::InputError("{}: ends at {:.2f} s, before {:g} s", request.video.string(), t_s, request.at_s);
  }
  camera::MarkProposal proposal = camera::propose_marks(skeleton, picture, request.mark, request.assigned);
  camera::write_picture(request.picture, camera::draw_proposal(picture, proposal));
  if (!request.save.empty()) {
    skeleton = camera::with_start(skeleton, proposal);
    io::write_file(request.save, camera::to_json(joints));
  }
  return proposal;
}

camera::LensFit fit_lens(const LensFitRequest& request) {
  for (const auto& picture : request.pictures) io::note_input(picture);
  io::require_writable(request.out);
  camera::LensFit result = camera::fit_lens(request.pictures, request.board);
  io::write_file(request.out, camera::to_json(result.lens));
  return result;
}

std::size_t film(const FilmRequest& request, const TrackProgress& progress) {
  io::require_folder(request.folder);
  const auto [glove, truth, frame_rate_hz] = play(request);
  io::make_folder(request.folder);
  HandFilm hand(request.seed);
  camera::VideoWriter video(request.folder / "video.mp4", HandFilm::kWidth, HandFilm::kHeight, frame_rate_hz);
  for (std::size_t k = 0; k < truth.t_s.size(); ++k) {
    twin::PerFinger pose{};
    for (std::size_t i = 0; i < twin::kFingers; ++i) pose[i] = truth.columns[i].value[k];
    video.add(hand.shoot(pose, k));
    if (progress && !progress(k + 1, truth.t_s.size())) throw io::Cancelled("stopped");
  }
  video.finish();
  io::write_file(request.folder / "glove.csv", recording::to_csv(glove));
  io::write_file(request.folder / "truth.csv", recording::to_csv(truth));
  io::write_file(request.folder / "joints.json", camera::to_json(request.joints));
  return truth.t_s.size();
}

}  // namespace flexor::filming
