// The glove's board: timer 1 sets the sample rate, the ADC reads five strips, the UART speaks to the radio or
// to a PC. Pins: UART PD0, PD1; the others are in the configuration. Interrupts move samples and bytes;
// everything else happens in main, which sleeps.
#include "firmware/board.hpp"
#include "glove_config.hpp"
#include "runtime/link/glove_speech.hpp"

using namespace flexor;
using namespace flexor::firmware;
using link::kFingers;

namespace {

constexpr uint8_t kScanned = sizeof(config::kScan);

Scan<config::kScan, kScanned> counts;
volatile bool sampled = false;
Transmitter<config::kRingBytes> transmitter;

void start_sampling() {
  start_adc(config::kAnalogPins);
  TCCR1B = _BV(WGM12) | _BV(CS11) | _BV(CS10);
  OCR1A = static_cast<uint16_t>(F_CPU / 64 / config::kRate_hz - 1);
  TIMSK1 = _BV(OCIE1A);
}

GloveCompensator compensator;
#ifdef FLEXOR_TRACK
glove::SignalChain<GloveCompensator, glove::Follower<kFingers>> chain(config::kChannels, compensator,
                                                                      {config::kTracker, config::kTracked,
                                                                       config::kSamplesPerTick});
#else
glove::SignalChain<GloveCompensator> chain(config::kChannels, compensator);
#endif
link::Frame frame;

#ifdef FLEXOR_ZERO

class Zero {
 public:
  void start() { zeroing_.start(); }
  void load() { zeroing_.load(config::kChannels, chain.corrections()); }
  void sample(const uint16_t* now) {
    int16_t alpha[kFingers];
    for (uint8_t i = 0; i < kFingers; ++i) alpha[i] = (*config::kChannels[i].calibration)(now[i]);
    if (zeroing_.sample(alpha)) chain.zeroed();
  }

 private:
  Zeroing<config::ZeroConfig, kFingers> zeroing_;
};

#else

class Zero {
 public:
  void start() {}
  void load() {}
  void sample(const uint16_t*) {}
};

#endif

Zero zero;

#ifdef FLEXOR_MODEL_IN_EEPROM

// The model in EEPROM, and who sends another.
class Models {
 public:
  explicit Models(const link::Key* pair) : receiver_(pair, store_) {}

  compensator::Loaded load() {
    const compensator::Loaded loaded =
        compensator.load(eeprom_, store_, config::kBuiltIn, config::kMadeFor, config::kChannels);
    zero.load();
    return loaded;
  }
  void stir(uint16_t noise) {
    nonces_.stir(noise);
    if (stirred_ < kStirred) ++stirred_;
    if (until_offer_ > 0) --until_offer_;
  }
  // Not before there is noise in the nonce, nor again and again: anybody may ask, and an offer takes the line for
  // as long as two frames. Who sends asks again.
  void offer() {
    if (stirred_ < kStirred || until_offer_ > 0) return;
    until_offer_ = kBetweenOffers;
    nonces_.start(store_.digest(eeprom_));
    receiver_.challenge(nonces_.next());
  }
  bool take(link::PacketReader& packet) { return receiver_.take(packet, eeprom_); }
  bool busy() const { return receiver_.busy(); }
  // What is to be said; 0: nothing. A part that is whole runs from the next sample on.
  uint8_t work(uint8_t* wire) {
    if (receiver_.work(eeprom_)) receiver_.loaded(static_cast<uint8_t>(load()));
    if (!transmitter.idle()) return 0;
    return receiver_.speak({config::kRate_hz, config::kCalibrationId}, config::kImage, wire);
  }

 private:
  static constexpr uint8_t kStirred = 8;                                                     // samples
  static constexpr uint8_t kBetweenOffers = static_cast<uint8_t>(config::kRate_hz * 3 / 5);  // samples, 0.6 s

  uint8_t until_offer_ = 0;
  Eeprom eeprom_;
  glove::ModelStore<Eeprom, config::kParts> store_{config::kImage};
  glove::ModelReceiver<Eeprom, config::kParts> receiver_;
  link::NonceSource nonces_;
  uint8_t stirred_ = 0;
};

#else

class Models : public link::NoModels {
 public:
  explicit Models(const link::Key*) {}
#ifdef FLEXOR_MODEL_IN_FLASH
  void load() {
    compensator.load(config::kModelPages, config::kImage, config::kMadeFor, config::kChannels);
    zero.load();
  }
#else
  void load() { zero.load(); }
#endif
  void stir(uint16_t) {}
  bool busy() const { return false; }
  uint8_t work(uint8_t*) { return 0; }
};

#endif

#ifdef FLEXOR_OUTPUT_OPENGLOVES

volatile bool asked = false;  // which glove this is

class Output {
 public:
  static constexpr uint8_t kUart = _BV(TXEN0) | _BV(RXEN0) | _BV(RXCIE0);
  void start(uint8_t) {
    config::start_buttons();
    zero.load();
  }
  bool busy() const { return false; }
  void work() {}
  void sampled(uint16_t) {}
  void send_frame(const uint16_t*) {
    char text[Text::kRoom];
    const uint8_t size = asked ? information(text) : line(text);
    mark(Marker::frame_sealed);
    transmitter.send(reinterpret_cast<const uint8_t*>(text), size);
  }

