// flexor-camera: everything that needs OpenCV, as a worker (host/io/worker.hpp).

#include <sys/resource.h>

#include <charconv>
#include <thread>

#include "apps/camera/cameras.hpp"
#include "apps/camera/film.hpp"
#include "apps/camera/live_jobs.hpp"
#include "host/io/worker.hpp"
#include "host/twin/exact_json.hpp"

namespace {

using namespace flexor;

camera::Joints joints_of(const Json& arguments) {
  return filming::drawn_hand(camera::joints_from_json(arguments.at("joints").dump(), "joints"));
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

Json track(const Json& arguments, const io::JobProgress& progress) {
  const auto request = arguments.get<filming::TrackRequest>();
  return filming::to_json(filming::track(request, progress), request);
}

Json propose_marks(const Json& arguments, const io::JobProgress&) {
  filming::MarkProposalRequest request;
  arguments.at("video").get_to(request.video);
  arguments.at("joints").get_to(request.joints);
  arguments.at("at_s").get_to(request.at_s);
  request.skeleton = io::bytes_from_json(arguments.at("skeleton"));
  if (arguments.contains("colour_at_px")) {
    const auto [x, y] = arguments.at("colour_at_px").get<std::array<double, 2>>();
    request.mark = camera::Point{x, y};
  }
  for (const Json& pair : arguments.at("assigned"))
    request.assigned.emplace(pair.at("number").get<int>(), io::bytes_from_json(pair.at("mark")));
  arguments.at("picture").get_to(request.picture);
  arguments.at("save").get_to(request.save);
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
  if (!good) throw io::InputError("--board {}: must be COLUMNSxROWS of inner corners, as in 9x6", text);
  return board;
}

Json fit_lens(const Json& arguments, const io::JobProgress& progress) {
  const filming::LensFitRequest request = {arguments.at("pictures").get<std::vector<std::filesystem::path>>(),
                                           board_of(io::bytes_from_json(arguments.at("board"))),
                                           arguments.at("out").get<std::filesystem::path>()};
  progress(0, request.pictures.size());
  return filming::to_json(filming::fit_lens(request), request);
}

Json film(const Json& arguments, const io::JobProgress& progress) {
  const filming::FilmRequest request = {arguments.at("inputs").get<std::vector<twin::TrialInput>>(),
                                        joints_of(arguments), arguments.at("seed").get<std::uint64_t>(),
                                        arguments.at("folder").get<std::filesystem::path>()};
  return {{"folder", request.folder.string()},
          {"frames", filming::film(request, progress)},
          {"seed", request.seed},
          {"version", FLEXOR_VERSION}};
}

// Exact angles in, tracked angles out.
Json see(const Json& arguments, const io::JobProgress&) {
  filming::Sight exact{arguments.at("glove_deg").get<filming::FingerAngles>(),
                       arguments.at("hand_deg").get<filming::FingerAngles>()};
  const filming::Sight seen =
      filming::see(joints_of(arguments), std::move(exact), arguments.at("rate_hz").get<double>(),
                   arguments.at("seed").get<std::uint64_t>());
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
