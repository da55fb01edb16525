#include "host/camera/labels.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/camera/angles.hpp"
#include "host/io/numbers.hpp"

namespace flexor::camera {
namespace {

constexpr std::size_t kBeam = 4000;
constexpr double kMaxLogRatio = 0.9;  // a link is at most two and a half times too long or too short
constexpr double kAngleTolerance_deg = 10;
constexpr double kHeading_deg = 45;  // "up" is that much to either side
constexpr double kAreaTolerance = 0.8;
constexpr double kLevelTolerance = 0.4;

double half_square(double v) { return v * v / 2; }

// Marks that have been given a candidate.
struct Partial {
  std::vector<int> candidate;  // -1: not yet
  double ratio_sum = 0;        // of ln(length / nominal)
  double ratio_squares = 0;
  double other_cost = 0;
  double cost = 0;
};

class Search {
 public:
  Search(const Skeleton& skeleton, const std::vector<double>& lengths, double tolerance,
         const std::vector<Mark>& candidates)
      : skeleton_(skeleton), lengths_(lengths), tolerance_(tolerance), candidates_(candidates) {
    std::vector<double> areas;
    std::vector<double> levels;
    for (const Mark& m : candidates) {
      areas.push_back(m.area_px);
      levels.push_back(m.level);
    }
    // Of the largest, as many as are wanted: specks do not decide what is typical.
    std::ranges::sort(areas, std::greater<>());
    areas.resize(std::min(areas.size(), skeleton.marks.size()));
    const double area = io::median(areas);
    const double level = io::median(levels);
    for (const Mark& m : candidates) {
      look_cost_.push_back(half_square(std::log(m.area_px / area) / kAreaTolerance) +
                           half_square(std::log(m.level / level) / kLevelTolerance));
    }
  }

  std::optional<Assignment> run() {
    std::vector<Partial> beam;
    const std::size_t root = skeleton_.links.front().from;
    for (std::size_t c = 0; c < candidates_.size(); ++c) {
      Partial p;
      p.candidate.assign(skeleton_.marks.size(), -1);
      p.candidate[root] = static_cast<int>(c);
      p.other_cost = p.cost = look_cost_[c];
      beam.push_back(std::move(p));
    }
    for (std::size_t link = 0; link < skeleton_.links.size(); ++link) {
      std::vector<Partial> next;
      for (const Partial& p : beam) extend(p, link, next);
      const auto keep = next.begin() + static_cast<std::ptrdiff_t>(std::min(kBeam, next.size()));
      std::ranges::partial_sort(next, keep, {}, &Partial::cost);
      next.erase(keep, next.end());
      beam = std::move(next);
    }
    if (beam.empty()) return std::nullopt;
    Assignment out;
    for (const int c : beam.front().candidate) out.candidate.push_back(static_cast<std::size_t>(c));
    out.cost = beam.front().cost;
    constexpr double kAlone = 100;
    out.margin = beam.size() > 1 ? beam[1].cost - beam[0].cost : kAlone;
    return out;
  }

 private:
  Point at(const Partial& p, std::size_t mark) const {
    return candidates_[static_cast<std::size_t>(p.candidate[mark])].centre;
  }

  void extend(const Partial& p, std::size_t link, std::vector<Partial>& out) const {
    const Link& l = skeleton_.links[link];
    const Point from = at(p, l.from);
    for (std::size_t c = 0; c < candidates_.size(); ++c) {
      if (std::ranges::find(p.candidate, static_cast<int>(c)) != p.candidate.end()) continue;
      const Point line = candidates_[c].centre - from;
      const double length = cv::norm(line);
      if (length < 2) continue;
      const double ratio = std::log(length / lengths_[link]);
      if (link > 0 && std::abs(ratio - p.ratio_sum / static_cast<double>(link)) > kMaxLogRatio) continue;
      Partial q = p;
      q.candidate[l.to] = static_cast<int>(c);
      q.ratio_sum += ratio;
      q.ratio_squares += ratio * ratio;
      q.other_cost += look_cost_[c] + angle_cost(p, q);
      if (link == 0) q.other_cost += heading_cost(line / length);
      const auto n = static_cast<double>(link + 1);
      q.cost =
          q.other_cost + (q.ratio_squares - q.ratio_sum * q.ratio_sum / n) / (2 * tolerance_ * tolerance_);
      out.push_back(std::move(q));
    }
  }

  double heading_cost(Point direction) const {
    if (!skeleton_.first_link) return 0;
    const double cosine = direction.dot(*skeleton_.first_link);
    const double off_deg = std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / std::numbers::pi;
    return half_square(std::max(0.0, off_deg - kHeading_deg) / kAngleTolerance_deg);
  }

  static bool known(const Partial& p, const std::vector<std::size_t>& marks) {
    return std::ranges::all_of(marks, [&](std::size_t m) { return p.candidate[m] >= 0; });
  }

  // Of the angles that `after` knows and `before` did not.
  double angle_cost(const Partial& before, const Partial& after) const {
    const PositiveTurn& positive = skeleton_.positive;
    double cost = 0;
    std::vector<Point> marks;
    std::vector<Covariance> nothing;
    for (const AngleRule& rule : skeleton_.angles) {
      std::vector<std::size_t> needed = rule.marks;
      if (positive.by_marks && !rule.opening) {
        needed.insert(needed.end(), {positive.from, positive.to, positive.toward});
      }
      if (!known(after, needed) || known(before, needed)) continue;
      if (marks.empty()) {
        for (std::size_t m = 0; m < skeleton_.marks.size(); ++m) {
          marks.push_back(after.candidate[m] >= 0 ? at(after, m) : Point{});
        }
        nothing.resize(marks.size());
      }
      const auto angle = measure_angle(rule, turn_sign(positive, marks), marks, nothing);
      if (!angle) continue;
      const double excess = std::max({0.0, rule.min_deg - angle->deg, angle->deg - rule.max_deg});
      cost += half_square(excess / kAngleTolerance_deg);
    }
    return cost;
  }

  const Skeleton& skeleton_;
  const std::vector<double>& lengths_;
  double tolerance_;
  const std::vector<Mark>& candidates_;
  std::vector<double> look_cost_;
};

}  // namespace

std::optional<Assignment> assign(const Skeleton& skeleton, const std::vector<double>& lengths,
                                 double tolerance, const std::vector<Mark>& candidates) {
  if (candidates.size() < skeleton.marks.size()) return std::nullopt;
  return Search(skeleton, lengths, tolerance, candidates).run();
}

}  // namespace flexor::camera
