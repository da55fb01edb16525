#include "host/camera/colour.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "host/io/io.hpp"

namespace flexor::camera {
namespace {

constexpr double kMinContrast = 12;     // grey levels; below it noise makes marks
constexpr double kMinChroma = 14;       // of CIE Lab
constexpr double kMinBlobShare = 3e-5;  // of the picture
constexpr double kMaxBlobShare = 8e-3;
constexpr double kMinFill = 0.4;  // of the bounding box
constexpr double kMaxAspect = 3.5;
constexpr int kHues = 36;
constexpr double kHueWidth_deg = 25;

cv::Mat lab(const Picture& picture) {
  cv::Mat out;
  cv::cvtColor(picture, out, cv::COLOR_BGR2Lab);
  return out;
}

struct Statistics {
  cv::Vec3d mean;
  cv::Matx33d covariance;
  std::size_t count = 0;
};

// Pixel by pixel: of a large picture no copy fits beside the rest.
Statistics statistics(const cv::Mat& bgr, const cv::Mat& mask) {
  Statistics s;
  cv::Matx33d squares;
  for (int y = 0; y < bgr.rows; ++y) {
    for (int x = 0; x < bgr.cols; ++x) {
      if (mask.at<std::uint8_t>(y, x) == 0) continue;
      const cv::Vec3d v = bgr.at<cv::Vec3b>(y, x);
      s.mean += v;
      squares += v * v.t();
      ++s.count;
    }
  }
  if (s.count == 0) return s;
  s.mean /= static_cast<double>(s.count);
  s.covariance = squares * (1.0 / static_cast<double>(s.count)) - s.mean * s.mean.t();
  return s;
}

cv::Mat grown(const cv::Mat& mask, int by_px) {
  cv::Mat out;
  cv::dilate(mask, out, cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * by_px + 1, 2 * by_px + 1}));
  return out;
}

// Of both together, as if either had half of the pixels.
Statistics even(const Statistics& a, const Statistics& b) {
  const cv::Vec3d between = a.mean - b.mean;
  return {(a.mean + b.mean) / 2, (a.covariance + b.covariance) * 0.5 + between * between.t() * 0.25,
          a.count + b.count};
}

// Fisher's discriminant of the pixels of `marks` against all others, of which those around the marks count as much as the
// many more that are farther away: a mark is distinguished from the skin that it lies on, not from the wall.
ColourModel learn(const cv::Mat& bgr, const cv::Mat& marks) {
  constexpr int kRim_px = 4;
  constexpr int kAround_px = 10;
  const cv::Mat near = grown(marks, kRim_px);
  const cv::Mat others = ~near;
  const Statistics m = statistics(bgr, marks);
  const Statistics far = statistics(bgr, others);
  const Statistics close = statistics(bgr, grown(marks, kAround_px) & others);
  const Statistics b = close.count > 0 ? even(close, far) : far;
  if (m.count < 4 || b.count < 16) {
    throw io::InputError("the mark fills the picture: there is nothing beside it to distinguish it from");
  }
  // The regularisation is sensor noise of two grey levels: a weight that needs less of it would trust noise.
  const cv::Matx33d within = m.covariance + b.covariance + 4 * cv::Matx33d::eye();
  // Basis of the plane of weights that sum to zero.
  const cv::Matx<double, 3, 2> plane(1, 1, -1, 1, 0, -2);
  const cv::Matx22d seen = plane.t() * within * plane;
  cv::Vec3d w = plane * seen.solve(plane.t() * (m.mean - b.mean), cv::DECOMP_CHOLESKY);
  if (!(cv::norm(w) > 0)) throw io::InputError("the mark has the colour of what is around it");
  w /= cv::norm(w);
  ColourModel out;
  out.weight = {w[0], w[1], w[2]};
  const cv::Mat score = scores(bgr, out);
  out.background = quantile(values(score, others), 0.995);
  out.level = quantile(values(score, marks), 0.5) - quantile(values(score, others), 0.5);
  if (out.level < kMinContrast) {
    throw io::InputError(
        "the mark stands out by only {:.0f} grey levels; use a brighter colour or more light", out.level);
  }
  return out;
}

struct Blob {
  int label = 0;
  double area = 0;
};

struct Blobs {
  cv::Mat labels;
  std::vector<Blob> compact;  // of a mark's size, largest first
  double other_px = 0;        // in things that are no blobs
};

