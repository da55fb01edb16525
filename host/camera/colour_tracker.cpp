#include "host/camera/colour_tracker.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/io/io.hpp"

namespace flexor::camera {
namespace {

constexpr std::size_t kEager = 25;     // pictures in which everything is tried in each
constexpr std::size_t kPatient = 10;   // later in every so many
constexpr double kStartReach_px = 40;  // how far a mark may be from where the joint file has it
constexpr double kLeast_px = 5;        // a window reaches at least this far beyond the mark,
constexpr double kMost_px = 70;        // and at most that far
constexpr double kSigmas = 4;
constexpr double kArea = 0.1;       // how fast area and level are learnt, share a picture
constexpr double kMaxGrowth = 2.2;  // of the area in one picture, unless marks touch
constexpr double kBone = 0.05;
constexpr double kOddBone = 0.3;  // a bone that much longer or shorter than usual makes its angles doubtful
constexpr double kBoneOfLost = 0.25;  // tolerance for a mark that comes back
constexpr double kBoneOfJump = 0.15;  // likewise for marks that are named again while others are followed
constexpr double kSame_px = 3;

constexpr double kMeasured_px2 = 0.25;        // a mark's centre wanders by half a pixel as it turns
constexpr double kFirstSpeed_px_s = 300;      // standard deviation
constexpr double kLeastDensity_px2_s3 = 1e4;  // px^2/s^3
constexpr double kMostDensity = 1e8;
constexpr double kLearn = 0.15;
constexpr double kFade_s = 0.3;

double distance(Point a, Point b) { return cv::norm(a - b); }

}  // namespace

void MarkPredictor::begin(double t_s, Point at) {
  t_s_ = t_s;
  motion_.state << at.x, at.y, 0, 0;
  motion_.covariance = Eigen::Vector2d(kMeasured_px2, kFirstSpeed_px_s * kFirstSpeed_px_s).asDiagonal();
  density_ = 10 * kLeastDensity_px2_s3;
}

Point MarkPredictor::at(double t_s) const {
  const Motion<2>::Place place = after(t_s).state.row(0);
  return {place(0), place(1)};
}

double MarkPredictor::sigma_px(double t_s) const { return std::sqrt(after(t_s).covariance(0, 0)); }

void MarkPredictor::update(double t_s, Point z) {
  const Motion<2>::Place measured(z.x, z.y);
  motion_ = after(t_s);
  t_s_ = t_s;
  const double variance = motion_.covariance(0, 0) + kMeasured_px2;
  const double surprise = (measured - motion_.state.row(0)).squaredNorm() / (2 * variance) - 1;
  density_ = std::clamp(density_ * std::exp(kLearn * std::clamp(surprise, -1.0, 4.0)), kLeastDensity_px2_s3,
                        kMostDensity);
  motion_.update(measured, kMeasured_px2);
}

void MarkPredictor::skip(double t_s) {
  motion_ = after(t_s);
  motion_.state.row(1) *= std::exp(-(t_s - t_s_) / kFade_s);
  t_s_ = t_s;
}

bool Observation::labelled() const {
  return std::ranges::all_of(marks, [](const ObservedMark& m) { return m.measured; });
}

ColourModel learn_colour(const Skeleton& skeleton, const Picture& picture) {
  if (skeleton.rgb) return colour_like(picture, *skeleton.rgb);
  return colour_automatic(picture, region_of(skeleton, picture), skeleton.marks.size());
}

ColourTracker::ColourTracker(const Skeleton& skeleton, std::optional<Lens> lens)
    : skeleton_(skeleton),
      lens_(lens),
      colour_(skeleton.colour),
      marks_(skeleton.marks.size()),
      bone_px_(skeleton.links.size()) {}

Observation ColourTracker::step(const Picture& picture, double t_s) {
  for (Followed& m : marks_) m.seen.reset();
  if (following_) {
    follow(picture, t_s);
    find_missing(picture, t_s);
    const auto lost = std::ranges::count_if(marks_, &Followed::lost);
    if (2 * lost > std::ssize(marks_)) following_ = false;
  }
  if (!following_ && (frame_ < kEager || frame_ % kPatient == 0)) search(picture, t_s);
  ++frame_;
  for (std::size_t l = 0; l < bone_px_.size(); ++l) {
    const std::optional<double> now = bone_now_px(l);
    if (now) bone_px_[l] = bone_px_[l] > 0 ? bone_px_[l] + kBone * (*now - bone_px_[l]) : *now;
  }
  return report(t_s);
}

// The candidates nearest to where the joint file has the marks, if each is near enough and no two are one.
std::optional<std::vector<std::size_t>> ColourTracker::by_start(const std::vector<Mark>& candidates) const {
  std::vector<std::size_t> out;
  if (candidates.empty()) return std::nullopt;
  for (const std::optional<Point>& start : skeleton_.start) {
    if (!start) return std::nullopt;
    const auto nearest =
        std::ranges::min_element(candidates, {}, [&](const Mark& m) { return distance(m.centre, *start); });
    const auto at = static_cast<std::size_t>(nearest - candidates.begin());
    if (distance(nearest->centre, *start) > kStartReach_px || std::ranges::find(out, at) != out.end()) {
      return std::nullopt;
    }
    out.push_back(at);
  }
  return out;
}

void ColourTracker::search(const Picture& picture, double t_s) {
  try {
    if (!colour_) colour_ = learn_colour(skeleton_, picture);
  } catch (const io::Failure& e) {
    trouble_ = e.what();
    return;
  }
  const std::vector<Mark> candidates =
      find_marks(picture, *colour_, region_of(skeleton_, picture), least_area_px(*colour_));
  std::optional<std::vector<std::size_t>> chosen = by_start(candidates);
  if (!chosen) {
    const bool known = searches_ > 0 && std::ranges::all_of(bone_px_, [](double b) { return b > 0; });
    const auto found = assign(skeleton_, known ? bone_px_ : skeleton_.lengths(),
                              known ? kKnownLength : skeleton_.length_tolerance, candidates);
    if (!found || found->cost > kMaxCost) {
      trouble_ = fmt::format("{} dot(s) of the marks' colour, which do not look like the {} marks of \"{}\"",
                             candidates.size(), skeleton_.marks.size(), skeleton_.name);
      // Perhaps the wrong colour was learnt, from a picture without the hand.
      if (!skeleton_.colour && searches_ == 0) colour_.reset();
      return;
    }
    if (found->margin < kMinMargin) {
      trouble_ = fmt::format("the marks of \"{}\" can be named in two ways that look alike", skeleton_.name);
      return;
    }
    chosen = found->candidate;
  }
  for (std::size_t m = 0; m < marks_.size(); ++m) {
    const Mark& seen = candidates[(*chosen)[m]];
    marks_[m].area_px = seen.area_px;
    marks_[m].level = seen.level;
    marks_[m].predictor.begin(t_s, seen.centre);
    marks_[m].take(seen, t_s);
  }
  trouble_.clear();
  following_ = true;
  ++searches_;
}

void ColourTracker::Followed::take(const Mark& mark, double t_s) {
  lost() ? predictor.begin(t_s, mark.centre) : predictor.update(t_s, mark.centre);
  hidden = 0;
  seen = mark;
  if (mark.touching) return;
  area_px += kArea * (mark.area_px - area_px);
  level += kArea * (mark.level - level);
}

void ColourTracker::follow(const Picture& picture, double t_s) {
  std::vector<Expected> expected;
  std::vector<Followed*> mark;
  for (Followed& m : marks_) {
    if (m.lost()) continue;
    const double reach = std::min(kMost_px, kLeast_px + kSigmas * m.predictor.sigma_px(t_s));
    expected.push_back({m.predictor.at(t_s), reach, m.area_px, m.level});
    mark.push_back(&m);
  }
  const std::vector<std::optional<Mark>> measured = measure_marks(picture, *colour_, expected);
  const auto surprise = [&](std::size_t i) { return distance(measured[i]->centre, expected[i].at); };
  for (std::size_t i = 0; i < measured.size(); ++i) {
    if (!measured[i]) continue;
    const Expected& e = expected[i];
    const bool plausible = surprise(i) <= e.reach_px + kLeast_px &&
                           (measured[i]->touching || measured[i]->area_px < kMaxGrowth * e.area_px);
    // Two marks cannot be the same dot: it belongs to the one that it was nearer to.
    bool taken = false;
    for (std::size_t j = 0; j < measured.size() && !taken; ++j) {
      taken = j != i && measured[j] && distance(measured[i]->centre, measured[j]->centre) < kSame_px &&
              (surprise(j) < surprise(i) || (surprise(j) == surprise(i) && j < i));
    }
    if (plausible && !taken) mark[i]->take(*measured[i], t_s);
  }
  for (Followed& m : marks_) {
    if (m.seen) continue;
    if (!m.lost()) m.predictor.skip(t_s);
    ++m.hidden;
  }
}

// A lost mark may be the one candidate at the distances that its bones to followed marks allow.
std::optional<std::size_t> ColourTracker::only_candidate(std::size_t mark,
                                                         const std::vector<Mark>& candidates) const {
  std::vector<std::size_t> fitting;
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    int bones = 0;
    bool fits = true;
    for (std::size_t l = 0; l < skeleton_.links.size(); ++l) {
      const Link& link = skeleton_.links[l];
      if (link.from != mark && link.to != mark) continue;
      const Followed& other = marks_[link.from == mark ? link.to : link.from];
      if (!other.seen || bone_px_[l] <= 0) continue;
      ++bones;
      const double ratio = distance(candidates[c].centre, other.seen->centre) / bone_px_[l];
      fits = fits && std::abs(ratio - 1) < kBoneOfLost;
    }
    if (bones > 0 && fits && candidates[c].area_px > marks_[mark].area_px / kMaxGrowth &&
        candidates[c].area_px < marks_[mark].area_px * kMaxGrowth) {
      fitting.push_back(c);
    }
  }
  if (fitting.size() != 1) return std::nullopt;
  return fitting.front();
}

