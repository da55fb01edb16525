#include "host/twin/laboratory.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexor::twin {

std::int64_t frame_ms(std::size_t frame, double rate_hz, double latency_s) {
  return std::lround((static_cast<double>(frame) / rate_hz - latency_s) * 1000);
}

Variation draw_variation(const Parameters& p, std::uint64_t trial_seed) {
  Random person(seed_of(trial_seed, Purpose::person));
  Variation v;
  v.delay_s = p.start_spread_s * person.normal();
  v.speed = std::max(0.5, p.person_speed * (1 + p.speed_spread * person.normal()));
  v.pose_share = p.pose_share;
  for (std::size_t i = 0; i < kFingers; ++i) {
    v.lower_offset_deg[i] = p.pose_spread_deg * person.normal();
    v.upper_offset_deg[i] = p.pose_spread_deg * person.normal();
  }
  return v;
}

Sensor::Sensor(const Parameters& p, int finger, double period_s, std::uint64_t seed) : p_(&p), random_(seed) {
  const auto i = static_cast<std::size_t>(finger);
  lower_deg_ = p.hand_lower_deg[i];
  range_deg_ = p.hand_upper_deg[i] - lower_deg_;
  const double spread = random_.normal();
  const double gain_spread = random_.normal();
  offset_deg_ = p.bend_lower_deg[i] / p.person_size + p.donning_spread_deg * spread;
  gain_ = (p.bend_upper_deg[i] - p.bend_lower_deg[i]) / p.person_size / range_deg_ *
          (1 + p.donning_gain_spread * gain_spread);
  drift_deg_s_ = p.drift_deg_per_min / 60 * random_.normal();
  noise_keep_ = p.noise_s > 0 ? std::exp(-period_s / p.noise_s) : 0;
  noise_ = p.noise_deg * random_.normal();
  const double decay = std::exp(-period_s * p.flutter_damping_per_s);
  const double turn = 2 * std::numbers::pi * p.flutter_hz * period_s;
  flutter_cos_ = decay * std::cos(turn);
  flutter_sin_ = decay * std::sin(turn);
  flutter_new_ = p.flutter_deg * std::sqrt(1 - decay * decay);
  flutter_[0] = p.flutter_deg * random_.normal();
  flutter_[1] = p.flutter_deg * random_.normal();
  burst_begin_ = 1 - std::exp(-period_s * p.burst_rate_per_s);
  burst_end_ = 1 - std::exp(-period_s / p.burst_s);
  for (const Fault& fault : p.faults) {
    if (fault.finger == finger) faults_.push_back(&fault);
  }
}

double Sensor::drifted_s(double t_s) const {
  if (turns_s_ == 0) return t_s + worn_s_;
  const double phase_s = std::fmod(t_s + worn_s_, 2 * turns_s_);
  return std::min(phase_s, 2 * turns_s_ - phase_s);
}

int Sensor::sample(const Divider& divider, double t_s, double bend_deg) {
  noise_ = noise_keep_ * noise_ + p_->noise_deg * std::sqrt(1 - noise_keep_ * noise_keep_) * random_.normal();
  const double re = flutter_cos_ * flutter_[0] - flutter_sin_ * flutter_[1] + flutter_new_ * random_.normal();
  const double im = flutter_sin_ * flutter_[0] + flutter_cos_ * flutter_[1] + flutter_new_ * random_.normal();
  flutter_[0] = re;
  flutter_[1] = im;
  const double chance = random_.uniform();
  const double jump = random_.normal();
  in_burst_ = in_burst_ ? chance >= burst_end_ : chance < burst_begin_;
  const double share = (bend_deg - lower_deg_) / range_deg_;
  double theta = offset_deg_ + gain_ * (bend_deg - lower_deg_) +
                 p_->knuckle_deg * std::sin(2 * std::numbers::pi * share) + drift_deg_s_ * drifted_s(t_s) +
                 noise_ + re + shift_deg_;
  if (in_burst_) theta += p_->burst_deg * jump;
  int counts = divider.counts(theta);
  for (const Fault* fault : faults_) {
    if (t_s < fault->start_s || t_s >= fault->start_s + fault->duration_s) continue;
    if (fault->kind == FaultKind::open) counts = kAdcTop;
    if (fault->kind == FaultKind::short_circuit) counts = 0;
    if (fault->kind == FaultKind::stuck) counts = last_;
    if (fault->kind == FaultKind::loose && chance < 0.5) counts = kAdcTop;
  }
  last_ = counts;
  return counts;
}

Disturbance::Disturbance(const Parameters& p, std::uint64_t seed)
    : random_(seed),
      keep_(std::exp(-kBlock_s / p.disturbance_s)),
      new_(p.disturbance_mNm / 2 * std::sqrt(1 - keep_ * keep_)),
      bound_(p.disturbance_mNm),
      value_(std::clamp(p.disturbance_mNm / 2 * random_.normal(), -bound_, bound_)) {}

double Disturbance::next() {
  value_ = std::clamp(keep_ * value_ + new_ * random_.normal(), -bound_, bound_);
  return value_;
}

}  // namespace flexor::twin
