#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <memory>
#include <optional>

#include "apps/cli/commands.hpp"
#include "apps/cli/progress.hpp"
#include "apps/cli/stop.hpp"
#include "host/io/json.hpp"
#include "host/report/render.hpp"
#include "host/study/catalogue.hpp"

namespace flexor::cli {
namespace {

struct Options {
  filming::TrackRequest request;
  bool setup = false;
  double at_s = 0;
  std::string skeleton;
  std::string colour;
  std::string colour_in;
  std::vector<std::string> assign;
  std::string save;
  bool json = false;
};

std::vector<double> numbers(const std::string& text, std::size_t count, const char* option,
                            const char* what) {
  std::vector<double> out;
  const char* at = text.data();
  const char* const end = at + text.size();
  while (at < end) {
    double v = 0;
    const auto [stop, error] = std::from_chars(at, end, v);
    if (error != std::errc() || (stop < end && *stop != ',')) break;
    out.push_back(v);
    at = stop < end ? stop + 1 : end;
  }
  if (out.size() != count || at != end) {
    throw io::InputError(fmt::format("{} {}: must be {}, in pixels of the picture", option, text, what));
  }
  return out;
}

std::map<int, std::string> told(const std::vector<std::string>& assignments) {
  std::map<int, std::string> out;
  for (const std::string& text : assignments) {
    const auto equals = text.find('=');
    int number = 0;
    const char* const end = text.data() + std::min(equals, text.size());
    if (equals == std::string::npos || std::from_chars(text.data(), end, number).ptr != end || equals == 0) {
      throw io::InputError(fmt::format("--assign {}: must be NUMBER=MARK, as in 3=index_tip", text));
    }
    if (!out.emplace(number, text.substr(equals + 1)).second) {
      throw io::InputError(fmt::format("--assign: candidate {} is given two names", number));
    }
  }
  return out;
}

// The setup is about one skeleton: its number or name, or the only one.
std::size_t skeleton_index(const std::string& joints, const std::string& wanted) {
  const camera::Joints j = camera::load_joints(joints);
  if (wanted.empty()) return 0;
  const auto it = std::ranges::find(j.skeletons, wanted, &camera::Skeleton::name);
  if (it != j.skeletons.end()) return static_cast<std::size_t>(it - j.skeletons.begin());
  std::vector<std::string> names;
  for (const camera::Skeleton& s : j.skeletons) names.push_back(s.name);
  throw io::InputError(
      fmt::format("{}: no skeleton is called \"{}\"; there are: {}", joints, wanted, fmt::join(names, ", ")));
}

void run_setup(const Options& o, const filming::Cameras& cameras) {
  filming::SetupRequest request;
  request.video = o.request.video;
  request.joints = o.request.joints;
  request.at_s = o.at_s;
  request.skeleton = skeleton_index(o.request.joints.string(), o.skeleton);
  request.told = told(o.assign);
  request.picture = o.request.out;
  request.save = o.save;
  if (!o.colour.empty() && !o.colour_in.empty()) throw io::InputError("--colour or --colour-in, not both");
  if (!o.colour.empty()) {
    const auto v = numbers(o.colour, 2, "--colour", "X,Y: a point on a mark");
    request.colour.at = camera::Point{v[0], v[1]};
  }
  if (!o.colour_in.empty()) {
    const auto v = numbers(o.colour_in, 4, "--colour-in", "LEFT,TOP,WIDTH,HEIGHT: a rectangle within a mark");
    request.colour.in = camera::Window{static_cast<int>(v[0]), static_cast<int>(v[1]), static_cast<int>(v[2]),
                                       static_cast<int>(v[3])};
  }
  io::require_writable(request.picture);
  if (!o.save.empty()) io::require_writable(o.save);
  const camera::Setup setup = cameras.set_up(request);
  if (o.json) {
    nlohmann::ordered_json candidates = nlohmann::ordered_json::array();
    for (std::size_t i = 0; i < setup.candidates.size(); ++i) {
      const camera::Mark& m = setup.candidates[i];
      candidates.push_back({{"number", i + 1},
                            {"mark", setup.name[i]},
                            {"x_px", m.centre.x},
                            {"y_px", m.centre.y},
                            {"area_px", m.area_px}});
    }
    print(io::dump({{"candidates", candidates},
                    {"trouble", setup.trouble},
                    {"picture", request.picture.string()},
                    {"joints", o.save},
                    {"version", FLEXOR_VERSION}}));
    return;
  }
  if (!setup.trouble.empty()) log("warning: " + setup.trouble);
  print(fmt::format("{:>3}  {:<16}{:>9}{:>9}{:>9}\n", "", o.assign.empty() ? "proposed" : "told", "x px",
                    "y px", "area"));
  for (std::size_t i = 0; i < setup.candidates.size(); ++i) {
    const camera::Mark& m = setup.candidates[i];
    print(fmt::format("{:>3}  {:<16}{:>9.1f}{:>9.1f}{:>9.0f}\n", i + 1,
                      setup.name[i].empty() ? "-" : setup.name[i], m.centre.x, m.centre.y, m.area_px));
  }
  print(fmt::format("picture  {}\n", request.picture.string()));
  if (!o.save.empty()) {
    print(fmt::format("joints   {}\n", o.save));
  } else {
    print(
        "to keep this for the video: --save JOINTS.json, with --assign NUMBER=MARK for each mark where it is "
        "wrong\n");
  }
}

void run(const Options& o, const Program& program) {
  const filming::Cameras& cameras = program.require_cameras();
  if (o.setup) {
    run_setup(o, cameras);
    return;
  }
  // A camera has no end of its own: Ctrl-C is how its recording is finished.
  std::optional<StopOnSignal> stop;
  if (std::filesystem::is_character_file(o.request.video)) stop.emplace();
  filming::Tracked result;
  {
    ProgressLine line;
    result = cameras.track(o.request, [&](std::size_t frames, std::size_t of) {
      line.step("tracking: frame", frames, of);
      return !stop || !*stop->flag();
    });
  }
  if (!o.request.report.empty()) report::render(o.request.report);
  if (stop && *stop->flag()) result.warnings.emplace_back("interrupted: what was tracked until then is kept");
  for (const std::string& warning : result.warnings) log("warning: " + warning);
  if (o.json) {
    print(io::dump(to_json(result, o.request)));
    return;
  }
  const camera::Summary& s = result.summary;
  print(fmt::format("{} frames, {:.2f} to {:.2f} s; every mark seen in {} of {}; {} missing by the clock\n\n",
                    s.frames, s.from_s, s.to_s, s.labelled, s.frames, s.dropped));
  print(fmt::format("{:<16}{:>10}{:>10}{:>12}{:>8}{:>10}{:>8}{:>7}\n", "angle, deg", "from", "to",
                    "std. error", "good", "doubtful", "hidden", "lost"));
  for (const camera::AngleSummary& a : s.angles) {
    print(fmt::format("{:<16}{:>10.1f}{:>10.1f}{:>12.2f}{:>8}{:>10}{:>8}{:>7}\n", a.name, a.min_deg,
                      a.max_deg, a.mean_se_deg, a.frames[0], a.frames[1], a.frames[2], a.frames[3]));
  }
  print(fmt::format("\n{:.0f} frames a second, decoding left out\nangles   {}\n",
                    static_cast<double>(s.frames) / std::max(1e-9, result.tracking_s),
                    o.request.out.string()));
  if (!o.request.preview.empty()) print(fmt::format("preview  {}\n", o.request.preview.string()));
  if (!o.request.report.empty()) print(fmt::format("report   {}/report.html\n", o.request.report.string()));
}

struct CalibrateOptions {
  std::vector<std::string> pictures;
  std::string board = "9x6";
  std::string out;
  bool json = false;
};

void run_calibrate(const CalibrateOptions& o, const Program& program) {
  const filming::Cameras& cameras = program.require_cameras();
  camera::Board board;
  const auto x = o.board.find('x');
  const char* const end = o.board.data() + o.board.size();
  const bool good =
      x != std::string::npos &&
      std::from_chars(o.board.data(), o.board.data() + x, board.columns).ptr == o.board.data() + x &&
      std::from_chars(o.board.data() + x + 1, end, board.rows).ptr == end;
  if (!good)
    throw io::InputError(
        fmt::format("--board {}: must be COLUMNSxROWS of inner corners, as in 9x6", o.board));
  io::require_writable(o.out);
  log(fmt::format("looking for the board in {} picture(s) ...", o.pictures.size()));
  const camera::Calibration result = cameras.calibrate({o.pictures.begin(), o.pictures.end()}, board);
  io::write_file(o.out, camera::to_json(result.lens));
  for (const std::string& refused : result.refused) log("warning: " + refused);
  if (o.json) {
    nlohmann::ordered_json json = nlohmann::ordered_json::parse(camera::to_json(result.lens));
    json["used"] = result.used;
    json["refused"] = result.refused;
    json["file"] = o.out;
    json["version"] = FLEXOR_VERSION;
    print(io::dump(json));
    return;
  }
  const camera::Lens& l = result.lens;
  print(
      fmt::format("{} of {} pictures; corners within {:.2f} px rms\nfocal length {:.1f} x {:.1f} px, centre "
                  "{:.1f}, {:.1f}, "
                  "k1 {:.4f}, k2 {:.4f}\nlens     {}\n",
                  result.used.size(), o.pictures.size(), l.reprojection_rms_px, l.focal_px.x, l.focal_px.y,
                  l.centre_px.x, l.centre_px.y, l.distortion[0], l.distortion[1], o.out));
}

struct FilmOptions {
  filming::FilmRequest request;
  std::string gestures = "1-6";
  std::string twin;
  std::vector<std::string> set;
  bool json = false;
};

void run_film(FilmOptions& o, const Program& program) {
  const filming::Cameras& cameras = program.require_cameras();
  o.request.parameters = twin_parameters(o.twin, o.set);
  io::require_folder(o.request.folder);
  o.request.motions = study::motions(o.gestures);
  o.request.motions.insert(o.request.motions.begin(), study::calibration_motion());
  std::size_t frames = 0;
  {
    ProgressLine line;
    cameras.film(o.request, [&](std::size_t frame, std::size_t of) {
      frames = frame;
      line.step("filming: frame", frame, of);
      return true;
    });
  }
  if (o.json) {
    const nlohmann::ordered_json json = {{"folder", o.request.folder.string()},
                                         {"frames", frames},
                                         {"seed", o.request.seed},
                                         {"version", FLEXOR_VERSION}};
    print(json.dump(2) + "\n");
    return;
  }
  print(
      fmt::format("glove.csv, video.mp4, truth.csv and joints.json are in {}\n", o.request.folder.string()));
}

}  // namespace

void add_track(CLI::App& app, const Program& program) {
  auto o = std::make_shared<Options>();
  CLI::App* command =
      app.add_subcommand("track", "Angles of a hand from a video or a camera: marks on its joints");
  command->add_option("video", o->request.video, "video file, or a camera: /dev/video0")->required();
  command->add_option("--joints", o->request.joints, "joint file: marks, bones, angles (models/joints)")
      ->required();
  command->add_option("--out", o->request.out, "write the angles here (CSV); with --setup the picture (PNG)")
      ->required();
  command->add_option("--lens", o->request.lens, "lens file of flexor camera calibrate");
  command->add_option("--preview", o->request.preview,
                      "write the video with marks, bones and angles drawn in (.mp4)");
  command->add_option("--report", o->request.report, "write report.html with figures into this folder");
  command->add_option("--seconds", o->request.seconds, "stop after so many; a camera also stops at Ctrl-C");
  auto* setup = command->add_flag("--setup", o->setup,
                                  "no angles: number the marks in one picture, propose their names");
  command->add_option("--at", o->at_s, "the picture at this time, seconds")->needs(setup);
  command->add_option("--skeleton", o->skeleton, "which of the joint file's (default: the first)")
      ->needs(setup);
  command->add_option("--colour", o->colour, "X,Y: learn the colour from this point on a mark")->needs(setup);
  command
      ->add_option("--colour-in", o->colour_in,
                   "LEFT,TOP,WIDTH,HEIGHT: learn it from a rectangle within a mark")
      ->needs(setup);
  command->add_option("--assign", o->assign, "NUMBER=MARK, for each mark: instead of the proposal")
      ->needs(setup);
  command->add_option("--save", o->save, "write a joint file with this colour and these places")
      ->needs(setup);
  command->add_flag("--json", o->json, "one JSON object on standard output");
  command->callback([o, program] { run(*o, program); });
}

void add_camera(CLI::App& app, const Program& program) {
  CLI::App* camera = app.add_subcommand("camera", "Calibrate a lens; film the twin's hand");
  camera->require_subcommand(1);
  auto c = std::make_shared<CalibrateOptions>();
  CLI::App* calibrate = camera->add_subcommand("calibrate", "The lens from pictures of a checkerboard");
  calibrate->add_option("pictures", c->pictures, "five or more, the board tilted in different directions")
      ->required();
  calibrate->add_option("--board", c->board, "inner corners, COLUMNSxROWS")->capture_default_str();
  calibrate->add_option("--out", c->out, "write the lens file here")->required();
  calibrate->add_flag("--json", c->json, "one JSON object on standard output");
  calibrate->callback([c, program] { run_calibrate(*c, program); });

  auto f = std::make_shared<FilmOptions>();
  CLI::App* film = camera->add_subcommand(
      "film", "The twin wears its glove before a camera: a log, a video, and the exact angles");
  film->add_option("--out", f->request.folder, "folder for glove.csv, video.mp4, truth.csv, joints.json")
      ->required();
  film->add_option("--gestures", f->gestures, "what follows the calibration motion, as for flexor experiment")
      ->capture_default_str();
  film->add_option("--rate", f->request.rate_hz, "of the glove's log, Hz")->capture_default_str();
  film->add_option("--seed", f->request.seed, "everything random follows from it")
      ->check(seed_fault)
      ->capture_default_str();
  film->add_option("--twin", f->twin, "configuration of the twin (default: the shipped one)");
  film->add_option("--set", f->set, "change one parameter of the twin; may be repeated");
  film->add_flag("--json", f->json, "one JSON object on standard output");
  film->callback([f, program] { run_film(*f, program); });
}

}  // namespace flexor::cli
