// flexor-camera: everything that needs OpenCV, as a worker (host/io/worker.hpp).
#include <fmt/format.h>

#include <sys/resource.h>

#include <charconv>
#include <thread>

#include "apps/camera/cameras.hpp"
#include "apps/camera/film.hpp"
#include "apps/camera/live_jobs.hpp"
#include "host/io/json.hpp"
#include "host/io/worker.hpp"
#include "host/twin/exact_json.hpp"

namespace {

using namespace flexor;
using Json = nlohmann::ordered_json;

// A file name; empty: none.
std::filesystem::path path_of(io::JsonReader& arguments, const char* key) {
  return io::bytes_from_json(arguments.member(key));
}

camera::Joints joints_of(io::JsonReader& arguments) {
  return filming::drawn_hand(camera::joints_from_json(arguments.member("joints").dump(), "joints"));
}

// A picture or a video may state any size, and its decoder asks nobody: memory that it does not get is the video's end. Each
// core's threads have their stacks beside.
void bound_memory() {
  constexpr rlim_t kMostBytes = 1100 << 20;
  constexpr rlim_t kStacks = 24 << 20;
  const rlim_t bytes = kMostBytes + kStacks * std::thread::hardware_concurrency();
  const rlimit most{bytes, bytes};
  setrlimit(RLIMIT_DATA, &most);
}

Json track(const Json& json, const io::JobProgress& progress) {
  io::JsonReader arguments(json, "track");
  filming::TrackRequest request;
  request.video = path_of(arguments, "video");
  request.joints = path_of(arguments, "joints");
  request.lens = path_of(arguments, "lens");
  request.out = path_of(arguments, "out");
  request.preview = path_of(arguments, "preview");
  request.report = path_of(arguments, "report");
  request.seconds = arguments.number("seconds");
  arguments.done();
  return filming::to_json(filming::track(request, progress), request);
}

Json propose_marks(const Json& json, const io::JobProgress&) {
  io::JsonReader arguments(json, "propose_marks");
  filming::MarkProposalRequest request;
  request.video = path_of(arguments, "video");
  request.joints = path_of(arguments, "joints");
  request.at_s = arguments.number("at_s");
  request.skeleton = io::bytes_from_json(arguments.member("skeleton"));
  if (arguments.has("colour_at_px")) {
    const std::vector<double> v = arguments.numbers("colour_at_px");
    if (v.size() != 2) arguments.fail("\"colour_at_px\" must be x and y");
    request.mark = camera::Point{v[0], v[1]};
  }
  for (const Json& pair : arguments.member("assigned")) {
    request.assigned.emplace(pair.at("number").get<int>(), io::bytes_from_json(pair.at("mark")));
  }
  request.picture = path_of(arguments, "picture");
  request.save = path_of(arguments, "save");
  arguments.done();
  return filming::to_json(filming::propose_marks(request), request);
}

// "9x6".
camera::Board board_of(const std::string& text) {
  camera::Board board;
  const auto x = text.find('x');
  const char* const end = text.data() + text.size();
  const bool good = x != std::string::npos &&
                    std::from_chars(text.data(), text.data() + x, board.columns).ptr == text.data() + x &&
                    std::from_chars(text.data() + x + 1, end, board.rows).ptr == end;
  if (!good)
    throw io::InputError(fmt::format("--board {}: must be COLUMNSxROWS of inner corners, as in 9x6", text));
  return board;
}

Json fit_lens(const Json& json, const io::JobProgress& progress) {
  io::JsonReader arguments(json, "fit_lens");
  filming::LensFitRequest request;
  request.board = board_of(io::bytes_from_json(arguments.member("board")));
  for (const Json& picture : arguments.member("pictures"))
    request.pictures.emplace_back(io::bytes_from_json(picture));
  request.out = path_of(arguments, "out");
  arguments.done();
  progress(0, request.pictures.size());
  return filming::to_json(filming::fit_lens(request), request);
}

Json film(const Json& json, const io::JobProgress& progress) {
  io::JsonReader arguments(json, "film");
  filming::FilmRequest request;
  for (const Json& input : arguments.list("inputs")) request.inputs.push_back(input.get<twin::TrialInput>());
  request.joints = joints_of(arguments);
  request.seed = arguments.member("seed").get<std::uint64_t>();
  request.folder = path_of(arguments, "folder");
  arguments.done();
  return {{"folder", request.folder.string()},
          {"frames", filming::film(request, progress)},
          {"seed", request.seed},
          {"version", FLEXOR_VERSION}};
}

// Exact angles in, tracked angles out.
Json see(const Json& json, const io::JobProgress&) {
  io::JsonReader arguments(json, "see");
  filming::Sight exact{arguments.member("glove_deg").get<filming::FingerAngles>(),
                       arguments.member("hand_deg").get<filming::FingerAngles>()};
  const filming::Sight seen =
      filming::see(joints_of(arguments), std::move(exact), arguments.number("rate_hz"),
                   arguments.member("seed").get<std::uint64_t>());
  arguments.done();
  return {{"glove_deg", seen.glove_deg}, {"hand_deg", seen.hand_deg}};
}

}  // namespace

int main(int argc, char** argv) {
  bound_memory();
  filming::LiveJobs live;
  std::map<std::string, io::Job> jobs = live.jobs();
  jobs.insert({{"track", track},
               {"propose_marks", propose_marks},
               {"fit_lens", fit_lens},
               {"film", film},
               {"see", see}});
  return io::serve(argc, argv, "flexor-camera: tracks hands in videos", jobs);
}
