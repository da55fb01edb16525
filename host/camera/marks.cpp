#include "host/camera/marks.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/imgproc.hpp>

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

double radius(double area_px) { return std::sqrt(area_px / kPi); }

Window around(const Picture& picture, Point at, double reach) {
  const cv::Point first(cvFloor(at.x - reach), cvFloor(at.y - reach));
  const cv::Point behind(cvCeil(at.x + reach) + 1, cvCeil(at.y + reach) + 1);
  return Window(first, behind) & Window({}, picture.size());
}

double squared(double v) { return v * v; }

// The surroundings of one mark.
class Patch {
 public:
  Patch(const Picture& picture, const ColourModel& colour, const std::vector<Expected>& expected,
        std::size_t k)
      : expected_(expected), own_(expected[k]) {
    const Window w = around(picture, own_.at, own_.reach_px + 1.6 * radius(own_.area_px) + 3);
    if (w.empty()) return;
    corner_ = w.tl();
    score_ = scores(picture(w), colour);
    // Every third pixel is plenty for a median.
    const auto* score = score_.ptr<float>();
    std::vector<float> some;
    std::vector<float> steps;
    for (std::size_t i = 0; i < score_.total(); i += 3) some.push_back(score[i]);
    for (std::size_t i = 1; i < score_.total(); i += 3) steps.push_back(std::abs(score[i] - score[i - 1]));
    background_ = quantile(std::move(some), 0.5);
    noise_ = std::max(kRounding, quantile(std::move(steps), 0.5) / 0.6745 / std::sqrt(2.0));
  }

  std::optional<Mark> measure() {
    if (score_.empty()) return std::nullopt;
    double level = own_.level;
    int area = 0;
    for (int pass = 0; pass < 2; ++pass) {
      area = find_blob(background_ + level / 2);
      if (area == 0) return std::nullopt;
      // Above the median: the edge is part of the blob, too.
      level = quantile(values(score_, mark_), 0.7) - background_;
      if (level < kLowestShare * own_.level || level < kLowestLevel || level < 4 * noise_)
        return std::nullopt;
    }
    const bool near = std::ranges::any_of(expected_, [&](const Expected& other) {
      const double apart = cv::norm(other.at - own_.at);
      return &other != &own_ && apart < radius(own_.area_px) + radius(other.area_px) + kRim;
    });
    const bool merged = own_.area_px > 0 && area > (near ? kOverlapArea : kTouchingArea) * own_.area_px;
    if (merged) part();
    const cv::Rect box = cv::boundingRect(mark_);
    const bool cut = box.x == 0 || box.y == 0 || box.br().x == score_.cols || box.br().y == score_.rows;
    const bool touching = add_rim() || merged || near;
    Mark out = centre(level);
    out.at_edge = cut;
    out.touching = touching;
    if (touching) {
      const double doubt = squared(kTouchingError * radius(out.area_px));
      out.covariance[0] += doubt;
      out.covariance[2] += doubt;
    }
    return out;
  }

 private:
  // Of the blobs of the expected size the one nearest to where it is expected becomes the mark; returns its size, 0: there is
  // none. Specks between the two are neither mark nor anything else.
  int find_blob(double threshold) {
    cv::Mat labels;
    cv::Mat stats;
    cv::Mat centres;
    const int n = cv::connectedComponentsWithStats(score_ > threshold, labels, stats, centres, 4, CV_32S);
    std::vector<double> distance(static_cast<std::size_t>(n), std::numeric_limits<double>::infinity());
    const Point expected = own_.at - corner_;
    for (int y = 0; y < labels.rows; ++y) {
      for (int x = 0; x < labels.cols; ++x) {
        double& nearest = distance[static_cast<std::size_t>(labels.at<int>(y, x))];
        nearest = std::min(nearest, squared(x - expected.x) + squared(y - expected.y));
      }
    }
    const auto area = [&](int blob) { return stats.at<int>(blob, cv::CC_STAT_AREA); };
    const auto nearer = [&](int a, int b) {
      return distance[static_cast<std::size_t>(a)] < distance[static_cast<std::size_t>(b)];
    };
    const double least = std::max(3.0, kLeastArea * own_.area_px);
    int mark = 0;
    for (int blob = 1; blob < n; ++blob) {
      if (area(blob) >= least && (mark == 0 || nearer(blob, mark))) mark = blob;
    }
    if (mark == 0) return 0;
    free_ = labels == 0;
    mark_ = labels == mark;
    other_ = ~(free_ | mark_);
    for (int blob = 1; blob < n; ++blob) {
      if (area(blob) < least && nearer(blob, mark)) other_.setTo(0, labels == blob);
    }
    return area(mark);
  }

