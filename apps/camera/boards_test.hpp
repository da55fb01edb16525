// For tests only: pictures of a checkerboard from which a lens is calibrated, as the twin's camera takes them.
#pragma once

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <vector>

#include "apps/camera/picture.hpp"
#include "host/camera/video.hpp"

namespace flexor::filming {

// board0.png to board8.png.
inline std::vector<std::filesystem::path> board_pictures(const View& bent,
                                                         const std::filesystem::path& folder) {
  Pattern board;
  board.columns = 10;
  board.rows = 7;
  board.cell_mm = 22;
  for (int i = 0; i < 70; ++i) board.cells.push_back((i / 10 + i % 10) % 2 == 0 ? 1 : 0);
  Look look;
  look.background = {235, 235, 235};
  look.noise = 2;
  std::vector<std::filesystem::path> pictures;
  const std::array<std::array<double, 5>, 9> poses = {{{0, 0, 430, 0, 0},
                                                       {30, 0, 460, -20, 0},
                                                       {-30, 5, 460, 20, 10},
                                                       {0, 30, 450, 0, -15},
                                                       {5, -30, 450, 0, 15},
                                                       {20, 20, 520, -60, -25},
                                                       {-20, -25, 520, 60, 25},
                                                       {25, -15, 500, 50, -25},
                                                       {-25, 15, 500, -50, 25}}};
  for (const auto& [turn, tilt, distance, x, y] : poses) {
    View v = bent;
    v.turn_deg = turn;
    v.tilt_deg = tilt;
    v.distance_mm = distance;
    Scene scene;
    board.centre = {x, y};
    scene.prints.push_back(board);
    const std::size_t number = pictures.size();
    pictures.push_back(folder / fmt::format("board{}.png", number));
    camera::write_picture(pictures.back(), Renderer(v, look, number).draw(scene, 0));
  }
  return pictures;
}

}  // namespace flexor::filming
