#include "host/twin/plant.hpp"

#include <cmath>
#include <numbers>

#include "host/twin/plant_step.hpp"

// The widest vectors that the processor has, chosen at start-up. Contraction into fused operations is off for
// this room: the bits are the same with each.
#if defined(__x86_64__) && defined(__ELF__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__)
#define FLEXOR_VECTOR_CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define FLEXOR_VECTOR_CLONES
#endif

namespace flexor::twin {
namespace {

constexpr double kDegPerRad = 180 / std::numbers::pi;
constexpr double kByteSumDeviation = 147.7915;  // sqrt(4 (256^2 - 1) / 12)

float narrow(double v) { return static_cast<float>(v); }

}  // namespace

PlantConstants::PlantConstants(const Parameters& p) {
  const double h = kStep_s;
  const double inertia = p.inertia_mNms2();
  slip_deg = narrow(p.slip_deg);
  visco_rate = narrow(h / (p.visco_s + h));
  creep_rate = narrow(h / (p.creep_s + h));
  visco_share = narrow(p.visco_share);
  creep_share = narrow(p.creep_share);
  amp_per_duty = narrow(p.motor_V / p.resistance_ohm / hand::kFullDuty);
  amp_per_deg_s = narrow(p.back_emf_Vs() / p.resistance_ohm / kDegPerRad);
  current_limit_A = narrow(p.current_limit_A);
  deg_s_per_amp = narrow(p.torque_mNm_A() * h / inertia * kDegPerRad);
  deg_s_per_mNm = narrow(h / inertia * kDegPerRad);
  viscous = narrow(1 / (1 + h * p.viscous_mNms_rad / inertia));
  coulomb_deg_s = narrow(h * p.coulomb_mNm / inertia * kDegPerRad);
  backlash_deg = narrow(p.backlash_deg);
  give_deg = p.stop_stiffness_mNm_deg > 0 ? kGive_deg : 0;
  stop_mNm_per_deg = narrow(p.stop_stiffness_mNm_deg);
  stop_mNm_per_deg_s = narrow(p.stop_damping_mNms_deg);
  counts_per_deg = narrow(1023 / p.potentiometer_range_deg);
  q4_per_count = narrow(16 * p.potentiometer_range_deg / 1023);
  noise_counts = narrow(p.potentiometer_noise_deg * 1023 / p.potentiometer_range_deg / kByteSumDeviation);
  loop = {};
  loop.max_step =
      static_cast<std::int32_t>(std::lround(std::min(p.loop_speed_deg_s * h, 1000.0) * (1 << 20)));
  loop.proportional = static_cast<std::int16_t>(std::lround(p.loop_proportional_per_deg * hand::kFullDuty));
  loop.integral =
      static_cast<std::int16_t>(std::lround(p.loop_integral_per_deg_s * h * hand::kFullDuty * 256));
  loop.lower = static_cast<std::int16_t>(std::lround(16 * p.loop_lower_deg));
  loop.upper = static_cast<std::int16_t>(std::lround(16 * p.loop_upper_deg));
  loop.integral_limit = static_cast<std::int32_t>(std::lround(p.loop_integral_limit * hand::kFullDuty * 256));
  loop.feed_forward =
      static_cast<std::int16_t>(std::lround(p.loop_feed_forward_s_per_deg / h * hand::kFullDuty));
  loop.duty_limit = static_cast<std::int16_t>(std::lround(p.loop_duty * hand::kFullDuty));
}

FLEXOR_VECTOR_CLONES void advance(const PlantConstants& c, PlantState<80>& x) { detail::advance(c, x); }
FLEXOR_VECTOR_CLONES void advance(const PlantConstants& c, PlantState<40>& x) { detail::advance(c, x); }

}  // namespace flexor::twin
