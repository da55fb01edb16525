// Pictures and lenses as OpenCV sees them; for the sources of this room and of its worker only.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "host/camera/colour.hpp"
#include "host/camera/lens.hpp"
#include "host/camera/picture.hpp"

namespace flexor::camera {

// No copy: the picture outlives the matrix. Write only to what belongs to a picture that is not constant.
inline cv::Mat mat(const Picture& picture) {
  return {picture.height, picture.width, CV_8UC3, const_cast<std::uint8_t*>(picture.bgr.data())};
}

inline cv::Rect rect(const Window& w) { return {w.x, w.y, w.width, w.height}; }

inline cv::Matx33d matrix(const Lens& lens) {
  return {lens.focal_px.x, 0, lens.centre_px.x, 0, lens.focal_px.y, lens.centre_px.y, 0, 0, 1};
}

// Of every pixel, in floats.
cv::Mat scores(const cv::Mat& bgr, const ColourModel& colour);
// Of a matrix of floats: those where the mask is not zero, channel beside channel.
std::vector<float> values(const cv::Mat& of, const cv::Mat& mask);
double quantile(std::vector<float> values, double share);  // 0: there are none

}  // namespace flexor::camera
