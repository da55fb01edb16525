// One picture: eight bits each of blue, green and red, CV_8UC3. As OpenCV's matrices are, a copy is the same pixels.
//
// Pixel (0, 0) is the top left one and its centre is the point (0, 0): x grows to the right, y downwards. All
// coordinates of this room are such pixels.
#pragma once

#include <array>
#include <opencv2/core.hpp>

namespace flexor::camera {

using Picture = cv::Mat;
using Point = cv::Point2d;
using Window = cv::Rect;

// Covariance of a point: xx, xy, yy, px^2.
using Covariance = std::array<double, 3>;

}  // namespace flexor::camera