  // Of a blob that several marks share, keeps the pixels that are nearest to this one.
  void part() {
    std::vector<Point> centre;
    std::size_t own = 0;
    for (const Expected& e : expected_) {
      const Point p = e.at - corner_;
      if (&e == &own_) own = centre.size();
      if (&e == &own_ || (p.x > 0 && p.y > 0 && p.x < score_.cols && p.y < score_.rows)) centre.push_back(p);
    }
    std::vector<cv::Point> pixels;
    cv::findNonZero(mark_, pixels);
    constexpr int kRounds = 5;
    for (int round = 0; round <= kRounds; ++round) {
      std::vector<cv::Vec3d> sum(centre.size());
      for (const cv::Point& p : pixels) {
        const auto nearest =
            std::ranges::min_element(centre, {}, [&](const Point& c) { return cv::norm(c - Point(p)); });
        const auto at = static_cast<std::size_t>(nearest - centre.begin());
        sum[at] += cv::Vec3d(1, p.x, p.y);
        if (round < kRounds || at == own) continue;
        mark_.at<std::uint8_t>(p) = 0;
        other_.at<std::uint8_t>(p) = 255;
      }
      for (std::size_t j = 0; j < centre.size(); ++j) {
        if (sum[j][0] > 0) centre[j] = {sum[j][1] / sum[j][0], sum[j][2] / sum[j][0]};
      }
    }
  }

  // Pixels within kRim of the mark that belong to nothing else. True: something else of this colour is so near
  // that their edges mix.
  bool add_rim() {
    cv::Mat near;
    cv::dilate(mark_, near, cv::Mat::ones(2 * kRim + 1, 2 * kRim + 1, CV_8U));
    const int own = cv::countNonZero(mark_);
    mark_ |= near & free_;
    return cv::countNonZero(near & other_) > std::max(kSpeck, own / 20);
  }

  // They rise from 0 to 1 between the levels `middle` - L/4 and `middle` + L/4.
  cv::Mat weights(double middle, double level) const {
    cv::Mat out;
    score_.convertTo(out, CV_32F, 2 / level, 0.5 - 2 * middle / level);
    out = cv::min(cv::max(out, 0), 1);
    out.setTo(0, ~mark_);
    return out;
  }

  static Point gravity(const cv::Moments& m) { return {m.m10 / m.m00, m.m01 / m.m00}; }