// None: not both ends are seen by themselves.
std::optional<double> ColourTracker::bone_now_px(std::size_t link) const {
  const Followed& a = marks_[skeleton_.links[link].from];
  const Followed& b = marks_[skeleton_.links[link].to];
  if (!a.seen || !b.seen || a.seen->touching || b.seen->touching) return std::nullopt;
  return distance(a.seen->centre, b.seen->centre);
}

// Between two pictures a bone keeps its length: one mark has taken another's place.
bool ColourTracker::looks_wrong() const {
  for (std::size_t l = 0; l < skeleton_.links.size(); ++l) {
    const std::optional<double> now = bone_now_px(l);
    if (now && bone_px_[l] > 0 && std::abs(*now / bone_px_[l] - 1) > kBoneOfJump) return true;
  }
  return false;
}

void ColourTracker::find_missing(const Picture& picture, double t_s) {
  const bool all_seen = std::ranges::all_of(marks_, [](const Followed& m) { return m.seen.has_value(); });
  if (all_seen && !looks_wrong()) return;
  const std::vector<Mark> candidates =
      find_marks(picture, *colour_, region_of(skeleton_, picture), least_area_px(*colour_));
  name_again(candidates, t_s);
  find_lost(candidates, t_s);
}

// All marks at once, if every bone has the length that it had; marks that were seen stay where they are, unless that is wrong.
void ColourTracker::name_again(const std::vector<Mark>& candidates, double t_s) {
  if (std::ranges::any_of(bone_px_, [](double b) { return b <= 0; })) return;
  const auto found = assign(skeleton_, bone_px_, kKnownLength, candidates);
  if (!found || found->margin < kMinMargin) return;
  const auto place = [&](std::size_t m) { return candidates[found->candidate[m]].centre; };
  for (std::size_t l = 0; l < skeleton_.links.size(); ++l) {
    const Link& link = skeleton_.links[l];
    if (std::abs(distance(place(link.from), place(link.to)) / bone_px_[l] - 1) > kBoneOfJump) return;
  }
  const auto stays = [&](std::size_t m) {
    return marks_[m].seen && distance(marks_[m].seen->centre, place(m)) <= kSame_px;
  };
  const bool is_wrong = looks_wrong();
  for (std::size_t m = 0; m < marks_.size(); ++m) {
    if (!is_wrong && marks_[m].seen && !stays(m)) return;
  }
  for (std::size_t m = 0; m < marks_.size(); ++m) {
    if (stays(m)) continue;
    marks_[m].predictor.begin(t_s, place(m));
    marks_[m].take(candidates[found->candidate[m]], t_s);
  }
}

