#include "host/twin/world.hpp"

#include <algorithm>

#include "host/twin/plant_step.hpp"

namespace flexor::twin {

World::World(const TrialInput& input, std::uint64_t number) : lanes_(input, number, 1) {
  for (int i = 0; i < kFingers; ++i)
    potentiometer_[lanes_.at(i)] = detail::read_potentiometer(lanes_.constants, lanes_.x, i);
}

void World::settle() {
  PlantState<kFingers>& x = lanes_.x;
  for (int i = 0; i < kFingers; ++i) x.slipped[i] = x.visco[i] = x.creep[i] = x.reference[i];
}

void World::begin_step() {
  if ((now_ms_ - kStart_ms) % kBlock_ms != 0) return;
  lanes_.begin_block(now_ms_, [this](int finger, std::int64_t t_ms) {
    return finger_at ? finger_at(finger, t_ms) : lanes_.angle(lanes_.input.motion, finger, t_ms);
  });
}

void World::command(const std::array<std::int16_t, kFingers>& angle_q4) {
  std::ranges::copy(angle_q4, lanes_.x.command);
}

void World::step() {
  begin_step();
  advance(lanes_.constants, lanes_.x);
  end_step();
}

void World::step(const std::array<std::int16_t, kFingers>& duty) {
  begin_step();
  for (int i = 0; i < kFingers; ++i) {
    detail::move_glove(lanes_.constants, lanes_.x, i);
    detail::move_hand(lanes_.constants, lanes_.x, i, duty[lanes_.at(i)]);
    potentiometer_[lanes_.at(i)] = detail::read_potentiometer(lanes_.constants, lanes_.x, i);
  }
  end_step();
}

}  // namespace flexor::twin