 private:
  using Text = glove::GloveText<config::kJoints>;

  uint8_t line(char* text) {
    uint16_t joystick[2] = {link::kGloveMiddle, link::kGloveMiddle};
    if (config::kJoystick) {
      for (uint8_t i = 0; i < 2; ++i) joystick[i] = counts[static_cast<uint8_t>(kScanned - 2 + i)];
    }
    return text_.step(frame, compensator.angle + kFingers, joystick, config::pressed(), text);
  }

  static uint8_t information(char* text) {
    asked = false;
    constexpr uint16_t kLines = 1;  // version of the lines
    return link::encode_glove_information(kLines, config::kRightHand, text);
  }

  Text text_{config::kFlexion, config::kJoint, config::kJoints, config::kThere};
};

#else

Ring<64> received;

class Output {
 public:
  static constexpr uint8_t kUart = _BV(TXEN0) | _BV(RXEN0) | _BV(RXCIE0);

  void start(uint8_t reset_cause) {
    reset_cause_ = reset_cause;
    models_.load();
    chain.restart();
    speech_.start(*this);
  }
  bool busy() const { return !received.empty() || models_.busy(); }
  void sampled(uint16_t reading) {
    ++samples_;
    models_.stir(reading);
  }
  // Neither is part of main, which would keep room for the frames of both at once.
  FLEXOR_SHARED void work() {
    uint8_t byte;
    while (received.pop(byte)) speech_.push(byte, models_);
    uint8_t wire[link::kMaxWire];
    if (const uint8_t size = models_.work(wire)) transmitter.send(wire, size);
  }
  FLEXOR_SHARED void send_frame(const uint16_t* now) { speech_.speak(frame, now, *this); }

  // What the line asks of its board.
  uint8_t reset_cause() const { return reset_cause_; }
  uint32_t uptime_s() const { return samples_ / config::kRate_hz; }
  void send(link::Type type, const uint8_t* wire, uint8_t bytes) {
    if (type == link::Type::angles) mark(Marker::frame_sealed);
    transmitter.send(wire, bytes);
  }

 private:
  using Turns = link::GloveTurns<config::kListenEvery, config::kSeekEvery, config::kListenSlots>;

  static constexpr uint8_t kSlotsPerSecond = config::kRate_hz / config::kSamplesPerFrame;
  static constexpr uint32_t kBaud = F_CPU / 8 / (config::kUartDivisor + 1UL);
  link::GloveSpeech<Turns, kSlotsPerSecond, link::has_room(kBaud, kSlotsPerSecond)> speech_{
      pair_key(config::kKeyRecord)};
  Models models_{speech_.end().pair()};
  uint32_t samples_ = 0;
  uint8_t reset_cause_ = 0;
};

#endif

Output output;

}  // namespace

#ifdef FLEXOR_OUTPUT_OPENGLOVES
// The driver writes forces and line feeds, and a Z when it asks.
ISR(USART_RX_vect) {
  if (UDR0 == 'Z') asked = true;
}
#endif

ISR(TIMER1_COMPA_vect) { counts.begin(); }

ISR(ADC_vect) {
  if (counts.go_on()) sampled = true;
}

ISR(USART_UDRE_vect) { transmitter.on_ready(); }

#ifndef FLEXOR_OUTPUT_OPENGLOVES
ISR(USART_RX_vect) { received.push(UDR0); }
#endif

int main() {
  const uint8_t reset_cause = start_watchdog(WDTO_500MS);
  start_uart(config::kUartDivisor, Output::kUart);
  output.start(reset_cause);
  zero.start();
  start_sampling();
  sei();
  uint8_t since_frame = config::kSamplesPerFrame - 1;
  for (;;) {
    sleep_unless([] { return sampled || output.busy(); });
    output.work();
    if (!sampled) continue;
    sampled = false;
    wdt_reset();
    mark(Marker::sampled);
    uint16_t now[kFingers];
    for (uint8_t i = 0; i < kFingers; ++i) now[i] = counts[i];  // the next are a sample period away
    zero.sample(now);
    output.sampled(static_cast<uint16_t>(now[0] + 3 * now[1]));
    chain.step(now, frame);
    frame.time_ms = static_cast<uint16_t>(frame.time_ms + 1000 / config::kRate_hz);
    // A transmitter that is still busy skips a frame: the newest angle matters, not every one.
    if (++since_frame >= config::kSamplesPerFrame && transmitter.idle()) {
      since_frame = 0;
      output.send_frame(now);
    }
  }
}
