#include "host/study/boards.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/deploy/deploy.hpp"
#include "host/deploy/pair_key.hpp"
#include "host/twin/glove.hpp"

namespace flexor::study {
namespace {

constexpr double kSafeIntegralLimit = 0.25;  // of full duty: four times the friction
constexpr double kSafeSpeed_deg_s = 400;

// Each finger's rest angle by the model; where it has no channel, the hand's lower limit.
std::array<double, kFingers> rests(const twin::Parameters& p, const model::Model& model) {
  std::array<double, kFingers> out = p.hand_lower_deg;
  const auto channels = deploy::channels_of(model);
  for (std::size_t i = 0; i < kFingers; ++i) {
    if (channels[i] != nullptr)
      out[i] = std::clamp(channels[i]->rest_deg, p.hand_lower_deg[i], p.hand_upper_deg[i]);
  }
  return out;
}

}  // namespace

deploy::Key bench_key() { return deploy::key_from_hex("000102030405060708090a0b0c0d0e0f"); }

deploy::Glove glove_for(const twin::Parameters& p, const model::Model& model,
                        const deploy::Calibration& calibration) {
  deploy::Glove glove;
  glove.model = model;
  glove.sensor =
      deploy::sensors_of(model, deploy::divider(p.divider_kohm, p.flat_kohm, p.kohm_per_deg), calibration);
  glove.baud = p.baud;
  glove.frame_rate_hz = p.frame_rate_hz;
  glove.key = bench_key();
  return glove;
}

deploy::Hand twin_hand(const twin::Parameters& p, const model::Model& model) {
  deploy::Hand hand;
  hand.lower_deg.fill(p.loop_lower_deg);
  hand.upper_deg.fill(p.loop_upper_deg);
  hand.rest_deg = rests(p, model);
  hand.potentiometer_range_deg = p.potentiometer_range_deg;
  hand.proportional_per_deg = p.loop_proportional_per_deg;
  hand.integral_per_deg_s = p.loop_integral_per_deg_s;
  hand.integral_limit = p.loop_integral_limit;
  hand.feed_forward_s_per_deg = p.loop_feed_forward_s_per_deg;
  hand.speed_deg_s = p.loop_speed_deg_s;
  hand.duty = p.loop_duty;
  hand.stall_s = 1e9;
  hand.baud = p.baud;
  hand.key = bench_key();
  return hand;
}

deploy::Hand safe_hand(const twin::Parameters& p, const model::Model& model) {
  deploy::Hand hand = twin_hand(p, model);
  hand.lower_deg = p.hand_lower_deg;
  hand.upper_deg = p.hand_upper_deg;
  hand.integral_limit = std::min(p.loop_integral_limit, kSafeIntegralLimit);
  hand.speed_deg_s = std::min(p.loop_speed_deg_s, kSafeSpeed_deg_s);
  hand.feed_forward_s_per_deg =
      p.torque_constant_mNm_A / 1000 * p.gear_ratio / p.motor_V * std::numbers::pi / 180;
  hand.stall_s = 0.5;
  return hand;
}

Counts gesture_counts(const twin::Parameters& p, const model::Model& model) {
  const model::Model raw = compensator("raw", 1 / model.sample_period_s).model;
  const twin::Divider divider(p);
  Counts out;
  for (const twin::Motion& motion : motions("1-6")) {
    const twin::Setup setup{p, motion, raw, 1, true};
    const twin::Trial trial = twin::simulate(setup, 0, 1).front();
    for (std::size_t k = 0; k < trial.sample_s.size(); ++k) {
      std::array<int, kFingers>& counts = out.emplace_back();
      for (std::size_t i = 0; i < kFingers; ++i) {
        // Back from alpha, which grows with the counts.
        int low = 0;
        int high = twin::kAdcTop;
        while (low < high) {
          const int middle = (low + high) / 2;
          if (divider.alpha_deg(middle) < trial.alpha_deg[i][k]) {
            low = middle + 1;
          } else {
            high = middle;
          }
        }
        counts[i] = low;
      }
    }
  }
  return out;
}

}  // namespace flexor::study
