// One trial with the electronics left out: fingers, cloth, sensors and potentiometers that somebody reads,
// motors that somebody drives, cameras that look on. The co-simulation puts the boards in between.
//
// The same equations and draws as simulate(): a trial has the same person, glove and hand whichever way it is
// run.
#pragma once

#include <functional>

#include "host/twin/lanes.hpp"

namespace flexor::twin {

class World {
 public:
  // Rest in the first pose before t = 0: time for boards to start.
  static constexpr std::int64_t kStart_ms = -2000;

  // `input` outlives the world.
  World(const TrialInput& input, std::uint64_t trial);

  std::int64_t now_ms() const { return now_ms_; }
  std::int64_t end_ms() const { return lanes_.end_ms; }

  // An instant at which simulate() samples this trial's glove; the others are whole periods away.
  double sample_phase_s() const { return lanes_.phase_s[0]; }

  // ADC counts of the sensor; one call a sample and finger.
  int glove_counts(int finger, double t_s) { return lanes_.sample(finger, t_s); }

  // ADC counts of the potentiometer over the next step.
  int potentiometer_counts(int finger) const { return potentiometer_[static_cast<std::size_t>(finger)]; }

  // Where the fingers are, instead of in the input's motion: degrees at a time, asked for each block's end.
  std::function<double(int finger, std::int64_t t_ms)> finger_at;

  // A sensor moves on its finger: degrees of bend beside what the donning drew, until the next call.
  void shift_sensor(int finger, double bend_deg) {
    lanes_.sensor[static_cast<std::size_t>(finger)].shift(bend_deg);
  }

  // The rest before a trial, in no time: what creeps has crept, and the cloth is where the finger is.
  void settle();

  // One millisecond with these duties, each as hand::step gives it.
  void step(const std::array<std::int16_t, kFingers>& duty);
  // One millisecond in which the hand's own loops follow the newest command, Q4 degrees.
  void step();
  void command(const std::array<std::int16_t, kFingers>& angle_q4);

  double finger_deg(int finger) const { return static_cast<double>(lanes_.x.reference[finger]); }
  double joint_deg(int finger) const { return static_cast<double>(lanes_.x.joint[finger]); }
  // Of the motor, behind the gear.
  double speed_deg_s(int finger) const { return static_cast<double>(lanes_.x.speed[finger]); }

  // How long a motor has pressed against a stop so far; see plant.hpp.
  int pressed_ms(int finger) const { return lanes_.x.pressed_ms[finger]; }

  // The loop's integral after person.rest_s of this command in the first pose, as LoopState has it.
  std::int32_t settled_integral(int finger, std::int16_t command_q4) const {
    return lanes_.settled_integral(finger, command_q4);
  }

  // The cameras begin again, and have seen that.
  void film(std::int64_t start_ms, double duration_s) { lanes_.film(start_ms, duration_s); }
  const Trial& seen() const { return lanes_.trials.front(); }
  // What the cameras saw; the world is over.
  Trial finish() { return std::move(lanes_.finish().front()); }

 private:
  void begin_step();
  void end_step() { lanes_.look(now_ms_++); }

  std::int64_t now_ms_ = kStart_ms;
  std::array<int, kFingers> potentiometer_{};
  Lanes<1> lanes_;
};

}  // namespace flexor::twin
