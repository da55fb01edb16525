// How far errors are from the published ones: the root mean square of ln(ours / published), over whatever is added.
#pragma once

#include <cmath>

namespace flexor::study {

inline constexpr int kLastFittedGesture = 4;  // 1 to 4 have published trials, to which the twin is fitted
inline constexpr int kLastGesture = 6;

class LogRms {
 public:
  void add(double ours_deg_s, double published_deg_s) {
    const double l = std::log(ours_deg_s / published_deg_s);
    squares_ += l * l;
    ++count_;
  }
  int count() const { return count_; }
  double value() const { return std::sqrt(squares_ / count_); }  // NaN of nothing

 private:
  double squares_ = 0;
  int count_ = 0;
};

}  // namespace flexor::study
