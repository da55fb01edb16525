// Pictures as OpenCV sees them; for the sources of this room only.
#pragma once

#include <opencv2/core.hpp>

#include "host/camera/picture.hpp"

namespace flexor::camera {

// No copy: the picture outlives the matrix. Write only to what belongs to a picture that is not constant.
inline cv::Mat mat(const Picture& picture) {
  return {picture.height, picture.width, CV_8UC3, const_cast<std::uint8_t*>(picture.bgr.data())};
}

}  // namespace flexor::camera