Blobs find_blobs(const cv::Mat& mask) {
  Blobs out;
  cv::Mat stats;
  cv::Mat centres;
  const int n = cv::connectedComponentsWithStats(mask, out.labels, stats, centres, 8, CV_32S);
  const double pixels = static_cast<double>(mask.rows) * mask.cols;
  for (int i = 1; i < n; ++i) {
    const double area = stats.at<int>(i, cv::CC_STAT_AREA);
    const double width = stats.at<int>(i, cv::CC_STAT_WIDTH);
    const double height = stats.at<int>(i, cv::CC_STAT_HEIGHT);
    if (area < std::max(6.0, kMinBlobShare * pixels)) continue;
    const bool compact = area <= kMaxBlobShare * pixels && area >= kMinFill * width * height &&
                         std::max(width, height) <= kMaxAspect * std::min(width, height);
    if (compact) {
      out.compact.push_back({i, area});
    } else {
      out.other_px += area;
    }
  }
  std::ranges::stable_sort(out.compact, std::greater<>(), &Blob::area);
  return out;
}

// The cores of the `count` largest blobs.
cv::Mat cores(const Blobs& blobs, std::size_t count) {
  cv::Mat out = cv::Mat::zeros(blobs.labels.size(), CV_8U);
  for (std::size_t i = 0; i < std::min(count, blobs.compact.size()); ++i)
    out |= blobs.labels == blobs.compact[i].label;
  cv::Mat eroded;
  cv::erode(out, eroded, cv::Mat::ones(3, 3, CV_8U));
  return cv::countNonZero(eroded) > 20 ? eroded : out;
}

double typical_area(const Blobs& blobs, std::size_t count) {
  const std::size_t n = std::min(count, blobs.compact.size());
  return n == 0 ? 0 : blobs.compact[n / 2].area;
}

// Learns from a rough mask, finds the marks with what was learnt, and learns again from those.
ColourModel learn_twice(const cv::Mat& bgr, const Blobs& rough, std::size_t marks) {
  ColourModel model = learn(bgr, cores(rough, marks));
  const cv::Mat score = scores(bgr, model);
  const double middle = quantile(score.reshape(1, 1), 0.5);
  const Blobs found = find_blobs(score > std::max(middle + model.level / 2, model.background));
  if (found.compact.size() >= std::max<std::size_t>(1, marks / 2)) model = learn(bgr, cores(found, marks));
  model.area_px = typical_area(found.compact.empty() ? rough : found, marks);
  return model;
}

struct Polar {
  cv::Mat hue_deg;
  cv::Mat chroma;
};

// Pixels of chroma whose hue lies within kHueWidth_deg of `hue_deg`.
cv::Mat hue_mask(const Polar& picture, double hue_deg) {
  cv::Mat out = cv::Mat::zeros(picture.hue_deg.size(), CV_8U);
  for (const double turn : {-360.0, 0.0, 360.0}) {
    cv::Mat one;
    cv::inRange(picture.hue_deg, hue_deg + turn - kHueWidth_deg, hue_deg + turn + kHueWidth_deg, one);
    out |= one;
  }
  return out & (picture.chroma > kMinChroma);
}

Polar polar(const cv::Mat& lab_picture) {
  std::array<cv::Mat, 3> planes;
  cv::split(lab_picture, planes.data());
  cv::Mat a;
  cv::Mat b;
  planes[1].convertTo(a, CV_32F, 1, -128);
  planes[2].convertTo(b, CV_32F, 1, -128);
  Polar out;
  cv::cartToPolar(a, b, out.chroma, out.hue_deg, true);
  return out;
}

double mean_chroma(const Blobs& blobs, const cv::Mat& chroma, std::size_t count) {
  double sum = 0;
  const std::size_t n = std::min(count, blobs.compact.size());
  for (std::size_t i = 0; i < n; ++i) sum += cv::mean(chroma, blobs.labels == blobs.compact[i].label)[0];
  return n == 0 ? 0 : sum / static_cast<double>(n);
}

}  // namespace

cv::Mat scores(const cv::Mat& bgr, const ColourModel& colour) {
  cv::Mat out(bgr.size(), CV_32F);
  cv::Mat row;
  for (int y = 0; y < bgr.rows; ++y) {
    bgr.row(y).convertTo(row, CV_32F);
    cv::transform(row, out.row(y), cv::Matx13d(colour.weight.data()));
  }
  return out;
}

