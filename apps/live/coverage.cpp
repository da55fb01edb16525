#include "apps/live/coverage.hpp"

#include <algorithm>
#include <cmath>

#include "host/io/numbers.hpp"

namespace flexor::live {
namespace {

constexpr double kStep_s = 0.05;
constexpr double kBends = 3;
constexpr double kSlow_s = 6;
constexpr double kQuick_s = 1;
constexpr double kHolds = 3;
constexpr double kEnd = 0.2;                // of the span: so near to an end is at it
constexpr double kApart = 0.12;             // of the span, of two holds
constexpr double kStill = 0.04;             // spans a second
constexpr double kSlowest = 0.5;            // likewise, the quickest of what is slow
constexpr double kOverNoise = 8;            // a span that is no more than so many times the noise is none
constexpr std::size_t kWindow = 5;          // steps over which a speed is taken
constexpr std::size_t kHold = 20;           // steps, a second
constexpr std::size_t kLongest = 20 * 600;  // steps that are kept, ten minutes

// From second differences of which most are noise; of rounding to whole counts too.
double noise_of(const std::vector<float>& v) {
  std::vector<double> d;
  for (std::size_t i = 2; i < v.size(); ++i) d.push_back(std::abs(v[i] - 2.0 * v[i - 1] + v[i - 2]));
  if (d.empty()) return 0;
  return io::median(std::move(d)) / (0.6745 * std::sqrt(6.0));
}

// 0 at the lower end of the span, 1 at the upper one; empty: it did not move.
std::vector<double> in_spans(const std::vector<float>& v) {
  if (v.size() < kHold) return {};
  std::vector<float> sorted = v;
  std::ranges::sort(sorted);
  const auto at = [&](double share) {
    return static_cast<double>(
        sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))]);
  };
  const double low = at(0.02);
  const double span = at(0.98) - low;
  if (!(span > kOverNoise * std::max(noise_of(v), 0.3))) return {};
  std::vector<double> out;
  for (const float x : v) out.push_back((x - low) / span);
  return out;
}

double bends_in(const std::vector<double>& x) {
  int ends = 0;
  int last = 0;
  for (const double v : x) {
    const int end = v < kEnd ? -1 : v > 1 - kEnd ? 1 : 0;
    if (end == 0 || end == last) continue;
    last = end;
    ++ends;
  }
  return std::max(0, ends - 1) / 2.0;
}

double holds_in(const std::vector<double>& x) {
  std::vector<double> places;
  std::size_t begin = 0;
  for (std::size_t i = 1; i < x.size(); ++i) {
    if (std::abs(x[i] - x[begin]) > kStill) begin = i;
    if (i - begin < kHold) continue;
    const bool is_new = std::ranges::none_of(places, [&](double p) { return std::abs(p - x[i]) < kApart; });
    if (is_new) places.push_back(x[i]);
  }
  return static_cast<double>(places.size());
}

const char* what_is_missing(const Covered& c) {
  return c.range == 0  ? "move"
         : c.range < 1 ? "range"
         : c.slow < 1  ? "slow"
         : c.holds < 1 ? "holds"
         : c.fast < 1  ? "fast"
                       : "";
}

Covered covered_by(const std::string& name, const std::vector<float>& readings) {
  Covered out;
  out.name = name;
  const std::vector<double> x = in_spans(readings);
  int slow = 0;
  int quick = 0;
  for (std::size_t i = kWindow; i < x.size(); ++i) {
    const double speed = std::abs(x[i] - x[i - kWindow]) / (kWindow * kStep_s);
    slow += speed > kStill && speed < kSlowest ? 1 : 0;
    quick += speed > 1 ? 1 : 0;
  }
  out.range = std::min(1.0, bends_in(x) / kBends);
  out.slow = std::min(1.0, slow * kStep_s / kSlow_s);
  out.fast = std::min(1.0, quick * kStep_s / kQuick_s);
  out.holds = std::min(1.0, holds_in(x) / kHolds);
  return out;
}

}  // namespace

Coverage::Coverage(std::vector<std::string> names) : names_(std::move(names)), kept_(names_.size()) {}

void Coverage::add(double t_s, const std::vector<double>& reading) {
  if (!begun_) due_s_ = t_s;
  begun_ = true;
  if (t_s - due_s_ > 1) due_s_ = t_s;  // a pause shows nothing
  for (; due_s_ <= t_s; due_s_ += kStep_s, ++steps_) {
    for (std::size_t i = 0; i < kept_.size() && i < reading.size(); ++i) {
      if (kept_[i].size() < kLongest && std::isfinite(reading[i]))
        kept_[i].push_back(static_cast<float>(reading[i]));
    }
  }
}

const std::vector<Covered>& Coverage::covered() const {
  if (!covered_.empty() && steps_ - covered_at_ < kHold) return covered_;
  covered_at_ = steps_;
  covered_.resize(names_.size());
  for (std::size_t i = 0; i < names_.size(); ++i) {
    Covered now = covered_by(names_[i], kept_[i]);
    // What was shown stays shown, also where a wider bend makes a smaller share of it.
    for (const auto share : {&Covered::range, &Covered::slow, &Covered::fast, &Covered::holds})
      now.*share = std::max(now.*share, covered_[i].*share);
    now.missing = what_is_missing(now);
    covered_[i] = now;
  }
  return covered_;
}

}  // namespace flexor::live
