#include "host/camera/marks.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "host/camera/opencv.hpp"
#include "host/io/numbers.hpp"

namespace flexor::camera {
namespace {

constexpr double kLowestShare = 0.35;   // of the expected level: fainter things are not this mark
constexpr double kLeastArea = 0.45;     // of the expected area: less is a mark partly hidden
constexpr double kTouchingArea = 1.45;  // of the expected area: more is a blob with something else in it
constexpr double kOverlapArea = 1.1;    // likewise where another mark is expected beside it
constexpr double kTouchingError = 0.2;  // standard error of a mark cut out of such a blob, in radii
constexpr double kRounding = 0.2887;    // 1 / sqrt(12)
constexpr int kSpeck = 4;               // pixels above half level beside a mark that noise makes
constexpr double kLowestLevel = 8;      // grey levels
constexpr double kPi = std::numbers::pi;
// A sharp edge has 0.64 px of pixels between a quarter and three quarters of the level for each pixel of its
// length (uniform coverage, random direction); each of them weighs wrong by sqrt(0.042) on average.
constexpr double kSharpEdge_px = 0.64;
constexpr double kSampling = 0.042;
constexpr int kRim = 2;  // pixels around the mark that its edge may reach

// What a pixel of a window is.
constexpr std::uint8_t kBelow = 0;
constexpr std::uint8_t kAbove = 1;  // above half level
constexpr std::uint8_t kMark = 2;
constexpr std::uint8_t kRimPixel = 3;
constexpr std::uint8_t kTooSmall = 4;
constexpr std::uint8_t kStrange = 5;  // of something else, beside the mark

std::size_t at_index(int i) { return static_cast<std::size_t>(i); }

double radius(double area_px) { return std::sqrt(area_px / kPi); }

Window around(const Picture& picture, Point at, double reach) {
  const int left = std::max(0, static_cast<int>(std::floor(at.x - reach)));
  const int top = std::max(0, static_cast<int>(std::floor(at.y - reach)));
  const int right = std::min(picture.width - 1, static_cast<int>(std::ceil(at.x + reach)));
  const int bottom = std::min(picture.height - 1, static_cast<int>(std::ceil(at.y + reach)));
  return {left, top, right - left + 1, bottom - top + 1};
}

double squared(double v) { return v * v; }

// Of every 16th pixel in both directions.
double median_score(const Picture& picture, const ColourModel& colour, const Window& region) {
  constexpr int kStep = 16;
  std::vector<double> score;
  for (int y = region.y; y < region.y + region.height; y += kStep) {
    for (int x = region.x; x < region.x + region.width; x += kStep) {
      const std::uint8_t* pixel = picture.at(x, y);
      score.push_back(colour.weight[0] * pixel[0] + colour.weight[1] * pixel[1] +
                      colour.weight[2] * pixel[2]);
    }
  }
  return io::median(std::move(score));
}

// 255 where a pixel of `region` scores more than `threshold`. In integers, which is enough to find by: what
// is found is measured anew.
cv::Mat above(const Picture& picture, const ColourModel& colour, const Window& region, double threshold) {
  constexpr double kUnit = 64;
  std::array<int, 3> weight{};
  for (std::size_t k = 0; k < 3; ++k) weight[k] = static_cast<int>(std::lround(kUnit * colour.weight[k]));
  const int limit = static_cast<int>(std::lround(kUnit * threshold));
  cv::Mat out(region.height, region.width, CV_8U);
  for (int y = 0; y < region.height; ++y) {
    const std::uint8_t* from = picture.at(region.x, region.y + y);
    auto* to = out.ptr<std::uint8_t>(y);
    for (int x = 0; x < region.width; ++x) {
      const int score = weight[0] * from[3 * x] + weight[1] * from[3 * x + 1] + weight[2] * from[3 * x + 2];
      to[x] = score > limit ? 255 : 0;
    }
  }
  return out;
}

}  // namespace

double least_area_px(const ColourModel& colour) { return std::max(6.0, 0.1 * colour.area_px); }

std::vector<Mark> find_marks(const Picture& picture, const ColourModel& colour, const Window& region,
                             double min_area_px) {
  std::vector<Mark> out;
  if (region.empty()) return out;
  const double middle = median_score(picture, colour, region);
  const double threshold =
      std::clamp(colour.background, middle + 0.4 * colour.level, middle + 0.7 * colour.level);
  const cv::Mat mask = above(picture, colour, region, threshold);
  cv::Mat labels;
  cv::Mat stats;
  cv::Mat centres;
  const int n = cv::connectedComponentsWithStats(mask, labels, stats, centres, 8, CV_32S);
  std::vector<Expected> expected;
  for (int i = 1; i < n; ++i) {
    const double area = stats.at<int>(i, cv::CC_STAT_AREA);
    if (area < min_area_px) continue;
    expected.push_back(
        {{centres.at<double>(i, 0) + region.x, centres.at<double>(i, 1) + region.y},
         0.75 * std::max(stats.at<int>(i, cv::CC_STAT_WIDTH), stats.at<int>(i, cv::CC_STAT_HEIGHT)),
         0,
         colour.level});
  }
  MarkMeter meter;
  std::vector<std::optional<Mark>> measured;
  for (const Expected& e : expected) {
    meter.measure(picture, colour, {e}, measured);
    if (!measured.front() || measured.front()->area_px < min_area_px) continue;
    const auto same = [&](const Mark& m) {
      return std::hypot(m.centre.x - measured.front()->centre.x, m.centre.y - measured.front()->centre.y) < 2;
    };
    if (std::ranges::none_of(out, same)) out.push_back(*measured.front());
  }
  return out;
}

void MarkMeter::look(const Picture& picture, const ColourModel& colour, const Expected& e) {
  Patch& patch = patch_;
  patch.window = around(picture, e.at, e.reach_px + 1.6 * radius(e.area_px) + 3);
  const Window& w = patch.window;
  if (w.empty()) return;
  const auto count = static_cast<std::size_t>(w.width) * static_cast<std::size_t>(w.height);
  patch.score.resize(count);
  patch.label.assign(count, 0);
  const auto blue = static_cast<float>(colour.weight[0]);
  const auto green = static_cast<float>(colour.weight[1]);
  const auto red = static_cast<float>(colour.weight[2]);
  for (int y = 0; y < w.height; ++y) {
    const std::uint8_t* from = picture.at(w.x, w.y + y);
    float* to = &patch.score[static_cast<std::size_t>(y) * static_cast<std::size_t>(w.width)];
    for (int x = 0; x < w.width; ++x) {
      to[x] = blue * static_cast<float>(from[3 * x]) + green * static_cast<float>(from[3 * x + 1]) +
              red * static_cast<float>(from[3 * x + 2]);
    }
  }
  // Every third pixel is plenty for a median.
  std::vector<double> scores;
  std::vector<double> steps;
  for (std::size_t i = 0; i < count; i += 3) scores.push_back(patch.score[i]);
  for (std::size_t i = 1; i < count; i += 3) steps.push_back(std::abs(patch.score[i] - patch.score[i - 1]));
  patch.background = io::median(std::move(scores));
  if (!steps.empty())
    patch.noise = std::max(kRounding, io::median(std::move(steps)) / 0.6745 / std::sqrt(2.0));
}

// Of the blobs of the expected size the one nearest to where it is expected becomes kMark; returns its size, 0: there is none.
int MarkMeter::find_blob(const Expected& e, double threshold) {
  const Window& w = patch_.window;
  const cv::Mat score(w.height, w.width, CV_32F, patch_.score.data());
  cv::Mat labels;
  cv::Mat stats;
  cv::Mat centres;
  const int n = cv::connectedComponentsWithStats(score > threshold, labels, stats, centres, 4, CV_32S);
  std::vector<double> distance(static_cast<std::size_t>(n), std::numeric_limits<double>::infinity());
  for (int y = 0; y < w.height; ++y) {
    for (int x = 0; x < w.width; ++x) {
      double& nearest = distance[at_index(labels.at<int>(y, x))];
      nearest = std::min(nearest, squared(w.x + x - e.at.x) + squared(w.y + y - e.at.y));
    }
  }
  const auto area = [&](int blob) { return stats.at<int>(blob, cv::CC_STAT_AREA); };
  const double least = std::max(3.0, kLeastArea * e.area_px);
  int mark = 0;
  for (int blob = 1; blob < n; ++blob) {
    if (area(blob) >= least && (mark == 0 || distance[at_index(blob)] < distance[at_index(mark)]))
      mark = blob;
  }
  if (mark == 0) return 0;
  for (std::size_t i = 0; i < patch_.label.size(); ++i) {
    const int blob = labels.ptr<int>()[i];
    const bool is_speck = area(blob) < least && distance[at_index(blob)] < distance[at_index(mark)];
    patch_.label[i] = blob == 0 ? kBelow : blob == mark ? kMark : is_speck ? kTooSmall : kAbove;
  }
  return area(mark);
}

double MarkMeter::level() const {
  std::vector<float> scores;
  for (std::size_t i = 0; i < patch_.label.size(); ++i) {
    if (patch_.label[i] == kMark) scores.push_back(patch_.score[i]);
  }
  // Above the median: the edge is part of the blob, too.
  const auto at = scores.begin() + static_cast<std::ptrdiff_t>(7 * scores.size() / 10);
  std::ranges::nth_element(scores, at);
  return static_cast<double>(*at) - patch_.background;
}

// Of a blob that several marks share, keeps the pixels that are nearest to mark k.
void MarkMeter::part(const std::vector<Expected>& expected, std::size_t k) {
  const Window& w = patch_.window;
  std::vector<Point> centre;
  std::size_t own = 0;
  for (std::size_t j = 0; j < expected.size(); ++j) {
    const Point p = expected[j].at;
    if (j == k) own = centre.size();
    if (j == k || (p.x > w.x && p.y > w.y && p.x < w.x + w.width && p.y < w.y + w.height))
      centre.push_back(p);
  }
  constexpr int kRounds = 5;
  for (int round = 0; round <= kRounds; ++round) {
    std::vector<std::array<double, 3>> sum(centre.size());
    for (int i = 0; i < w.width * w.height; ++i) {
      if (patch_.label[at_index(i)] != kMark) continue;
      const double x = w.x + i % w.width;
      const int row = i / w.width;
      const double y = w.y + row;
      const auto nearest = std::ranges::min_element(
          centre, {}, [&](const Point& c) { return squared(x - c.x) + squared(y - c.y); });
      const auto at = static_cast<std::size_t>(nearest - centre.begin());
      sum[at][0] += 1;
      sum[at][1] += x;
      sum[at][2] += y;
      if (round == kRounds && at != own) patch_.label[at_index(i)] = kAbove;
    }
    for (std::size_t j = 0; j < centre.size(); ++j) {
      if (sum[j][0] > 0) centre[j] = {sum[j][1] / sum[j][0], sum[j][2] / sum[j][0]};
    }
  }
}

// Pixels within kRim of the mark that belong to nothing else. True: something else of this colour is so near
// that their edges mix.
bool MarkMeter::add_rim() {
  int strange = 0;
  int own = 0;
  const Window& w = patch_.window;
  for (int y = 0; y < w.height; ++y) {
    for (int x = 0; x < w.width; ++x) {
      if (patch_.label[at_index(y * w.width + x)] != kMark) continue;
      ++own;
      for (int v = std::max(0, y - kRim); v <= std::min(w.height - 1, y + kRim); ++v) {
        for (int u = std::max(0, x - kRim); u <= std::min(w.width - 1, x + kRim); ++u) {
          std::uint8_t& label = patch_.label[at_index(v * w.width + u)];
          if (label == kBelow) label = kRimPixel;
          if (label == kAbove) {
            label = kStrange;
            ++strange;
          }
        }
      }
    }
  }
  return strange > std::max(kSpeck, own / 20);
}

// Centre of gravity with weights that rise from 0 to 1 between the levels `middle` - L/4 and `middle` + L/4.
Point MarkMeter::centre_at(double middle, double level) const {
  const Window& w = patch_.window;
  Point sum;
  double weight = 0;
  for (int i = 0; i < w.width * w.height; ++i) {
    const std::uint8_t label = patch_.label[at_index(i)];
    if (label != kMark && label != kRimPixel) continue;
    const double s = static_cast<double>(patch_.score[at_index(i)]);
    const double v = std::clamp((s - middle) / (level / 2) + 0.5, 0.0, 1.0);
    weight += v;
    sum.x += v * (w.x + i % w.width);
    const int row = i / w.width;
    sum.y += v * (w.y + row);
  }
  return {sum.x / weight, sum.y / weight};
}

Mark MarkMeter::centre(double level) const {
  const Window& w = patch_.window;
  Mark out;
  out.level = level;
  const double half = patch_.background + level / 2;
  out.centre = centre_at(half, level);
  // Sums over the edge, around the centre.
  double edge_px = 0;
  Covariance spread{};
  for (int i = 0; i < w.width * w.height; ++i) {
    const std::uint8_t label = patch_.label[at_index(i)];
    if (label != kMark && label != kRimPixel) continue;
    const double s = static_cast<double>(patch_.score[at_index(i)]);
    const double v = (s - half) / (level / 2) + 0.5;
    out.area_px += std::clamp(v, 0.0, 1.0);
    if (v <= 0 || v >= 1) continue;
    const double x = w.x + i % w.width - out.centre.x;
    const int row = i / w.width;
    const double y = w.y + row - out.centre.y;
    ++edge_px;
    spread[0] += x * x;
    spread[1] += x * y;
    spread[2] += y * y;
  }
  const double edge_width_px = edge_px / (2 * kPi * radius(out.area_px));
  // The clamp swallows some of the noise, 0.75 v^1.5 of its variance v over an edge; and noise softens the
  // corners of the clamp, which are what sampling errs by.
  const double noise = std::min(0.5, 2 * patch_.noise / level);
  const double sampling =
      kSampling * (1 - 1.5 * noise) * std::pow(kSharpEdge_px / std::max(edge_width_px, kSharpEdge_px), 3.5);
  const double variance = (squared(noise) * (1 - 0.75 * noise) + sampling) / squared(out.area_px);
  // An irregular mark has no one centre: its faint outline has another than its core.
  const Point outline = centre_at(half - level / 8, level);
  const Point core = centre_at(half + level / 8, level);
  const double dx = outline.x - core.x;
  const double dy = outline.y - core.y;
  out.covariance = {variance * spread[0] + dx * dx / 12, variance * spread[1] + dx * dy / 12,
                    variance * spread[2] + dy * dy / 12};
  return out;
}

bool MarkMeter::at_border() const {
  const Window& w = patch_.window;
  for (int i = 0; i < w.width * w.height; ++i) {
    const int x = i % w.width;
    const int y = i / w.width;
    const bool border = x == 0 || y == 0 || x == w.width - 1 || y == w.height - 1;
    if (border && patch_.label[at_index(i)] == kMark) return true;
  }
  return false;
}

std::optional<Mark> MarkMeter::measure_one(const Picture& picture, const ColourModel& colour,
                                           const std::vector<Expected>& expected, std::size_t k) {
  const Expected& e = expected[k];
  look(picture, colour, e);
  if (patch_.window.empty()) return std::nullopt;
  double l = e.level;
  int count = 0;
  for (int pass = 0; pass < 2; ++pass) {
    count = find_blob(e, patch_.background + l / 2);
    if (count == 0) return std::nullopt;
    l = level();
    if (l < kLowestShare * e.level || l < kLowestLevel || l < 4 * patch_.noise) return std::nullopt;
  }
  bool near = false;
  for (std::size_t j = 0; j < expected.size(); ++j) {
    const double apart = std::hypot(expected[j].at.x - e.at.x, expected[j].at.y - e.at.y);
    near = near || (j != k && apart < radius(e.area_px) + radius(expected[j].area_px) + kRim);
  }
  const bool merged = e.area_px > 0 && count > (near ? kOverlapArea : kTouchingArea) * e.area_px;
  if (merged) part(expected, k);
  const bool cut = at_border();
  const bool touching = add_rim() || merged || near;
  Mark out = centre(l);
  out.at_edge = cut;
  out.touching = touching;
  if (touching) {
    const double doubt = squared(kTouchingError * radius(out.area_px));
    out.covariance[0] += doubt;
    out.covariance[2] += doubt;
  }
  return out;
}

void MarkMeter::measure(const Picture& picture, const ColourModel& colour,
                        const std::vector<Expected>& expected, std::vector<std::optional<Mark>>& out) {
  out.assign(expected.size(), std::nullopt);
  for (std::size_t k = 0; k < expected.size(); ++k) out[k] = measure_one(picture, colour, expected, k);
}

}  // namespace flexor::camera