std::vector<float> values(const cv::Mat& score, const cv::Mat& mask) {
  std::vector<float> out;
  out.reserve(static_cast<std::size_t>(cv::countNonZero(mask)));
  for (int y = 0; y < score.rows; ++y) {
    for (int x = 0; x < score.cols; ++x) {
      if (mask.at<std::uint8_t>(y, x) != 0) out.push_back(score.at<float>(y, x));
    }
  }
  return out;
}

double quantile(std::vector<float> values, double share) {
  if (values.empty()) return 0;
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, at);
  return static_cast<double>(*at);
}

ColourModel colour_at(const Picture& picture, Point at) {
  if (!(at.x >= 0 && at.y >= 0 && at.x < picture.cols && at.y < picture.rows))
    throw io::InputError("({:g}, {:g}) lies outside the picture of {} x {} pixels", at.x, at.y, picture.cols,
                         picture.rows);
  const cv::Mat picture_lab = lab(picture);
  cv::Mat smooth;
  cv::medianBlur(picture_lab, smooth, 3);
  cv::Mat mask = cv::Mat::zeros(picture.rows + 2, picture.cols + 2, CV_8U);
  constexpr double kAlikeL = 60;
  constexpr double kAlike = 12;
  cv::Rect box;
  const int area = cv::floodFill(smooth, mask, {static_cast<int>(at.x), static_cast<int>(at.y)}, {}, &box,
                                 {kAlikeL, kAlike, kAlike}, {kAlikeL, kAlike, kAlike},
                                 8 | cv::FLOODFILL_MASK_ONLY | cv::FLOODFILL_FIXED_RANGE | (255 << 8));
  if (area > kMaxBlobShare * 4 * picture.cols * picture.rows) {
    throw io::InputError(
        "what is at ({:g}, {:g}) is no mark: {} pixels around it look the same; click into a coloured dot",
        at.x, at.y, area);
  }
  ColourModel out = learn(picture, mask(cv::Rect(1, 1, picture.cols, picture.rows)));
  out.area_px = area;
  return out;
}

ColourModel colour_like(const Picture& picture, const std::array<double, 3>& rgb) {
  const Picture one(1, 1, CV_8UC3, cv::Scalar(rgb[2], rgb[1], rgb[0]));
  const double hue_deg{polar(lab(one)).hue_deg.at<float>(0, 0)};
  const Blobs blobs = find_blobs(hue_mask(polar(lab(picture)), hue_deg));
  if (blobs.compact.empty()) throw io::InputError("no mark of the given colour is in the picture");
  return learn_twice(picture, blobs, blobs.compact.size());
}

ColourModel colour_automatic(const Picture& picture, const Window& region, std::size_t marks) {
  if (region.empty()) throw io::JobError("the picture is too small for the skeleton's region");
  const cv::Mat bgr = picture(region);
  cv::Mat picture_lab = lab(bgr);
  cv::medianBlur(picture_lab, picture_lab, 3);
  Polar colours = polar(picture_lab);
  double best_score = 0;
  std::size_t most = 0;
  Blobs best;
  for (int i = 0; i < kHues; ++i) {
    Blobs blobs = find_blobs(hue_mask(colours, 360.0 * i / kHues));
    most = std::max(most, blobs.compact.size());
    if (blobs.compact.size() < marks) continue;
    const double excess = static_cast<double>(blobs.compact.size() - marks) / static_cast<double>(marks);
    const double spread = blobs.compact.front().area / blobs.compact[marks - 1].area;
    const double area = typical_area(blobs, marks) * static_cast<double>(marks);
    const double score = mean_chroma(blobs, colours.chroma, marks) / (1 + excess) / (1 + std::log(spread)) /
                         (1 + blobs.other_px / (10 * area));
    if (score <= best_score) continue;
    best_score = score;
    best = std::move(blobs);
  }
  if (best.compact.empty()) {
    throw io::JobError(
        "no colour has {} dots of a mark's size in this picture (the best has {}): more light, "
        "one bright colour that nothing else has, or give the colour with --colour X,Y",
        marks, most);
  }
  for (cv::Mat* done : {&picture_lab, &colours.hue_deg, &colours.chroma})
    done->release();  // before as much again is needed
  return learn_twice(bgr, best, marks);
}

}  // namespace flexor::camera
