// Makes small inputs for the tests that run every command: test_inputs FOLDER -> video.mp4 with joints.json,
// board0.png to board8.png. test_inputs VIDEO OUT.mjpeg makes of a film what a browser takes in place of a camera.
#include <filesystem>

#include "apps/camera/boards_test.hpp"
#include "apps/camera/film.hpp"
#include "apps/camera/pinch_test.hpp"
#include "host/camera/jpeg.hpp"
#include "host/camera/video.hpp"
#include "host/io/io.hpp"
#include "host/io/output.hpp"

namespace {

namespace fs = std::filesystem;

constexpr int kFrames = 20;

void film(const fs::path& folder) {
  using namespace flexor::filming;
  Renderer hand = hand_camera(1);
  flexor::camera::VideoWriter video(folder / "video.mp4", kFilmWidth, kFilmHeight, 30);
  for (int k = 0; k < kFrames; ++k) {
    flexor::twin::PerFinger mcp_deg{};
    mcp_deg.fill(10 + k);
    mcp_deg[0] = 100 + k;
    video.add(hand.draw(hand_scene(mcp_deg), static_cast<std::uint64_t>(k)));
  }
  video.finish();
  flexor::io::write_file(folder / "joints.json",
                         flexor::camera::to_json(flexor::filming::drawn_hand(flexor::camera::load_joints(
                             FLEXOR_SOURCE_DIR "/models/joints/paper_hand.json"))));
}

void to_mjpeg(const fs::path& video, const fs::path& out) {
  flexor::camera::VideoReader film(video);
  flexor::io::Output mjpeg(out);
  flexor::camera::Picture picture;
  for (double t_s = 0; film.next(picture, t_s);) mjpeg.write(flexor::camera::to_jpeg(picture));
  mjpeg.commit();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 3) {
    to_mjpeg(argv[1], argv[2]);
    return 0;
  }
  if (argc != 2) {
    fmt::print(stderr, "usage: test_inputs FOLDER, or test_inputs VIDEO OUT.mjpeg\n");
    return 2;
  }
  const fs::path folder = argv[1];
  film(folder);
  flexor::filming::board_pictures(flexor::filming::pinch_view(), folder);
}
