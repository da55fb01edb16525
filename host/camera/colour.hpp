// The colour of marks, as a direction in which they differ from everything around them.
//
//   score(pixel) = weight . (B, G, R),   |weight| = 1,  sum of weights 0,   in grey levels
// A pixel half covered by a mark scores half way between the mark and what is around it, whatever the blur:
// that is what makes centres exact to a fraction of a pixel. Everything grey scores 0, black, white or in
// shadow. Among such weights it is Fisher's linear discriminant, (S_mark + S_background)^-1 (mean_mark -
// mean_background): it ignores the direction in which skin and wall differ from each other. Source: R. A.
// Fisher, Annals of Eugenics 7 (1936) 179-188.
#pragma once

#include <array>
#include <vector>

#include "host/camera/picture.hpp"

namespace flexor::camera {

struct ColourModel {
  std::array<double, 3> weight{};  // blue, green, red
  double level = 0;                // a mark's score above its surroundings, grey levels
  double background = 0;           // score that 99.5 % of the other pixels stay below
  double area_px = 0;              // of a typical mark; 0: not known
};

// Of every pixel, in floats.
cv::Mat scores(const cv::Mat& bgr, const ColourModel& colour);
// Those where the mask is not zero.
std::vector<float> values(const cv::Mat& score, const cv::Mat& mask);
double quantile(std::vector<float> values, double share);  // 0: there are none

// From a click on a mark: the pixels around `at` that look alike are the mark.
// Throws io::InputError: outside the picture, or nothing that differs from its surroundings.
ColourModel colour_at(const Picture& picture, Point at);

// From a colour that was given: the blobs nearest to it. Throws io::InputError when there are none.
ColourModel colour_like(const Picture& picture, const std::array<double, 3>& rgb);

// On its own: the hue of which there are `marks` compact blobs of similar size and the fewest other things.
// Throws io::JobError, with the reason, when no hue has them.
ColourModel colour_automatic(const Picture& picture, const Window& region, std::size_t marks);

}  // namespace flexor::camera
