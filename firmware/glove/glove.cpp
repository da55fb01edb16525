// The glove's board: timer 1 sets the sample rate, the ADC reads the sensors, the UART speaks to the radio or to a PC. What
// it is wired to and what it sends are its settings, the compensator is a model: both are data behind this image
// (runtime/core/flash_map.hpp). Interrupts move samples and bytes; everything else happens in main, which sleeps.
#include "firmware/board.hpp"
#include "firmware/glove/zeroing.hpp"
#include "runtime/glove/glove_model.hpp"
#include "runtime/glove/glove_text.hpp"
#include "runtime/glove/model_receiver.hpp"
#include "runtime/glove/plain_text.hpp"
#include "runtime/glove/settings.hpp"
#include "runtime/link/glove_sender.hpp"

using namespace flexor;
using namespace flexor::firmware;
using link::kFingers;

namespace {

const uint8_t* const kModel = reinterpret_cast<const uint8_t*>(core::kModelBegin);

glove::SettingsHead settings;
Scan<glove::kMaxScan> counts;
volatile bool sampled = false;
volatile bool asked = false;  // by a VR driver: which glove this is
Transmitter transmitter;
Ring received;

void start_sampling() {
  counts.set(settings.scan, settings.scan_count);
  start_adc(settings.analog_pins);
  TCCR1B = _BV(WGM12) | _BV(CS11) | _BV(CS10);
  OCR1A = settings.timer_top;
  TIMSK1 = _BV(OCIE1A);
}

uint8_t pressed() {
  uint8_t bits = 0;
  for (uint8_t i = 0; i < glove::kButtons; ++i) {
    const uint8_t pin = settings.button[i];
    if (pin != glove::kNoPin && is_closed(pin)) bits = static_cast<uint8_t>(bits | settings.button_bit[i]);
  }
  return bits;
}

class GloveCompensator : public glove::GloveModel<Eeprom, glove::kArenaBytes> {
 public:
  GloveCompensator() : GloveModel(kModel) {}
  uint8_t step() {
    mark(Marker::step_begin);
    const uint8_t good = Graph::step();
    mark(Marker::step_end);
    return good;
  }
};

using Followed = glove::Follower<kFingers>;
using Chain = glove::SignalChain<GloveCompensator, Followed>;

// Apart, each at a place that the compiler knows: one object of all would be reached through a pointer.
GloveCompensator compensator;
glove::ChannelSettings channels[kFingers];
Memory<Chain> chain;
Zeroing<kFingers> zero;
link::Frame frame;

// Out of line, as what else is done once: main would keep room for it.
FLEXOR_SHARED void start_chain(const glove::Settings* flash) {
  for (uint8_t i = 0; i < kFingers; ++i) {
    channels[i].calibration = &flash->calibration[i];
    channels[i].monitor = {0, 0, settings.rail_samples, settings.stuck_samples};
    channels[i].guard = {0, settings.max_step, settings.hold_samples};
  }
  const Followed followed(settings.tracker, flash->tracked, settings.samples_per_tick);
  chain.make(channels, compensator, followed);
  zero.start(settings.button[glove::kCalibrateButton], settings.rate_hz);
}

// Takes effect between two samples.
FLEXOR_SHARED compensator::Loaded load_model(Eeprom& eeprom, const glove::ModelStore<Eeprom>& store) {
  const compensator::Loaded loaded =
      compensator.load(eeprom, store, {settings.calibration_id, settings.rate_hz}, channels);
  chain->sensors().follow(glove::poses_id(channels) == settings.tracked_for);
  zero.load(channels, chain->corrections());
  return loaded;
}

FLEXOR_SHARED void take_sample(const uint16_t* now) {
  if (zero.is_there()) {
    int16_t alpha[kFingers];
    for (uint8_t i = 0; i < kFingers; ++i) alpha[i] = (*channels[i].calibration)(now[i]);
    if (zero.sample(alpha)) chain->zeroed();
  }
  chain->step(now, frame);
  frame.time_ms = static_cast<uint16_t>(frame.time_ms + settings.period_ms);
}

// The model in EEPROM, and who sends another.
class Models {
 public:
  explicit Models(const link::Key* pair) : store_(compensator.flashed()), receiver_(pair, store_) {}

