#include <algorithm>
#include <charconv>
#include <set>

#include "apps/cli/commands.hpp"
#include "apps/cli/progress.hpp"
#include "host/io/folder_lock.hpp"
#include "host/io/interrupt.hpp"
#include "host/report/page.hpp"
#include "host/report/render.hpp"
#include "host/study/builtin.hpp"
#include "host/study/catalogue.hpp"
#include "host/twin/exact_json.hpp"

namespace flexor::cli {

namespace track_command {

struct Options {
  TrackOptions track;
  bool setup = false;
  double at_s = 0;
  std::string skeleton;
  std::vector<double> colour;
  std::vector<std::string> assign;
  std::string save;
};

Json assignments_of(const std::vector<std::string>& assignments) {
  std::set<int> taken;
  Json out = Json::array();
  for (const std::string& text : assignments) {
    const auto equals = text.find('=');
    int number = 0;
    const char* const end = text.data() + std::min(equals, text.size());
    if (equals == std::string::npos || std::from_chars(text.data(), end, number).ptr != end || equals == 0)
      throw io::InputError("--assign {}: must be NUMBER=MARK, as in 3=index_tip", text);
    if (!taken.insert(number).second)
      throw io::InputError("--assign: candidate {} is given two names", number);
    out.push_back({{"number", number}, {"mark", io::bytes_to_json(text.substr(equals + 1))}});
  }
  return out;
}

Json bytes(const std::filesystem::path& path) { return io::bytes_to_json(path.string()); }

Json setup_arguments(const Options& o) {
  Json out = {{"video", bytes(o.track.video)},
              {"joints", bytes(o.track.joints)},
              {"at_s", o.at_s},
              {"skeleton", io::bytes_to_json(o.skeleton)},
              {"assigned", assignments_of(o.assign)},
              {"picture", bytes(o.track.out)},
              {"save", bytes(o.save)}};
  if (!o.colour.empty()) out["colour_at_px"] = o.colour;
  return out;
}

Output run_setup(const Options& o, io::Worker& camera) {
  const Json setup = camera.run("propose_marks", setup_arguments(o));
  const auto trouble = setup.at("trouble").get<std::string>();
  report::Page table("");
  table.table(report::table_of("", setup.at("candidates"),
                               {{"", "/number"},
                                {o.assign.empty() ? "proposed" : "assigned", "/mark"},
                                {"x px", "/x_px", "{:.1f}"},
                                {"y px", "/y_px", "{:.1f}"},
                                {"area", "/area_px", "{:.0f}"}}));
  std::string text = table.text();
  text += fmt::format("picture  {}\n", o.track.out.string());
  text += !o.save.empty() ? fmt::format("joints   {}\n", o.save)
                          : "to keep this for the video: --save JOINTS.json, with --assign NUMBER=MARK for "
                            "each mark where it is wrong\n";
  return {setup, text, trouble.empty() ? std::vector<std::string>() : std::vector{trouble}};
}

Output run(const Options& o) {
  io::Worker camera(io::program_beside(kCameraWorker));
  if (o.setup) return run_setup(o, camera);
  // A camera has no end of its own: Ctrl-C is how its recording is finished.
  std::optional<io::StopOnSignal> stop;
  std::optional<io::FolderLock> lock;
  const std::vector<std::string_view> written = {"angles.csv", "frame.jpg"};
  if (!o.track.report.empty()) lock.emplace(o.track.report, "tracking", written);
  if (std::filesystem::is_character_file(o.track.video)) stop.emplace();
  Json result = track_video(camera, o.track, [&] { return !stop || !*stop->flag(); });
  if (!o.track.report.empty()) report::render(o.track.report);
  if (stop && *stop->flag())
    result.at("warnings").push_back("interrupted: what was tracked until then is kept");
  log_warnings(result.at("warnings"));
  return {result, report::summary("tracking", result) + line_of("angles", o.track.out) +
                      line_of("preview", o.track.preview) +
                      line_of("report", o.track.report, "/report.html")};
}

struct CalibrateOptions {
  std::vector<std::string> pictures;
  std::string board = "9x6";
  std::string out;
};

Output run_calibrate(const CalibrateOptions& o) {
  Json pictures = Json::array();
  for (const std::string& picture : o.pictures) pictures.push_back(io::bytes_to_json(picture));
  io::Worker camera(io::program_beside(kCameraWorker));
  const Json lens = camera.run("fit_lens",
                               {{"pictures", std::move(pictures)},
                                {"board", io::bytes_to_json(o.board)},
                                {"out", io::bytes_to_json(o.out)}},
                               [](const io::Progress& p) {
                                 log(fmt::format("looking for the board in {} picture(s) ...", p.of));
                                 return true;
                               });
  log_warnings(lens.at("refused"));
  const auto number = [&](const char* key, std::size_t i) { return lens.at(key).at(i).get<double>(); };
  return {lens,
          fmt::format("{} of {} pictures; corners within {:.2f} px rms\nfocal length {:.1f} x {:.1f} px, "
                      "centre {:.1f}, {:.1f}, k1 {:.4f}, k2 {:.4f}\nlens     {}\n",
                      lens.at("used").size(), o.pictures.size(), lens.at("reprojection_rms_px").get<double>(),
                      number("focal_px", 0), number("focal_px", 1), number("centre_px", 0),
                      number("centre_px", 1), number("distortion", 0), number("distortion", 1), o.out)};
}

struct FilmOptions {
  std::string folder;
  double rate_hz = 50;
  std::uint64_t seed = 1;
  std::string gestures = "1-6";
  TwinFiles twin;
};

Output run_film(const FilmOptions& o) {
  const twin::Parameters parameters = twin_parameters(o.twin);
  std::vector<twin::Motion> motions = study::motions(o.gestures);
  motions.insert(motions.begin(), study::short_motion());
  const model::Model raw = study::compensator("raw", o.rate_hz).model;
  Json inputs = Json::array();
  for (const twin::Motion& motion : motions)
    inputs.push_back(twin::TrialInput{parameters, motion, raw, o.seed, true});
  io::Worker camera(io::program_beside(kCameraWorker));
  Json result;
  {
    ProgressLine line;
    result = camera.run("film",
                        {{"inputs", std::move(inputs)},
                         {"joints", Json::parse(study::builtin("joints/paper_hand.json"))},
                         {"seed", o.seed},
                         {"folder", io::bytes_to_json(o.folder)}},
                        [&](const io::Progress& p) {
                          line.step("filming: frame", p.done, p.of);
                          return true;
                        });
  }
  return {result, fmt::format("glove.csv, video.mp4, truth.csv and joints.json are in {}\n", o.folder)};
}

}  // namespace track_command

Json track_video(io::Worker& camera, const TrackOptions& o, const std::function<bool()>& goes_on) {
  using namespace track_command;
  ProgressLine line;
  return camera.run("track",
                    {{"video", bytes(o.video)},
                     {"joints", bytes(o.joints)},
                     {"lens", bytes(o.lens)},
                     {"out", bytes(o.out)},
                     {"preview", bytes(o.preview)},
                     {"report", bytes(o.report)},
                     {"seconds", o.seconds}},
                    [&](const io::Progress& p) {
                      line.step("tracking: frame", p.done, p.of);
                      return goes_on();
                    });
}

void track_command::add(CLI::App& app) {
  const auto [o, command] =
      add_command(app, "track", "Angles of a hand from a video or a camera: marks on its joints", run);
  command->add_option("video", o->track.video, "video file, or a camera: /dev/video0")->required();
  command->add_option("--joints", o->track.joints, "joint file: marks, bones, angles (models/joints)")
      ->required();
  command->add_option("--out", o->track.out, "write the angles here (CSV); with --setup the picture (PNG)")
      ->required();
  command->add_option("--lens", o->track.lens, "lens file of flexor camera calibrate");
  command->add_option("--preview", o->track.preview,
                      "write the video with marks, bones and angles drawn in (.mp4)");
  add_folder(*command, "--report", o->track.report, "write report.html with figures into this folder");
  command->add_option("--seconds", o->track.seconds, "stop after so many; a camera also stops at Ctrl-C");
  auto* setup = command->add_flag("--setup", o->setup,
                                  "no angles: number the marks in one picture, propose their names");
  command->add_option("--at", o->at_s, "the picture at this time, seconds")->needs(setup);
  command->add_option("--skeleton", o->skeleton, "which of the joint file's (default: the first)")
      ->needs(setup);
  command->add_option("--colour", o->colour, "X,Y: learn the colour from this point on a mark")
      ->delimiter(',')
      ->expected(2)
      ->needs(setup);
  command->add_option("--assign", o->assign, "NUMBER=MARK, for each mark: instead of the proposal")
      ->needs(setup);
  command->add_option("--save", o->save, "write a joint file with this colour and these places")
      ->needs(setup);
}

void camera_command::add(CLI::App& app) {
  using namespace track_command;
  CLI::App* camera = app.add_subcommand("camera", "Calibrate a lens; film the twin's hand");
  camera->require_subcommand(1);
  const auto [c, calibrate] =
      add_command(*camera, "calibrate", "The lens from pictures of a checkerboard", run_calibrate);
  calibrate->add_option("pictures", c->pictures, "five or more, the board tilted in different directions")
      ->required();
  add_shown(*calibrate, "--board", c->board, "inner corners, COLUMNSxROWS");
  calibrate->add_option("--out", c->out, "write the lens file here")->required();

  const auto [f, film] =
      add_command(*camera, "film",
                  "The twin wears its glove before a camera: a log, a video, and the exact angles", run_film);
  film->add_option("--out", f->folder, "folder for glove.csv, video.mp4, truth.csv, joints.json")->required();
  add_shown(*film, "--gestures", f->gestures,
            "what follows the calibration motion, as for flexor experiment");
  add_shown(*film, "--rate", f->rate_hz, "of the glove's log, Hz");
  add_seed(*film, f->seed);
  add_twin_options(*film, f->twin);
}

}  // namespace flexor::cli
