// The glove's board: timer 1 sets the sample rate, the ADC reads five strips, the UART speaks to the radio or
// to a PC. Pins: ADC PC0..PC4 thumb to pinky, UART PD1. Interrupts move samples and bytes; everything else
// happens in main, which sleeps.
#include "firmware/board.hpp"
#include "glove_config.hpp"
#include "runtime/link/counter_store.hpp"
#include "runtime/link/opengloves.hpp"

using namespace flexor;
using namespace flexor::firmware;

namespace {

volatile uint16_t counts[kFingers];
volatile bool sampled = false;
Ring<64> to_send;

void send(const uint8_t* bytes, uint8_t size) {
  for (uint8_t i = 0; i < size; ++i) to_send.push(bytes[i]);
  UCSR0B |= _BV(UDRIE0);
}

void start_sampling() {
  start_adc();
  TCCR1B = _BV(WGM12) | _BV(CS11) | _BV(CS10);
  OCR1A = static_cast<uint16_t>(F_CPU / 64 / config::kRate_hz - 1);
  TIMSK1 = _BV(OCIE1A);
}

GloveCompensator compensator;
SignalChain<GloveCompensator> chain(config::kChannels, compensator);
link::Frame frame;

#ifdef FLEXOR_OUTPUT_OPENGLOVES

class Output {
 public:
  void start() {}
  void work() {}
  void send_frame() {
    uint16_t flexion[kFingers];
    for (uint8_t i = 0; i < kFingers; ++i) {
      flexion[i] = link::flexion_of(frame.angle[i], config::kStraight[i], config::kFlexionScale[i]);
    }
    char text[link::kMaxGloveText];
    const uint8_t size = link::encode_gloves(flexion, text);
    mark(Marker::frame_sealed);
    send(reinterpret_cast<const uint8_t*>(text), size);
  }
};

#else

// Counts frames with a counter that no restart ever repeats.
class Output {
 public:
  void start() {
    const uint16_t epoch = static_cast<uint16_t>(store_.load(eeprom_) + 1);
    store_.save(epoch);
    while (!store_.work(eeprom_)) wdt_reset();
    frame.counter = static_cast<uint32_t>(epoch) << 16;
  }
  void work() { store_.work(eeprom_); }
  void send_frame() {
    uint8_t wire[link::kWireSealed];
    const uint8_t size = link::encode(frame, config::kKey, wire);
    mark(Marker::frame_sealed);
    send(wire, size);
    ++frame.counter;
    // The next epoch is taken before it is needed.
    if (static_cast<uint16_t>(frame.counter) == 0xff00) store_.save((frame.counter >> 16) + 1);
  }

 private:
  Eeprom eeprom_;
  link::CounterStore<Eeprom> store_;
};

#endif

Output output;

}  // namespace

ISR(TIMER1_COMPA_vect) { begin_scan(); }

ISR(ADC_vect) {
  if (continue_scan(counts)) sampled = true;
}

ISR(USART_UDRE_vect) {
  uint8_t byte;
  if (to_send.pop(byte)) {
    UDR0 = byte;
  } else {
    UCSR0B &= static_cast<uint8_t>(~_BV(UDRIE0));
  }
}

int main() {
  start_watchdog(WDTO_500MS);
  start_uart(config::kUartDivisor, _BV(TXEN0));
  output.start();
  start_sampling();
  sei();
  uint8_t since_frame = config::kSamplesPerFrame - 1;
  for (;;) {
    sleep_unless([] { return sampled; });
    if (!sampled) continue;
    sampled = false;
    wdt_reset();
    mark(Marker::sampled);
    uint16_t now[kFingers];
    for (uint8_t i = 0; i < kFingers; ++i) now[i] = counts[i];  // the next are a sample period away
    chain.step(now, frame);
    frame.time_ms = static_cast<uint16_t>(frame.time_ms + 1000 / config::kRate_hz);
    // A transmitter that is still busy skips a frame: the newest angle matters, not every one.
    if (++since_frame >= config::kSamplesPerFrame && to_send.empty()) {
      since_frame = 0;
      output.send_frame();
    }
    output.work();
  }
}