  compensator::Loaded load() { return load_model(eeprom_, store_); }
  void stir(uint16_t noise) {
    nonces_.stir(noise);
    if (stirred_ < kStirred) ++stirred_;
    if (until_offer_ > 0) --until_offer_;
  }
  // Not before there is noise in the nonce, nor again and again: anybody may ask, and an offer takes the line for
  // as long as two frames. Who sends asks again.
  void offer() {
    if (stirred_ < kStirred || until_offer_ > 0) return;
    until_offer_ = static_cast<uint8_t>(settings.rate_hz / 2 + settings.rate_hz / 10);  // samples, 0.6 s
    nonces_.start(store_.digest(eeprom_));
    receiver_.challenge(nonces_.next());
  }
  bool take(link::PacketReader& packet) { return receiver_.take(packet, eeprom_); }
  bool busy() const { return receiver_.busy(); }
  // What is to be sent; 0: nothing. A model that is whole runs from the next sample on.
  uint8_t work(uint8_t* wire) {
    if (receiver_.work(eeprom_)) receiver_.loaded(static_cast<uint8_t>(load()));
    if (!transmitter.idle()) return 0;
    return receiver_.answer({settings.rate_hz, settings.calibration_id}, store_.base(), wire);
  }

 private:
  static constexpr uint8_t kStirred = 8;  // samples

  uint8_t until_offer_ = 0;
  Eeprom eeprom_;
  glove::ModelStore<Eeprom> store_;
  glove::ModelReceiver<Eeprom> receiver_;
  link::NonceSource nonces_;
  uint8_t stirred_ = 0;
};

// Frames for the hand's radio.
class Radio {
 public:
  Radio(Models& models, const link::Key* pair, uint8_t reset_cause)
      : models_(models),
        sender_(pair, {settings.listen_every, settings.seek_every, settings.listen_slots},
                static_cast<uint8_t>(settings.rate_hz / settings.samples_per_frame), settings.has_room != 0),
        reset_cause_(reset_cause) {}
  void start() { sender_.start(*this); }
  void sampled(uint16_t reading) {
    ++samples_;
    models_.stir(reading);
  }
  // Neither is part of main, which would keep room for the frames of both at once.
  FLEXOR_SHARED void work() {
    uint8_t byte;
    while (received.pop(byte)) sender_.push(byte, models_);
    uint8_t wire[link::kMaxWire];
    if (const uint8_t size = models_.work(wire)) transmitter.send(wire, size);
  }
  FLEXOR_SHARED void send_frame(const uint16_t* now) { sender_.send_frame(frame, now, *this); }

  // What the line asks of its board.
  uint8_t reset_cause() const { return reset_cause_; }
  uint32_t uptime_s() const { return samples_ / settings.rate_hz; }
  void send(link::Type type, const uint8_t* wire, uint8_t bytes) {
    if (type == link::Type::angles) mark(Marker::frame_sealed);
    transmitter.send(wire, bytes);
  }

 private:
  Models& models_;
  link::GloveSender sender_;
  uint32_t samples_ = 0;
  uint8_t reset_cause_;
};

// Lines, for VR drivers or for people.
class Text {
 public:
  Text() : plain_(settings.output == glove::Output::log, settings.period_ms) {}

  FLEXOR_SHARED void send_line(const uint16_t* now) {
    char* const text = transmitter.room();
    const uint8_t size = settings.output != glove::Output::opengloves ? plain_.step(frame, now, text)
                         : asked                                      ? information(text)
                                                                      : line(text);
    mark(Marker::frame_sealed);
    transmitter.send(size);
  }

