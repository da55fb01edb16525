#include "host/twin/wearer.hpp"

#include <algorithm>
#include <cmath>

#include "host/twin/laboratory.hpp"

namespace flexor::twin {
namespace {

std::size_t place(int finger) { return static_cast<std::size_t>(finger); }

}  // namespace

Wearer::Wearer(const Variation& variation, const Motion& pose) : variation_(variation) {
  for (int i = 0; i < kFingers; ++i) rest_deg_[place(i)] = from_deg_[place(i)] = pose.angle(i, -1, variation);
}

void Wearer::go_to(std::optional<Motion> motion, std::int64_t now_ms) {
  PerFinger here{};
  for (int i = 0; i < kFingers; ++i) here[place(i)] = angle(i, now_ms);
  from_deg_ = here;
  motion_ = std::move(motion);
  begin(now_ms);
}

// 3 u^2 - 2 u^3 is half as steep again in its middle as on average.
void Wearer::begin(std::int64_t now_ms) {
  double farthest_deg = 0;
  for (int i = 0; i < kFingers; ++i)
    farthest_deg = std::max(farthest_deg, std::abs(first(i) - from_deg_[place(i)]));
  const double join_ms = 1000 * 1.5 * farthest_deg / kJoinSpeed_deg_s;
  begin_ms_ = now_ms;
  before_ms_ = kBefore_ms;
  join_ms_ = kBlock_ms * static_cast<std::int64_t>(std::ceil(join_ms / kBlock_ms));
}

std::optional<std::int64_t> Wearer::start_ms() const {
  if (!motion_) return std::nullopt;
  return begin_ms_ + join_ms_ + before_ms_;
}

double Wearer::first(int finger) const {
  if (!motion_) return rest_deg_[place(finger)];
  return motion_->angle(finger, -static_cast<double>(kBefore_ms) / 1000, variation_);
}

double Wearer::at(int finger, std::int64_t t_ms) const {
  if (join_ms_ > 0 && t_ms < begin_ms_ + join_ms_) {
    const double u =
        static_cast<double>(std::max<std::int64_t>(t_ms - begin_ms_, 0)) / static_cast<double>(join_ms_);
    const double from = from_deg_[place(finger)];
    return from + (first(finger) - from) * u * u * (3 - 2 * u);
  }
  if (!motion_) return rest_deg_[place(finger)];
  return motion_->angle(finger, static_cast<double>(t_ms - *start_ms()) / 1000, variation_);
}

double Wearer::angle(int finger, std::int64_t t_ms) {
  if (motion_) {
    const std::int64_t duration_ms =
        kBlock_ms * static_cast<std::int64_t>(std::ceil(motion_->duration_s() * 1000 / kBlock_ms));
    const std::int64_t end_ms = *start_ms() + duration_ms + kAfter_ms;
    if (t_ms > end_ms) {
      for (int i = 0; i < kFingers; ++i) from_deg_[place(i)] = at(i, end_ms);
      begin(end_ms);
    }
  }
  return at(finger, t_ms);
}

}  // namespace flexor::twin
