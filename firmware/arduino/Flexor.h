// A glove on any board of the Arduino IDE: analogRead and a serial port are all that it asks for.
//
//   #include <glove_data.h>                        // of flexor deploy: settings, key and model
//   FlexorGlove glove(kFlexorSettings, kFlexorKey, kFlexorModel, sizeof(kFlexorModel));
//   void loop() {                                  // every glove.period_ms()
//     for (uint8_t i = 0; i < 5; ++i) counts[i] = analogRead(pins[i]);   // of 10 bits
//     glove.step(counts);                          // glove.angle_deg(1): the index finger's
//     glove.send(Serial1);                         // to the hand's radio, or to a VR driver
//   }
// On a board with a file system the model may come from a file: the bytes of a model block, in RAM. Nothing has to outlive a
// restart on this side: the hand challenges again (src/runtime/link).
#pragma once

#include <Arduino.h>
#ifdef __AVR__
#include <avr/pgmspace.h>
#endif
#ifndef PROGMEM
#define PROGMEM
#endif

// Names that Arduino.h takes for macros on some boards.
#pragma push_macro("abs")
#undef abs
#pragma push_macro("max")
#undef max
#pragma push_macro("min")
#undef min
#pragma push_macro("round")
#undef round

#include "runtime/glove/block_model.hpp"
#include "runtime/glove/glove_text.hpp"
#include "runtime/glove/plain_text.hpp"
#include "runtime/glove/settings.hpp"
#include "runtime/glove/signal_chain.hpp"
#include "runtime/link/glove_sender.hpp"
#include "runtime/link/key_record.hpp"

class FlexorGlove {
 public:
  static constexpr uint8_t kFingers = flexor::link::kFingers;  // thumb to pinky

  // settings, key, model: blocks as flexor deploy writes them, in flash on an AVR; they outlive this object. Without a model
  // that fits them every finger rests and is not ok().
  FlexorGlove(const uint8_t* settings, const uint8_t* key, const uint8_t* model, uint16_t model_bytes)
      : head_(head_of(settings)),
        key_is_whole_(flexor::link::load(reinterpret_cast<const flexor::link::KeyRecord*>(key), key_)),
        chain_(channels_, compensator_),
        sender_(flexor::link::is_plain(key_) ? nullptr : &key_, {head_.listen_every, head_.seek_every, head_.listen_slots},
                static_cast<uint8_t>(head_.rate_hz / head_.samples_per_frame), head_.has_room != 0),
        plain_(head_.output == flexor::glove::Output::log, head_.period_ms),
        since_frame_(static_cast<uint8_t>(head_.samples_per_frame - 1)) {
    const auto* const all = reinterpret_cast<const flexor::glove::Settings*>(settings);
    for (uint8_t i = 0; i < kFingers; ++i) {
      channels_[i].calibration = &all->calibration[i];
      channels_[i].monitor = {0, 0, head_.rail_samples, head_.stuck_samples};
      channels_[i].guard = {0, head_.max_step, head_.hold_samples};
    }
    const flexor::compensator::MadeFor made_for = {head_.calibration_id, head_.rate_hz};
    compensator_.load(model, model_bytes, made_for, channels_);
    chain_.restart();
  }

  uint16_t period_ms() const { return head_.period_ms; }

  // A sample: kFingers readings of 10 bits, 0 to 1023, thumb to pinky, period_ms() after the last ones.
  void step(const uint16_t* counts) {
    for (uint8_t i = 0; i < kFingers; ++i) counts_[i] = counts[i];
    chain_.step(counts, frame_);
    frame_.time_ms = static_cast<uint16_t>(frame_.time_ms + head_.period_ms);
  }

  // A sixteenth of a degree as the hand gets it; at rest while its sensor is broken.
  int16_t angle_sixteenths(uint8_t finger) const { return frame_.angle[finger]; }
  float angle_deg(uint8_t finger) const { return frame_.angle[finger] / 16.0f; }
  bool is_ok(uint8_t finger) const { return frame_.status[finger] == flexor::link::SensorStatus::ok; }

  // After each step(): what is to be sent now, if anything, as the settings state. Frames for the hand's radio at its rate, or
  // lines at 115200 baud, for VR drivers or for people. pressed: of flexor::link::glove_button. With a damaged key no frame
  // ever leaves.
  template <class Port>
  void send(Port& port, uint8_t pressed = 0, uint16_t joystick_x = 512, uint16_t joystick_y = 512) {
    listen(port);
    if (++since_frame_ < head_.samples_per_frame) return;
    since_frame_ = 0;
    if (head_.output == flexor::glove::Output::radio) {
      Board<Port> board = {port};
      if (key_is_whole_) sender_.send_frame(frame_, counts_, board);
      return;
    }
    char text[flexor::glove::GloveText::kRoom];
    const uint16_t joystick[2] = {joystick_x, joystick_y};
    uint8_t size = 0;
    if (head_.output != flexor::glove::Output::opengloves) {
      size = plain_.step(frame_, counts_, text);
    } else if (asked_) {
      size = flexor::link::encode_glove_information(1, (head_.vr & flexor::glove::kRightHand) != 0, text);
      asked_ = false;
    } else {
      const flexor::sensor::GuardSettings guard = {0, head_.max_step, head_.hold_samples};
      size = vr_.step(compensator_, frame_, guard, joystick, pressed, text);
    }
    port.write(reinterpret_cast<const uint8_t*>(text), size);
  }

  // Reads what the other side sends: more often than step() where the serial port's buffer is small.
  template <class Port>
  void listen(Port& port) {
    flexor::link::NoModels models;
    while (port.available() > 0) {
      const uint8_t byte = static_cast<uint8_t>(port.read());
      if (head_.output == flexor::glove::Output::radio) sender_.push(byte, models);
      if (byte == 'Z') asked_ = true;  // a VR driver: which glove this is
    }
  }

 private:
  template <class Port>
  struct Board {
    Port& port;
    uint8_t reset_cause() const { return 0; }
    uint32_t uptime_s() const { return millis() / 1000; }
    void send(flexor::link::Type, const uint8_t* wire, uint8_t bytes) { port.write(wire, bytes); }
  };

  static flexor::glove::SettingsHead head_of(const uint8_t* settings) {
    flexor::glove::SettingsHead head;
    uint8_t* to = reinterpret_cast<uint8_t*>(&head);
    for (uint8_t i = 0; i < sizeof(head); ++i) to[i] = flexor::core::Flash::byte(settings + i);
    return head;
  }

  flexor::glove::SettingsHead head_;
  flexor::link::Key key_ = {};
  bool key_is_whole_;
  flexor::glove::ChannelSettings channels_[kFingers] = {};
  using Model = flexor::glove::BlockModel<flexor::core::Flash, flexor::glove::kLibraryArenaBytes>;
  Model compensator_;
  flexor::glove::SignalChain<Model> chain_;
  flexor::link::Frame frame_ = {};
  uint16_t counts_[kFingers] = {};
  flexor::link::GloveSender sender_;
  flexor::glove::PlainText plain_;
  flexor::glove::GloveText vr_;
  uint8_t since_frame_;
  bool asked_ = false;
};

#pragma pop_macro("abs")
#pragma pop_macro("max")
#pragma pop_macro("min")
#pragma pop_macro("round")