  Mark centre(double level) const {
    const double half = background_ + level / 2;
    const cv::Mat weight = weights(half, level);
    const cv::Moments all = cv::moments(weight);
    const cv::Moments edge = cv::moments((weight > 0) & (weight < 1), true);
    const Point at = gravity(all);
    Mark out;
    out.level = level;
    out.centre = corner_ + at;
    out.area_px = all.m00;
    const double edge_width_px = edge.m00 / (2 * kPi * radius(out.area_px));
    // The clamp swallows some of the noise, 0.75 v^1.5 of its variance v over an edge; and noise softens the
    // corners of the clamp, which are what sampling errs by.
    const double noise = std::min(0.5, 2 * noise_ / level);
    const double sampling =
        kSampling * (1 - 1.5 * noise) * std::pow(kSharpEdge_px / std::max(edge_width_px, kSharpEdge_px), 3.5);
    const double variance = (squared(noise) * (1 - 0.75 * noise) + sampling) / squared(out.area_px);
    // The edge's spread is around the centre.
    const Point off = edge.m00 > 0 ? gravity(edge) - at : Point();
    // An irregular mark has no one centre: its faint outline has another than its core.
    const Point d = gravity(cv::moments(weights(half - level / 8, level))) -
                    gravity(cv::moments(weights(half + level / 8, level)));
    out.covariance = {variance * (edge.mu20 + edge.m00 * off.x * off.x) + d.x * d.x / 12,
                      variance * (edge.mu11 + edge.m00 * off.x * off.y) + d.x * d.y / 12,
                      variance * (edge.mu02 + edge.m00 * off.y * off.y) + d.y * d.y / 12};
    return out;
  }

  const std::vector<Expected>& expected_;
  const Expected& own_;
  Point corner_;
  cv::Mat score_;
  cv::Mat mark_;   // masks: the mark, with add_rim() its rim,
  cv::Mat other_;  // what else is of this colour,
  cv::Mat free_;   // and what is not
  double background_ = 0;
  double noise_ = kRounding;
};

}  // namespace

double least_area_px(const ColourModel& colour) { return std::max(6.0, 0.1 * colour.area_px); }

std::vector<Mark> find_marks(const Picture& picture, const ColourModel& colour, const Window& region,
                             double min_area_px) {
  std::vector<Mark> out;
  if (region.empty()) return out;
  // In bytes, which is enough to find by: what is found is measured again.
  constexpr double kUnit = 0.6;
  constexpr double kZero = 128;
  const auto weight = [&](std::size_t k) { return static_cast<float>(kUnit * colour.weight.at(k)); };
  cv::Mat bytes;
  cv::transform(picture(region), bytes, cv::Matx14f(weight(0), weight(1), weight(2), kZero));
  std::vector<float> some;
  constexpr int kStep = 16;
  for (int y = 0; y < bytes.rows; y += kStep) {
    for (int x = 0; x < bytes.cols; x += kStep) some.push_back(bytes.at<std::uint8_t>(y, x));
  }
  const double middle = (quantile(std::move(some), 0.5) - kZero) / kUnit;
  const double threshold =
      std::clamp(colour.background, middle + 0.4 * colour.level, middle + 0.7 * colour.level);
  cv::Mat labels;
  cv::Mat stats;
  cv::Mat centres;
  const int n =
      cv::connectedComponentsWithStats(bytes > kZero + kUnit * threshold, labels, stats, centres, 8, CV_32S);
  for (int i = 1; i < n; ++i) {
    const double area = stats.at<int>(i, cv::CC_STAT_AREA);
    if (area < min_area_px) continue;
    const std::vector<Expected> expected = {
        {{centres.at<double>(i, 0) + region.x, centres.at<double>(i, 1) + region.y},
         0.75 * std::max(stats.at<int>(i, cv::CC_STAT_WIDTH), stats.at<int>(i, cv::CC_STAT_HEIGHT)),
         0,
         colour.level}};
    const std::optional<Mark> mark = Patch(picture, colour, expected, 0).measure();
    if (!mark || mark->area_px < min_area_px) continue;
    const auto same = [&](const Mark& m) { return cv::norm(m.centre - mark->centre) < 2; };
    if (std::ranges::none_of(out, same)) out.push_back(*mark);
  }
  return out;
}

std::vector<std::optional<Mark>> measure_marks(const Picture& picture, const ColourModel& colour,
                                               const std::vector<Expected>& expected) {
  std::vector<std::optional<Mark>> out;
  for (std::size_t k = 0; k < expected.size(); ++k)
    out.push_back(Patch(picture, colour, expected, k).measure());
  return out;
}

}  // namespace flexor::camera