 private:
  uint8_t line(char* text) {
    uint16_t joystick[2] = {link::kGloveMiddle, link::kGloveMiddle};
    for (uint8_t i = kFingers; i < settings.scan_count; ++i) joystick[i - kFingers] = counts[i];
    const sensor::GuardSettings guard = {0, settings.max_step, settings.hold_samples};
    return vr_.step(compensator, frame, guard, joystick, pressed(), text);
  }

  static uint8_t information(char* text) {
    asked = false;
    constexpr uint16_t kLines = 1;  // version of the lines
    return link::encode_glove_information(kLines, (settings.vr & glove::kRightHand) != 0, text);
  }

  glove::PlainText plain_;
  glove::GloveText vr_;
};

// A glove sends frames or lines, and what either needs lies in the same bytes.
struct RadioParts {
  explicit RadioParts(uint8_t reset_cause)
      : pair(pair_key()), models(pair), radio(models, pair, reset_cause) {
    transmitter.set(sent, sizeof(sent));
    received.set(came, sizeof(came));
    models.load();
    radio.start();
  }

  const link::Key* pair;
  Models models;
  Radio radio;
  uint8_t sent[64];
  uint8_t came[64];
};

struct TextParts {
  TextParts() {
    transmitter.set(sent, sizeof(sent));
    Eeprom eeprom;
    load_model(eeprom, glove::ModelStore<Eeprom>(compensator.flashed()));
  }

  Text text;
  uint8_t sent[256];
};

union Parts {
  Memory<RadioParts> radio;
  Memory<TextParts> text;
} parts;

FLEXOR_SHARED void start_output(uint8_t reset_cause) {
  if (settings.output == glove::Output::radio) parts.radio.make(reset_cause);
  if (settings.output != glove::Output::radio) parts.text.make();
}

bool is_busy() {
  return settings.output == glove::Output::radio && (!received.empty() || parts.radio->models.busy());
}

}  // namespace

FLEXOR_IMAGE(glove)

ISR(TIMER1_COMPA_vect) { counts.begin(); }

ISR(ADC_vect) {
  if (counts.go_on()) sampled = true;
}

ISR(USART_UDRE_vect) { transmitter.on_ready(); }

// A VR driver writes forces and line feeds, and a Z when it asks.
ISR(USART_RX_vect) {
  const uint8_t byte = UDR0;
  if (byte == 'Z') asked = true;
  if (settings.output == glove::Output::radio) received.push(byte);
}

int main() {
  const uint8_t reset_cause = start_watchdog(WDTO_500MS);
  const auto* const flash = find_settings<glove::Settings>();
  memcpy_P(&settings, flash, sizeof(settings));
  const bool is_radio = settings.output == glove::Output::radio;
  start_uart(settings.uart_divisor, _BV(TXEN0) | _BV(RXEN0) | _BV(RXCIE0));
  for (const uint8_t pin : settings.button) {
    if (pin != glove::kNoPin) pull_up(pin);
  }
  start_chain(flash);
  start_output(reset_cause);
  chain->restart();
  start_sampling();
  sei();
  uint8_t since_frame = static_cast<uint8_t>(settings.samples_per_frame - 1);
  for (;;) {
    sleep_unless([] { return sampled || is_busy(); });
    if (is_radio) parts.radio->radio.work();
    if (!sampled) continue;
    sampled = false;
    wdt_reset();
    mark(Marker::sampled);
    uint16_t now[kFingers];
    for (uint8_t i = 0; i < kFingers; ++i) now[i] = counts[i];  // the next are a sample period away
    if (is_radio) parts.radio->radio.sampled(static_cast<uint16_t>(now[0] + 3 * now[1]));
    take_sample(now);
    // A transmitter that is still busy skips a frame: the newest angle matters, not every one.
    if (++since_frame < settings.samples_per_frame || !transmitter.idle()) continue;
    since_frame = 0;
    if (is_radio) parts.radio->radio.send_frame(now);
    if (!is_radio) parts.text->text.send_line(now);
  }
}
