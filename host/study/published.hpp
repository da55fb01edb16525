// The article's figures, and how far others are from them.
#pragma once

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "host/io/io.hpp"

namespace flexor::study {

inline constexpr double kPublishedRate_hz = 10;
inline constexpr std::size_t kPublishedTrials = 3;
inline constexpr int kLastFittedGesture = 4;  // 1 to 4 have published trials, to which the twin is fitted
inline constexpr int kLastGesture = 6;
const std::vector<std::string>& published_compensators();

// The article's average of three trials: gesture 1 to 6; "raw", "published-w", "published-hw".
std::optional<double> published_error_deg_s(int gesture, const std::string& compensator);

// The three trials themselves; throws io::InputError for what is not in the article.
std::array<double, kPublishedTrials> published_trials_deg_s(int gesture, const std::string& compensator);

// Root mean square of ln(ours / published), over whatever is added.
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

// What knows nothing of the laboratory: one constant for each compensator, whatever the gesture.
//   constant(c) = geometric mean over gestures 1 to 4 of the published average of c
// which is the constant with the smallest rms of ln(constant / published) there. A twin whose distance from
// the published table is no smaller distinguishes the gestures no better than a constant does.
// "error_deg_s" by compensator; its distance from the article, "log_rms_gestures_1_to_4" 0.255, "log_rms_gestures_5_and_6" 0.437.
Json null_model();

}  // namespace flexor::study
