// A glove on any board of the Arduino IDE: analogRead and a serial port are all that it asks for.
//
//   FlexorGlove glove;
//   void loop() {                                  // every FlexorGlove::kPeriod_ms
//     for (uint8_t i = 0; i < 5; ++i) counts[i] = analogRead(pins[i]);   // of 10 bits
//     glove.step(counts);                          // glove.angle_deg(1): the index finger's
//     glove.send(Serial1);                         // to the hand's radio
//   }
// Model, calibration and key are in glove_config.hpp, which flexor deploy wrote. Nothing has to outlive a restart on this
// side: the hand asks whom it believes anew (src/runtime/link).
#pragma once

#include <Arduino.h>

// Names that Arduino.h takes for macros on some boards.
#pragma push_macro("abs")
#undef abs
#pragma push_macro("max")
#undef max
#pragma push_macro("min")
#undef min
#pragma push_macro("round")
#undef round

#include "firmware/board.hpp"

#include "glove_config.hpp"
#include "runtime/link/glove_end.hpp"
#include "runtime/link/key_record.hpp"

class FlexorGlove {
 public:
  static constexpr uint8_t kFingers = flexor::firmware::kFingers;  // thumb to pinky
  static constexpr uint16_t kPeriod_ms = 1000 / flexor::config::kRate_hz;

  FlexorGlove() : chain_(flexor::config::kChannels, compensator_), end_(load_key()) {}

  // A sample: kFingers readings of 10 bits, 0 to 1023, thumb to pinky, kPeriod_ms after the last ones.
  void step(const uint16_t* counts) {
    chain_.step(counts, frame_);
    frame_.time_ms = static_cast<uint16_t>(frame_.time_ms + kPeriod_ms);
  }

  // A sixteenth of a degree as the hand gets it; at rest while its sensor is broken.
  int16_t angle_sixteenths(uint8_t finger) const { return frame_.angle[finger]; }
  float angle_deg(uint8_t finger) const { return frame_.angle[finger] / 16.0f; }
  bool is_ok(uint8_t finger) const { return frame_.status[finger] == flexor::link::SensorStatus::ok; }

  // To be called after each step(): hears the radio on `port`, and sends a frame when it is this board's turn. A glove with
  // a damaged key is silent.
  template <class Port>
  void send(Port& port) {
    listen(port);
    if (!key_is_whole_ || ++since_frame_ < flexor::config::kSamplesPerFrame) return;
    since_frame_ = 0;
    if (silent_ > 0) {
      --silent_;
      return;
    }
    if (!end_.in_touch()) return;
    const bool listens = ++since_listening_ >= flexor::config::kListenEvery;
    if (listens) {
      since_listening_ = 0;
      silent_ = flexor::config::kListenSlots;
    }
    uint8_t wire[flexor::link::kMaxWire];
    port.write(wire, end_.angles(frame_, listens, wire));
  }

  // Hears the hand: more often than step() where the serial port's buffer is small.
  template <class Port>
  void listen(Port& port) {
    while (port.available() > 0) end_.push(static_cast<uint8_t>(port.read()));
  }

 private:
  const flexor::link::Key* load_key() {
    key_is_whole_ = flexor::link::load(&flexor::config::kKeyRecord, key_);
    return flexor::link::is_plain(key_) ? nullptr : &key_;
  }

  bool key_is_whole_ = false;
  flexor::link::Key key_ = {};
  flexor::GloveCompensator compensator_;
  flexor::firmware::SignalChain<flexor::GloveCompensator> chain_;
  flexor::link::GloveEnd end_;
  flexor::link::Frame frame_ = {};
  uint8_t since_frame_ = flexor::config::kSamplesPerFrame - 1;
  uint8_t since_listening_ = 0;
  uint8_t silent_ = 0;
};

#pragma pop_macro("abs")
#pragma pop_macro("max")
#pragma pop_macro("min")
#pragma pop_macro("round")
