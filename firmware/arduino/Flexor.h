// A glove on any board of the Arduino IDE: analogRead and a serial port are all that it asks for.
//
//   FlexorGlove glove;
//   void loop() {                                  // every FlexorGlove::kPeriod_ms
//     for (uint8_t i = 0; i < 5; ++i) counts[i] = analogRead(pins[i]);   // of 10 bits
//     glove.step(counts);                          // glove.angle_deg(1): the index finger's
//     glove.send(Serial1);                         // to the hand's radio, or to a VR driver
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
#ifdef FLEXOR_OUTPUT_OPENGLOVES

// Lines for VR drivers.
class FlexorOutput {
 public:
  template <class Port>
  void listen(Port& port) {
    while (port.available() > 0) asked_ = port.read() == 'Z' || asked_;  // which glove this is
  }

  // joystick: x and y of 10 bits; pressed: of flexor::link::glove_button.
  template <class Port>
  void send(Port& port, const flexor::link::Frame& frame, const uint16_t*, const int16_t* joint_angles,
            const uint16_t* joystick, uint8_t pressed) {
    char text[Text::kRoom];
    uint8_t size = 0;
    if (asked_) {
      size = flexor::link::encode_glove_information(1, flexor::config::kRightHand, text);
    } else {
      size = text_.step(frame, joint_angles, joystick, pressed, text);
    }
    asked_ = false;
    port.write(reinterpret_cast<const uint8_t*>(text), size);
  }

 private:
  using Text = flexor::glove::GloveText<flexor::config::kJoints>;
  bool asked_ = false;
  Text text_{flexor::config::kFlexion, flexor::config::kJoint, flexor::config::kJoints, flexor::config::kThere};
};

#else

#include "runtime/link/glove_speech.hpp"
#include "runtime/link/key_record.hpp"

// Frames for the hand's radio, in turns with the hand, as the glove's own firmware sends them. With a damaged key it is
// silent for good.
class FlexorOutput {
 public:
  FlexorOutput() : speech_(load_key()) {}

  template <class Port>
  void listen(Port& port) {
    flexor::link::NoModels models;
    while (port.available() > 0) speech_.push(static_cast<uint8_t>(port.read()), models);
  }

  template <class Port>
  void send(Port& port, flexor::link::Frame& frame, const uint16_t* counts, const int16_t*, const uint16_t*, uint8_t) {
    if (!key_is_whole_ || ++since_frame_ < flexor::config::kSamplesPerFrame) return;
    since_frame_ = 0;
    Board<Port> board = {port};
    speech_.speak(frame, counts, board);
  }

 private:
  template <class Port>
  struct Board {
    Port& port;
    uint8_t reset_cause() const { return 0; }
    uint32_t uptime_s() const { return millis() / 1000; }
    void send(flexor::link::Type, const uint8_t* wire, uint8_t bytes) { port.write(wire, bytes); }
  };
  using Turns =
      flexor::link::GloveTurns<flexor::config::kListenEvery, flexor::config::kSeekEvery, flexor::config::kListenSlots>;

  const flexor::link::Key* load_key() {
    key_is_whole_ = flexor::link::load(&flexor::config::kKeyRecord, key_);
    return flexor::link::is_plain(key_) ? nullptr : &key_;
  }

  bool key_is_whole_ = false;
  flexor::link::Key key_ = {};
  flexor::link::GloveSpeech<Turns, flexor::config::kRate_hz / flexor::config::kSamplesPerFrame> speech_;
  uint8_t since_frame_ = flexor::config::kSamplesPerFrame - 1;
};

#endif

class FlexorGlove {
 public:
  static constexpr uint8_t kFingers = flexor::glove::kFingers;  // thumb to pinky
  static constexpr uint16_t kPeriod_ms = 1000 / flexor::config::kRate_hz;

  FlexorGlove() : chain_(flexor::config::kChannels, compensator_) {}

  // A sample: kFingers readings of 10 bits, 0 to 1023, thumb to pinky, kPeriod_ms after the last ones.
  void step(const uint16_t* counts) {
    for (uint8_t i = 0; i < kFingers; ++i) counts_[i] = counts[i];
    chain_.step(counts, frame_);
    frame_.time_ms = static_cast<uint16_t>(frame_.time_ms + kPeriod_ms);
  }

  // A sixteenth of a degree as the hand gets it; at rest while its sensor is broken.
  int16_t angle_sixteenths(uint8_t finger) const { return frame_.angle[finger]; }
  float angle_deg(uint8_t finger) const { return frame_.angle[finger] / 16.0f; }
  bool is_ok(uint8_t finger) const { return frame_.status[finger] == flexor::link::SensorStatus::ok; }

  // After each step(): what is to be said now, if anything. To the hand's radio at the rate of its configuration, or lines
  // for VR drivers at 115200 baud, as the library was deployed.
  template <class Port>
  void send(Port& port, uint8_t pressed = 0, uint16_t joystick_x = 512, uint16_t joystick_y = 512) {
    listen(port);
    const uint16_t joystick[2] = {joystick_x, joystick_y};
    output_.send(port, frame_, counts_, compensator_.angle + kFingers, joystick, pressed);
  }

  // Hears the other side: more often than step() where the serial port's buffer is small.
  template <class Port>
  void listen(Port& port) {
    output_.listen(port);
  }

 private:
  flexor::GloveCompensator compensator_;
  flexor::glove::SignalChain<flexor::GloveCompensator> chain_;
  flexor::link::Frame frame_ = {};
  uint16_t counts_[kFingers] = {};
  FlexorOutput output_;
};

#pragma pop_macro("abs")
#pragma pop_macro("max")
#pragma pop_macro("min")
#pragma pop_macro("round")
