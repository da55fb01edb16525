// Pictures for this room's tests: discs on a flat background, their centres known.
#pragma once

#include <cmath>
#include <vector>

#include "host/camera/picture.hpp"

namespace flexor::camera {

struct Dot {
  Point at;
  double radius = 10;
  std::array<int, 3> bgr = {50, 150, 40};
};

// Each pixel is the mean of 64 points inside it.
inline Picture dots(int width, int height, std::array<int, 3> background, const std::vector<Dot>& all) {
  Picture out(height, width, CV_8UC3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      std::array<double, 3> colour = {static_cast<double>(background[0]), static_cast<double>(background[1]),
                                      static_cast<double>(background[2])};
      for (const Dot& dot : all) {
        const double distance = std::hypot(x - dot.at.x, y - dot.at.y);
        if (distance > dot.radius + 1) continue;
        int hits = 0;
        for (int j = 0; j < 64; ++j) {
          const double u = x + (j % 8 + 0.5) / 8 - 0.5;
          const double v = y + (j / 8 + 0.5) / 8 - 0.5;
          if (std::hypot(u - dot.at.x, v - dot.at.y) <= dot.radius) ++hits;
        }
        for (std::size_t k = 0; k < 3; ++k) colour[k] += hits / 64.0 * (dot.bgr[k] - colour[k]);
      }
      for (int k = 0; k < 3; ++k)
        out.at<cv::Vec3b>(y, x)[k] =
            static_cast<std::uint8_t>(std::lround(colour[static_cast<std::size_t>(k)]));
    }
  }
  return out;
}

inline constexpr std::array<int, 3> kWall = {150, 148, 146};

}  // namespace flexor::camera
