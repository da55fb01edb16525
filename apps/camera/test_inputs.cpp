// Makes small inputs for the tests that run every command: test_inputs FOLDER -> video.mp4 with joints.json,
// board0.png to board5.png. test_inputs VIDEO OUT.mjpeg makes of a film what a browser takes in place of a camera.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "apps/camera/film.hpp"
#include "host/camera/jpeg.hpp"
#include "host/camera/video.hpp"
#include "host/io/io.hpp"
#include "host/io/output.hpp"
#include "host/twin/hand_view.hpp"

namespace {

using flexor::camera::Picture;
namespace fs = std::filesystem;

constexpr int kFrames = 20;

void film(const fs::path& folder) {
  using flexor::filming::HandFilm;
  HandFilm hand(1);
  flexor::camera::VideoWriter video(folder / "video.mp4", HandFilm::kWidth, HandFilm::kHeight, 30);
  for (int k = 0; k < kFrames; ++k) {
    flexor::twin::PerFinger mcp_deg{};
    mcp_deg.fill(10 + k);
    mcp_deg[0] = 100 + k;
    video.add(hand.shoot(mcp_deg, static_cast<std::uint64_t>(k), flexor::twin::kGreen));
  }
  video.finish();
  flexor::io::write_file(folder / "joints.json",
                         flexor::camera::to_json(flexor::filming::drawn_hand(flexor::camera::load_joints(
                             FLEXOR_SOURCE_DIR "/models/joints/paper_hand.json"))));
}

// A board of 10 x 7 squares, turned about both axes, seen by a pinhole of 600 pixels; each pixel is the mean
// of nine points.
Picture board(double about_x_rad, double about_y_rad) {
  constexpr int kWidth = 640;
  constexpr int kHeight = 480;
  constexpr double kFocal_px = 600;
  constexpr double kDistance = 14;  // in squares
  const double cx = std::cos(about_x_rad);
  const double sx = std::sin(about_x_rad);
  const double cy = std::cos(about_y_rad);
  const double sy = std::sin(about_y_rad);
  const auto white = [&](double u, double v) {
    const double a = (u - kWidth / 2.0) / kFocal_px;
    const double b = (v - kHeight / 2.0) / kFocal_px;
    // Plane through (0, 0, distance) with the axes (cy, 0, -sy) and (sx sy, cx, sx cy).
    const double depth = cx * cy * kDistance / (cx * sy * a - sx * b + cx * cy);
    const double x = cy * depth * a - sy * (depth - kDistance);
    const double y = sx * sy * depth * a + cx * depth * b + sx * cy * (depth - kDistance);
    if (std::abs(x) > 5 || std::abs(y) > 3.5) return true;
    return (static_cast<int>(std::floor(x + 5)) + static_cast<int>(std::floor(y + 3.5))) % 2 == 0;
  };
  Picture out(kWidth, kHeight);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      int light = 0;
      for (int i = 0; i < 9; ++i) light += white(u + (i % 3 - 1) / 3.0, v + (i / 3 - 1) / 3.0) ? 25 : 3;
      for (std::size_t k = 0; k < 3; ++k) {
        out.bgr[3 * static_cast<std::size_t>(v * kWidth + u) + k] = static_cast<std::uint8_t>(light);
      }
    }
  }
  return out;
}

void to_mjpeg(const fs::path& video, const fs::path& out) {
  flexor::camera::VideoReader film(video);
  flexor::io::Output mjpeg(out);
  Picture picture;
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
  constexpr double kTilts_rad[6][2] = {{0, 0.4},    {0.4, 0},     {-0.4, 0.2},
                                       {0.3, -0.4}, {-0.3, -0.3}, {0.4, 0.4}};
  for (int i = 0; i < 6; ++i) {
    flexor::camera::write_picture(folder / fmt::format("board{}.png", i),
                                  board(kTilts_rad[i][0], kTilts_rad[i][1]));
  }
}
