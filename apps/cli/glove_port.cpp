#include "apps/cli/glove_port.hpp"

#include "apps/cli/commands.hpp"
#include "apps/cli/progress.hpp"
#include "apps/live/bench_source.hpp"
#include "apps/live/camera_source.hpp"
#include "apps/live/twin_source.hpp"
#include "host/deploy/flash.hpp"
#include "host/deploy/pair_key.hpp"
#include "host/listen/replay_source.hpp"
#include "host/recording/recording.hpp"
#include "host/study/published.hpp"

namespace flexor::cli {
namespace {

std::unique_ptr<listen::Listener> open_port(const GlovePort& o) {
  listen::ListenerOptions options = o.listener;
  options.port = deploy::choose_port(options.port);
  if (!o.key.empty()) options.key = deploy::load_key(o.key);
  std::unique_ptr<listen::Listener> listener;
  {
    ProgressLine line;
    listener = std::make_unique<listen::Listener>(options, line.steps(options.port + ": "));
  }
  log(fmt::format("{}: {}", options.port, listener->description()));
  return listener;
}

std::unique_ptr<listen::Source> open_instead(const GlovePort& o) {
  const bool camera = std::filesystem::is_character_file(o.from) || recording::is_video(o.from);
  const bool simulated = o.from == "twin" || o.from == "poses" || o.from == "boards";
  if (o.speed != 1 && (camera || simulated))
    throw io::InputError("--from {}: goes as fast as it goes; --speed is for recordings", o.from);
  if (!camera && !(o.joints.empty() && o.lens.empty()))
    throw io::InputError("--from {}: no camera or video, which --joints and --lens are for", o.from);
  if (o.listener.readings && o.from != "boards")
    throw io::InputError("--from {}: --readings is for a glove with Flexor's firmware, or boards", o.from);
  if (camera && o.joints.empty())
    throw io::InputError("--from {}: a camera needs --joints: a joint file, or {}", o.from,
                         fmt::join(live::joint_files(), ", "));
  if (camera)
    return std::make_unique<live::CameraSource>(o.from, o.joints, o.lens, io::program_beside(kCameraWorker));
  if (o.from == "boards") {  // as `flexor twin wear` has them
    const model::Model model = study::compensator("published-hw", study::kPublishedRate_hz).model;
    return std::make_unique<live::BenchSource>(io::program_beside(kBoardsWorker),
                                               study::BenchOptions{.model = model}, o.listener.readings);
  }
  if (o.from == "twin") return std::make_unique<live::TwinSource>();
  if (o.from == "poses") {
    live::TwinOptions held;
    held.motion = study::bench_motion("held");
    return std::make_unique<live::TwinSource>(std::move(held));
  }
  auto replay = std::make_unique<listen::ReplaySource>(o.from, o.speed, o.time);
  log_warnings(replay->warnings());
  return replay;
}

}  // namespace

void add_options(CLI::App& command, GlovePort& o) {
  auto* port = add_port(command, o.listener.port, " of the glove or of a radio");
  auto* baud = add_positive(command, "--baud", o.listener.baud, "of the port (default: found by listening)");
  command.add_flag("--readings", o.listener.readings,
                   "of a glove with Flexor's firmware: readings of its sensors instead of angles");
  auto* key = command.add_option(
      "--key", o.key,
      "pair.key of the deployment: a glove that is paired with a hand speaks to this program instead");
  auto* from =
      command
          .add_option("--from", o.from,
                      "instead of a port: a recording (CSV), played again at its own speed; a camera "
                      "(/dev/video0) or a video of a hand, with --joints; twin, the simulated glove, which "
                      "tells its readings in counts; poses, the same holding an open hand and a fist; or "
                      "boards, both boards with their firmware, simulated. A file of such a name: ./twin")
          ->excludes(port)
          ->excludes(baud)
          ->excludes(key);
  command
      .add_option("--joints", o.joints, "of a camera: its joint file, or the name of one in models/joints")
      ->needs(from);
  command.add_option("--lens", o.lens, "of a camera: lens file of flexor camera calibrate")->needs(from);
  add_time_options(command, o.time);
}

void add_speed(CLI::App& command, GlovePort& o) {
  add_shown(command, "--speed", o.speed, "of a recording with --from: 2 plays it in half the time")
      ->needs("--from");
}

std::unique_ptr<listen::Source> open_glove(const GlovePort& o) {
  if (o.from.empty()) return open_port(o);
  std::unique_ptr<listen::Source> source = open_instead(o);
  log(source->description());
  return source;
}

Json source_json(const GlovePort& o, const listen::Source& source) {
  const auto* port = dynamic_cast<const listen::Listener*>(&source);
  const bool has_port = port != nullptr && o.from.empty();
  return {{"port", has_port ? Json(o.listener.port) : Json(nullptr)},
          {"format", has_port ? Json(listen::name_of(port->format())) : Json(nullptr)},
          {"baud", has_port ? Json(port->baud()) : Json(nullptr)},
          {"source", o.from.empty() ? Json(nullptr) : Json(io::to_utf8(source.description()))}};
}

}  // namespace flexor::cli
