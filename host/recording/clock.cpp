#include "host/recording/clock.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <span>

#include "host/io/io.hpp"
#include "host/recording/sensor_lag.hpp"
#include "host/recording/time.hpp"

namespace flexor::recording {
namespace {

constexpr double kSameClock_s = 0.5;
constexpr double kLeastConfidence = 1e-3;
constexpr int kMostRounds = 4;

struct Estimate {
  Alignment alignment;
  const Witness* witness = nullptr;

  double error_s() const { return alignment.clock_offset_se_s.value_or(kVelocityError_s); }
  double weight() const { return std::max(alignment.confidence, kLeastConfidence) / (error_s() * error_s()); }
};

double confidence_of(const Estimate& o) { return o.alignment.confidence; }

// Of each angle the surest; throws io::JobError where none has one, unless the offset is known.
std::vector<Estimate> estimates_of(const std::vector<Witness>& witnesses, bool known) {
  std::map<std::string, Estimate> of_angles;
  std::string reason = "no reading of its sensors is valid";
  for (const Witness& w : witnesses) {
    if (w.reading.value.size() < 2) continue;
    try {
      const Estimate one{align(w.reading, w.reference->series(w.column)), &w};
      const auto [at, fresh] = of_angles.emplace(w.column, one);
      if (!fresh && confidence_of(at->second) < confidence_of(one)) at->second = one;
    } catch (const io::JobError& error) {
      reason = w.name.empty() ? error.what() : fmt::format("{}: {}", w.name, error.what());
    }
  }
  if (of_angles.empty() && !known) throw io::JobError(reason);
  std::vector<Estimate> out;
  for (auto& [column, one] : of_angles) out.push_back(std::move(one));
  return out;
}

std::vector<Estimate> one_of_each_sensor(const std::vector<Estimate>& of_angles) {
  std::map<std::size_t, std::vector<Estimate>> of_sensors;
  for (const Estimate& o : of_angles) of_sensors[o.witness->sensor].push_back(o);
  std::vector<Estimate> out;
  for (const auto& [sensor, estimates] : of_sensors) {
    Estimate& one = out.emplace_back(*std::ranges::max_element(estimates, {}, confidence_of));
    if (estimates.size() == 1) continue;
    std::vector<Series> angles;
    double velocities_s = 0;
    for (const Estimate& o : estimates) {
      angles.push_back(o.witness->reference->series(o.witness->column));
      velocities_s += (o.alignment.clock_offset_s - o.alignment.sensor_lag_s.value_or(0)) /
                      static_cast<double>(estimates.size());
    }
    const auto found = sensor_lag(one.witness->reading, angles, velocities_s, one.alignment.drift_ppm);
    if (!found) continue;
    one.alignment.clock_offset_s = found->clock_offset_s;
    one.alignment.clock_offset_se_s = found->standard_error_s;
    one.alignment.drift_ppm = found->drift_ppm;
    one.alignment.drift_se_ppm = found->drift_se_ppm;
  }
  return out;
}

Clock agreed(const std::vector<Estimate>& estimates) {
  Clock out;
  double all = 0;
  double of_drift = 0;
  for (const Estimate& o : estimates) {
    all += o.weight();
    out.offset_s += o.weight() * o.alignment.clock_offset_s;
    if (!o.alignment.drift_se_ppm) continue;
    const double weight = 1 / (*o.alignment.drift_se_ppm * *o.alignment.drift_se_ppm);
    of_drift += weight;
    out.drift_ppm += weight * *o.alignment.drift_ppm;
  }
  out.offset_s /= all;
  if (of_drift > 0) out.drift_ppm /= of_drift;
  if (of_drift > 0) out.drift_se_ppm = 1 / std::sqrt(of_drift);
  double squares = 0;
  for (const Estimate& o : estimates) {
    const double error_s =
        o.weight() * std::max(o.error_s(), std::abs(o.alignment.clock_offset_s - out.offset_s));
    squares += error_s * error_s;
    // No more than the surest: fingers of one hand repeat themselves together.
    out.confidence = std::max(out.confidence, confidence_of(o));
    if (o.alignment.drift_se_ppm)
      out.drift_se_ppm = std::max(out.drift_se_ppm, std::abs(*o.alignment.drift_ppm - out.drift_ppm) / 2);
  }
  out.standard_error_s = std::sqrt(squares) / all;
  return out;
}

Clock given_clock(double offset_s, const std::vector<Estimate>& estimates, const Clock& found,
                  std::vector<std::string>& warnings) {
  Clock out{offset_s, 0, 0, found.drift_ppm, found.drift_se_ppm};
  std::optional<std::string> disagrees;
  for (const Estimate& o : estimates) {
    if (!disagrees) disagrees = disagreement(offset_s, o.alignment);
    if (std::abs(o.alignment.clock_offset_s - offset_s) < kSameClock_s)
      out.confidence = std::max(out.confidence, confidence_of(o));
  }
  if (disagrees) warnings.push_back(*disagrees);
  return out;
}

bool has_dates(std::span<const double> t_s) { return !t_s.empty() && t_s.front() >= kFirstEpoch_s; }

}  // namespace

Clock find_clock(const std::vector<Witness>& witnesses, std::optional<double> given, bool is_common,
                 std::vector<std::string>& warnings) {
  std::set<Recording*> references;
  for (const Witness& w : witnesses) references.insert(w.reference);
  double taken_out_ppm = 0;
  for (int round = 1;; ++round) {
    const std::vector<Estimate> estimates = estimates_of(witnesses, given.has_value());
    const auto surest_at = std::ranges::max_element(estimates, {}, confidence_of);
    const double near_s = given ? *given : surest_at->alignment.clock_offset_s;
    std::vector<Estimate> same = estimates;
    std::erase_if(same, [&](const Estimate& o) {
      return std::abs(o.alignment.clock_offset_s - near_s) > kSameClock_s;
    });
    Clock clock = same.empty() ? Clock{} : agreed(one_of_each_sensor(same));
    if (round == kMostRounds || is_common || !is_clear(clock.drift_ppm, clock.drift_se_ppm)) {
      clock.drift_ppm = taken_out_ppm;
      const auto jumps = [](const Estimate& o) { return o.alignment.jump.has_value(); };
      const auto first = std::ranges::find_if(estimates, jumps);
      if (given && !is_common && first != estimates.end()) warnings.push_back(*first->alignment.jump);
      if (given) return given_clock(*given, estimates, clock, warnings);
      clock.surest = surest_at->alignment;
      // Dates of both files are mostly of one computer.
      if (has_dates(witnesses.front().reading.t_s) && has_dates(witnesses.front().reference->t_s) &&
          taken_out_ppm == 0 && std::abs(clock.offset_s) < clock.standard_error_s) {
        clock.surest->warnings.push_back(fmt::format(
            "both files have dates, and the signals ({:+.3f} +- {:.3f} s) agree with them: one clock",
            clock.offset_s, clock.standard_error_s));
        clock.offset_s = clock.surest->clock_offset_s = 0;
      }
      warnings.insert(warnings.end(), clock.surest->warnings.begin(), clock.surest->warnings.end());
      if (clock.confidence < kUnsure)
        warnings.push_back(
            fmt::format("the clock offset of {:+.2f} s is unsure (confidence {:.2f}): are these recordings "
                        "of one motion?",
                        clock.offset_s, clock.confidence));
      return clock;
    }
    taken_out_ppm += clock.drift_ppm;
    for (Recording* reference : references) {  // as the other clock would have counted from the first time on
      const double first_s = reference->t_s.front();
      for (double& t : reference->t_s) t = first_s + (t - first_s) / (1 + 1e-6 * clock.drift_ppm);
    }
  }
}

}  // namespace flexor::recording
