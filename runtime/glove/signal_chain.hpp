// From five ADC readings to what a frame carries: calibration, monitor, tracker, compensator, guard. The same code on the
// glove and on a PC.
#pragma once

#include "runtime/glove/follower.hpp"
#include "runtime/link/messages.hpp"
#include "runtime/sensor/calibration.hpp"
#include "runtime/sensor/guard.hpp"
#include "runtime/sensor/monitor.hpp"
#include "runtime/sensor/zero.hpp"

namespace flexor {
namespace glove {

using link::kFingers;

struct ChannelSettings {
  const sensor::Calibration* calibration;  // in flash on the microcontroller
  sensor::MonitorSettings monitor;
  sensor::GuardSettings guard;
  uint8_t sensors;      // a bit for each sensor that the finger's angle needs
  sensor::Poses poses;  // of the sensor
};

// Compensator: int16_t alpha[kFingers] in, int16_t angle[kFingers] out, and step(). It keeps an angle whose readings it does
// not take, and so does the finger as long as its sensors live: a reading beyond those that the model was made from is another
// hand's, or a sensor's that has drifted. A stuck reading is reported and not tracked, and its finger stays where it is: a quiet
// potentiometer on a hand that grips reads the same for minutes.
template <class Compensator, class Sensors = NotFollowed>
class SignalChain {
 public:
  // `settings`: kFingers of them, which outlive this object.
  SignalChain(const ChannelSettings* settings, Compensator& compensator, const Sensors& sensors = Sensors())
      : settings_(settings), compensator_(compensator), sensors_(sensors) {
    for (sensor::Correction& c : correction_) c = sensor::kUncorrected;
    restart();
  }

  // What a zeroed glove adds to the calibration of each sensor.
  sensor::Correction* corrections() { return correction_; }

  Sensors& sensors() { return sensors_; }

  // They have changed: what was followed on top of the old ones is no more.
  void zeroed() { sensors_.reset(); }

  // All fingers at rest, as after a start.
  void restart() {
    for (uint8_t i = 0; i < kFingers; ++i) guard_[i].reset(settings_[i].guard);
  }

  // counts -> frame.angle and frame.status.
  void step(const uint16_t* counts, link::Frame& frame) {
    sensors_.next_sample();
    for (uint8_t i = 0; i < kFingers; ++i) {
      const sensor::Health health = monitor_[i].step(settings_[i].monitor, counts[i]);
      const int16_t alpha = correction_[i]((*settings_[i].calibration)(counts[i]));
      compensator_.alpha[i] = sensors_.step(i, alpha, health == sensor::Health::ok);
      frame.status[i] = static_cast<link::SensorStatus>(health);
    }
    uint8_t bad = 0;
    for (uint8_t i = 0; i < kFingers; ++i) {
      const link::SensorStatus status = frame.status[i];
      if (status == link::SensorStatus::open || status == link::SensorStatus::short_circuit)
        bad = static_cast<uint8_t>(bad | 1 << i);
    }
    compensator_.step();
    for (uint8_t i = 0; i < kFingers; ++i) {
      const uint8_t sensors = settings_[i].sensors;
      const bool alive = sensors != 0 && (sensors & bad) == 0;
      frame.angle[i] = guard_[i].step(settings_[i].guard, alive, compensator_.angle[i]);
    }
  }

 private:
  const ChannelSettings* settings_;
  Compensator& compensator_;
  Sensors sensors_;
  sensor::Correction correction_[kFingers];
  sensor::Monitor monitor_[kFingers];
  sensor::Guard guard_[kFingers];
};

}  // namespace glove
}  // namespace flexor