void ColourTracker::find_lost(const std::vector<Mark>& candidates, double t_s) {
  std::vector<Mark> free = candidates;
  std::erase_if(free, [&](const Mark& c) {
    return std::ranges::any_of(
        marks_, [&](const Followed& m) { return m.seen && distance(m.seen->centre, c.centre) < kSame_px; });
  });
  for (std::size_t k = 0; k < marks_.size(); ++k) {
    if (!marks_[k].lost()) continue;
    if (const auto c = only_candidate(k, free)) {
      marks_[k].take(free[*c], t_s);
      free.erase(free.begin() + static_cast<std::ptrdiff_t>(*c));
    }
  }
}

Observation ColourTracker::report(double t_s) {
  Observation out;
  std::vector<Point> points;
  std::vector<Covariance> covariances;
  for (const Followed& m : marks_) {
    const Point at = m.seen ? m.seen->centre : m.predictor.at(t_s);
    out.marks.push_back({at, m.area_px, m.seen.has_value(), m.lost()});
    points.push_back(lens_ ? lens_->undistort(at) : at);
    covariances.push_back(m.seen ? m.seen->covariance : Covariance{});
  }
  std::vector<bool> odd(marks_.size());
  for (std::size_t l = 0; l < skeleton_.links.size(); ++l) {
    const Link& link = skeleton_.links[l];
    if (bone_px_[l] <= 0 || !out.marks[link.from].measured || !out.marks[link.to].measured) continue;
    const double ratio = distance(out.marks[link.from].at, out.marks[link.to].at) / bone_px_[l];
    if (std::abs(ratio - 1) > kOddBone) odd[link.from] = odd[link.to] = true;
  }
  const PositiveTurn& positive = skeleton_.positive;
  const bool sign_known =
      !positive.by_marks || (out.marks[positive.from].measured && out.marks[positive.to].measured &&
                             out.marks[positive.toward].measured);
  if (sign_known) sign_ = turn_sign(positive, points);
  for (const AngleRule& rule : skeleton_.angles) {
    Measurement m;
    const bool measured =
        std::ranges::all_of(rule.marks, [&](std::size_t k) { return out.marks[k].measured; });
    if (measured) m.angle = measure_angle(rule, sign_, points, covariances);
    if (m.angle) {
      m.doubtful = m.angle->deg < rule.min_deg || m.angle->deg > rule.max_deg ||
                   std::ranges::any_of(rule.marks, [&](std::size_t k) {
                     return odd[k] || marks_[k].seen->touching || marks_[k].seen->at_edge;
                   });
    }
    out.measurements.push_back(m);
  }
  return out;
}

}  // namespace flexor::camera
