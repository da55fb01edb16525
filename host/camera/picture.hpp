// One picture: eight bits each of blue, green and red, row after row, without padding.
//
// Pixel (0, 0) is the top left one and its centre is the point (0, 0): x grows to the right, y downwards. All
// coordinates of this room are such pixels.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace flexor::camera {

using Point = cv::Point2d;
using Window = cv::Rect;

struct Picture {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> bgr;  // 3 * width * height

  Picture() = default;
  Picture(int w, int h)
      : width(w), height(h), bgr(3 * static_cast<std::size_t>(w) * static_cast<std::size_t>(h)) {}
  bool empty() const { return bgr.empty(); }
  const std::uint8_t* at(int x, int y) const {
    return &bgr[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                     static_cast<std::size_t>(x))];
  }
};

// Covariance of a point: xx, xy, yy, px^2.
using Covariance = std::array<double, 3>;

// No copy: the picture outlives the matrix. Write only to what belongs to a picture that is not constant.
inline cv::Mat mat(const Picture& picture) {
  return {picture.height, picture.width, CV_8UC3, const_cast<std::uint8_t*>(picture.bgr.data())};
}

}  // namespace flexor::camera
