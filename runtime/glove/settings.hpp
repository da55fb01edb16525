// What a glove's image is given of its glove, beside the model: a block of data (core/flash_map.hpp). Whoever writes a board's
// settings writes this struct as it lies in memory, low bytes first.
#pragma once

#include "runtime/glove/follower.hpp"
#include "runtime/link/messages.hpp"
#include "runtime/sensor/calibration.hpp"
#include "runtime/sensor/zero.hpp"

namespace flexor {
namespace glove {

constexpr uint16_t kSettingsKind = 0x0100;  // version, link::BoardKind::glove
constexpr uint8_t kNoPin = 255;
constexpr uint8_t kMaxScan = 7;  // five sensors, joystick x and y
constexpr uint8_t kButtons = 5;  // the last: calibrate
constexpr uint8_t kCalibrateButton = kButtons - 1;

// Of text for VR drivers.
constexpr uint8_t kRightHand = 1;
constexpr uint8_t kFurtherJoints = 2;  // deploy::Encoding::beta

// What leaves by the UART: frames for the hand's radio, lines for VR drivers, lines of angles or of counts.
enum class Output : uint8_t { radio, opengloves, text, log };

// CRC-16 of what five sensors read in the two poses.
template <class Channel>  // with `poses`
inline uint16_t poses_id(const Channel* channel) {
  uint16_t crc = 0;
  for (uint8_t i = 0; i < link::kFingers; ++i) {
    const int16_t reading[] = {channel[i].poses.open, channel[i].poses.fist};
    for (const int16_t one : reading) {
      crc = core::crc16_add(crc, static_cast<uint8_t>(one));
      crc = core::crc16_add(crc, static_cast<uint8_t>(one >> 8));
    }
  }
  return crc;
}

struct SettingsHead {
  uint16_t kind;
  Output output;
  uint8_t rate_hz;
  uint16_t period_ms;
  uint16_t timer_top;     // of timer 1 with a clock of 250 kHz
  uint16_t uart_divisor;  // baud = 2 MHz / (divisor + 1)
  uint8_t samples_per_frame;
  uint8_t listen_every;  // link::Turns
  uint8_t seek_every;
  uint8_t listen_slots;
  uint8_t has_room;     // link::has_room()
  uint8_t vr;           // kRightHand, kFurtherJoints
  uint8_t analog_pins;  // a bit for each of A0 .. A5 that nobody reads as a digital pin
  uint8_t scan_count;
  uint8_t scan[kMaxScan];    // analog pins: thumb to pinky, then the joystick's
  uint8_t button[kButtons];  // digital pins D2 .. D12, or kNoPin
  uint8_t button_bit[kButtons];
  uint8_t rail_samples;  // sensor::MonitorSettings
  uint8_t stuck_samples;
  uint8_t samples_per_tick;  // of the tracker
  uint16_t hold_samples;     // sensor::GuardSettings
  int16_t max_step;
  TrackerSettings tracker;
  uint16_t calibration_id[link::kFingers];  // CRC-16 of each table; 0: no sensor
  uint16_t tracked_for;                     // poses_id() of the model that `tracked` was computed for
};

struct Settings {
  static constexpr uint16_t kKind = kSettingsKind;
  SettingsHead head;
  TrackedSensor tracked[link::kFingers];  // half 0: it is not followed
  sensor::Calibration calibration[link::kFingers];
};
static_assert(sizeof(SettingsHead) == 60 && sizeof(Settings) == 60 + 50 + 650, "as it lies in flash");

}  // namespace glove
}  // namespace flexor
