// Pictures as OpenCV sees them; and lenses; for the sources of this room and of its worker only.
#pragma once

#include <opencv2/core.hpp>

#include "host/camera/lens.hpp"
#include "host/camera/picture.hpp"

namespace flexor::camera {

// No copy: the picture outlives the matrix. Write only to what belongs to a picture that is not constant.
inline cv::Mat mat(const Picture& picture) {
  return {picture.height, picture.width, CV_8UC3, const_cast<std::uint8_t*>(picture.bgr.data())};
}

inline cv::Matx33d matrix(const Lens& lens) {
  return {lens.focal_px.x, 0, lens.centre_px.x, 0, lens.focal_px.y, lens.centre_px.y, 0, 0, 1};
}

}  // namespace flexor::camera
