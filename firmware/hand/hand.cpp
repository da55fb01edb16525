// The hand's board: timer 0 is the millisecond and the fifth PWM, the ADC reads five potentiometers, the UART
// speaks to the radio. Pins: ADC PC0..PC4 thumb to pinky; PWM OC1A PB1, OC1B PB2, OC2A PB3, OC2B PD3, OC0B
// PD5; direction PB0, PB4, PD2, PD4, PD7, high to flex; the drivers' enable PD6, high while no motor must stand
// still, low without a program. The hand it drives is its settings (runtime/core/flash_map.hpp). Interrupts move samples and bytes; everything else
// happens in main, which sleeps. A tick comes first: between two of them main computes at most one tag.
#include "firmware/board.hpp"
#include "runtime/hand/board_watch.hpp"
#include "runtime/hand/settings.hpp"
#include "runtime/link/counter_store.hpp"
#include "runtime/link/hand_end.hpp"

using namespace flexor;
using namespace flexor::firmware;

// What a debugger or a simulator may want to know.
struct HandStatus {
  uint8_t finger_bytes;
  hand::Link link;
  hand::Fault fault[link::kFingers];
  int16_t setpoint[link::kFingers];  // Q4 degrees
  uint16_t overruns;                 // bytes that found no room
  int8_t duty[link::kFingers];       // 127: the supply's whole voltage
  uint8_t board;                     // hand::BoardFault
};
HandStatus hand_status = {sizeof(hand::Finger), hand::Link::waiting, {}, {}, 0, {}, 0};
hand::Finger hand_finger[link::kFingers];
link::HandEnd hand_link(nullptr);  // begins with its statistics

namespace {

static_assert(hand::kFingers == link::kFingers, "a motor for each finger");
hand::Settings settings;
hand::FingerSettings of_finger[link::kFingers];  // of them: no tick puts them together
volatile uint16_t counts[link::kFingers];
volatile bool ticked = false;
volatile bool scanning = false;
volatile bool late = false;     // a scan that the next tick found unfinished
volatile uint16_t bandgap = 0;  // counts
uint8_t received_bytes[32];
uint8_t sent_bytes[64];
Ring received;
Transmitter transmitter;

hand::LinkWatch watch;
hand::BoardWatch board_watch;
hand::NeighbourWatch neighbours[link::kFingers - 1];
uint8_t of_windows_ms = 0;
constexpr uint8_t kEnable = _BV(PD6);
constexpr uint8_t kBandgap = _BV(REFS0) | 0x0e;
constexpr uint8_t kBadResets = hand::kBrownOutReset | hand::kWatchdogReset;
static_assert(hand::kBrownOutReset == _BV(BORF) && hand::kWatchdogReset == _BV(WDRF), "as in MCUSR");
Eeprom eeprom;
link::CounterStore<Eeprom> store;
uint16_t of_second_ms = 0;
uint16_t uptime_s = 0;  // not beyond UINT16_MAX
uint8_t reset_cause = 0;
uint8_t runaway = 0;  // hand::kRunaway until the next start: what duty 0 did not stop may still be driven
uint32_t starts = 0;  // as kept in EEPROM
bool kept = false;    // nothing is left to write
bool pending = false;
uint8_t since_state = 0;  // telemetry since the last state

void start_motors() {
  DDRB = _BV(PB0) | _BV(PB1) | _BV(PB2) | _BV(PB3) | _BV(PB4);
  DDRD = _BV(PD2) | _BV(PD3) | _BV(PD4) | _BV(PD5) | _BV(PD6) | _BV(PD7);
  // Fast PWM of eight bits at 977 Hz, like the fifth. Outputs stay disconnected, and low, at duty 0: it has
  // no width of nothing.
  TCCR1A = _BV(WGM10);
  TCCR1B = _BV(WGM12) | _BV(CS11) | _BV(CS10);
  TCCR2A = _BV(WGM21) | _BV(WGM20);
  TCCR2B = _BV(CS22);
  TCCR0A = _BV(WGM01) | _BV(WGM00);
  OCR0A = 249;
  TCCR0B = _BV(WGM02) | _BV(CS01) | _BV(CS00);
  TIMSK0 = _BV(OCIE0A);
  start_adc();
}

void put(volatile uint8_t& port, uint8_t bits, bool on) {
  port = static_cast<uint8_t>(on ? port | bits : port & ~bits);
}

// The compare mode's bit in TCCRnA connects the output to its timer: clear on match.
void drive(uint8_t motor, int16_t duty) {
  const bool flex = duty >= 0;
  const uint16_t size = static_cast<uint16_t>(flex ? duty : -duty);
  const uint8_t width = static_cast<uint8_t>(size >> 7);
  const bool on = width > 0;
  switch (motor) {
    case 0:
      put(PORTB, _BV(PB0), flex);
      OCR1A = width;
      put(TCCR1A, _BV(COM1A1), on);
      return;
    case 1:
      put(PORTB, _BV(PB4), flex);
      OCR1B = width;
      put(TCCR1A, _BV(COM1B1), on);
      return;
    case 2:
      put(PORTD, _BV(PD2), flex);
      OCR2A = width;
      put(TCCR2A, _BV(COM2A1), on);
      return;
    case 3:
      put(PORTD, _BV(PD4), flex);
      OCR2B = width;
      put(TCCR2A, _BV(COM2B1), on);
      return;
    default:
      put(PORTD, _BV(PD7), flex);
      OCR0B = static_cast<uint8_t>((static_cast<uint16_t>(width) * 250) >> 8);  // counts to 249
      put(TCCR0A, _BV(COM0B1), on);
  }
}

// Out of line, as tick(): in one function there would not be registers enough for all.
__attribute__((noinline)) int16_t run_finger(hand::Finger& finger, uint8_t i, uint16_t reading) {
  // The watches take turns: no tick has all of them.
  const bool turn = ((static_cast<uint8_t>(hand_link.now_ms()) ^ i) & 1) == 0;
  return finger.tick(of_finger[i], hand_status.link, hand_link.receiver().frame().angle[i],
                     settings.reach[i].rest, reading, turn,
                     i > 0 ? neighbours[i - 1].of_second() : hand::Neighbour{});
}

// What a finger has to do with the one before. Fingers next to each other are probed by turns.
__attribute__((noinline)) void meet(uint8_t i, const uint16_t* reading) {
  const bool turn = (((of_windows_ms / hand::NeighbourWatch::kWindow_ms) ^ i) & 1) == 0;
  const int16_t commanded = static_cast<int16_t>(hand_finger[i].setpoint() - hand_finger[i - 1].setpoint());
  neighbours[i - 1].look(reading[i - 1], reading[i], commanded, turn);
}

__attribute__((noinline)) void tick() {
  mark(Marker::tick_begin);
  uint16_t reading[link::kFingers];
  cli();
  for (uint8_t i = 0; i < link::kFingers; ++i) reading[i] = counts[i];
  const uint8_t broken = board_watch.tick(!late, bandgap) | runaway;
  late = false;
  sei();
  if (++of_second_ms == 1000) {
    of_second_ms = 0;
    if (uptime_s < UINT16_MAX) ++uptime_s;
  }
  hand_link.tick();
  hand_link.stir(static_cast<uint16_t>(reading[0] ^ reading[4] << 8));
  hand_status.link = watch.tick();
  hand_status.board = broken | (reset_cause & kBadResets);
  if (broken) PORTD &= static_cast<uint8_t>(~kEnable);
  if (!broken) PORTD |= kEnable;
  const uint8_t second = ++of_windows_ms & (hand::NeighbourWatch::kWindow_ms - 1);  // one pair in a tick
  if (second > 0 && second < link::kFingers) meet(second, reading);
  for (uint8_t i = 0; i < link::kFingers; ++i) {
    hand::Finger& finger = hand_finger[i];
    if (broken) finger.let_go();
    const int16_t duty = broken ? 0 : run_finger(finger, i, reading[i]);
    drive(i, duty);
    hand_status.duty[i] = static_cast<int8_t>(duty >> 8);
    const hand::Fault fault = finger.fault();
    hand_status.fault[i] = fault;
    hand_status.setpoint[i] = finger.setpoint();
    if (fault != hand::Fault::none && finger.runs_away()) runaway = hand::kRunaway;
  }
  mark(Marker::tick_end);
}

// EEPROM in the background. A challenge waits for it: the count of starts in it is never given twice.
void keep() {
  if (hand_link.starts() != starts && store.save(hand_link.starts())) starts = hand_link.starts();
  kept = store.work(eeprom) && hand_link.starts() == starts;
}

void take_frame() {
  mark(Marker::frame_accepted);
  watch.frame();
}

void listen() {
  link::Received result = link::Received::nothing;
  if (pending) {
    result = hand_link.verify();
  } else {
    uint8_t byte;
    while (result == link::Received::nothing && received.pop(byte)) result = hand_link.push(byte);
  }
  pending = result == link::Received::pending;
  if (result == link::Received::frame) take_frame();
}

uint8_t telemetry(uint8_t* wire) {
  link::FingerTelemetry finger[link::kFingers];
  for (uint8_t i = 0; i < link::kFingers; ++i) {
    cli();
    const uint16_t reading = counts[i];
    sei();
    finger[i].angle = core::clamp<int16_t>(of_finger[i].potentiometer(reading), 0, link::kMaxAngle);
    finger[i].duty = hand_status.duty[i];
    finger[i].fault = static_cast<uint8_t>(hand_status.fault[i]);
  }
  link::Packet packet;
  const uint8_t bytes =
      link::put_telemetry(hand_link.now_ms(), hand_status.board, finger, link::kFingers, packet.body());
  return hand_link.seal(link::Type::telemetry, packet, bytes, wire);
}

// The bandgap is 1.1 V within a tenth, and so is this.
uint8_t supply_20mV() {
  constexpr uint16_t kBandgapAtTop = 56265;  // 1.1 V 1023 / 20 mV
  cli();
  const uint16_t now = bandgap;
  sei();
  const uint16_t supply = now == 0 ? 0 : kBandgapAtTop / now;
  return supply < UINT8_MAX ? static_cast<uint8_t>(supply) : UINT8_MAX;
}

uint8_t state(uint8_t* wire) {
  link::State state = {};
  state.board = link::BoardKind::hand;
  state.in_touch = hand_link.in_touch();
  state.has_key = hand_link.receiver().pair() != nullptr;
  state.reset_cause = reset_cause;
  state.faults = hand_status.board;
  state.temperature_C = link::State::kNoTemperature;
  state.supply_20mV = supply_20mV();
  state.uptime_s = uptime_s;
  link::Packet packet;
  return hand_link.seal(link::Type::state, packet, link::put_state(state, packet.body()), wire);
}

void send_due() {
  constexpr uint8_t kTelemetryPerState = 8;
  const link::HandEnd::Message due = hand_link.due();
  if (due == link::HandEnd::Message::none || !transmitter.idle()) return;
  uint8_t wire[link::kMaxWire];
  if (due == link::HandEnd::Message::challenge) {
    if (kept) transmitter.send(wire, hand_link.challenge(wire));
    return;
  }
  since_state = static_cast<uint8_t>((since_state + 1) % kTelemetryPerState);
  transmitter.send(wire, since_state == 0 ? state(wire) : telemetry(wire));
}

}  // namespace

// Every 64th scan begins with the bandgap, at which the converter has looked since the last: it takes its time
// to settle.
FLEXOR_IMAGE(hand)

ISR(TIMER0_COMPA_vect) {
  static uint8_t scans = 0;
  if (scanning) {
    late = true;
    ticked = true;
    start_adc();
  }
  scanning = true;
  if (++scans & 63) {
    begin_scan();
  } else {
    ADMUX = kBandgap;
    ADCSRA |= _BV(ADSC);
  }
}

ISR(ADC_vect) {
  if (ADMUX == kBandgap) {
    bandgap = ADC;
    begin_scan();
    return;
  }
  if (!continue_scan(counts)) return;
  ADMUX = kBandgap;
  scanning = false;
  ticked = true;
}

ISR(USART_UDRE_vect) { transmitter.on_ready(); }

ISR(USART_RX_vect) {
  if (!received.push(UDR0)) ++hand_status.overruns;
}

int main() {
  reset_cause = start_watchdog(WDTO_30MS);
  memcpy_P(&settings, find_settings<hand::Settings>(), sizeof(settings));
  for (uint8_t i = 0; i < link::kFingers; ++i) of_finger[i] = settings.finger(i);
  hand_link = link::HandEnd(pair_key());
  starts = store.load(eeprom);
  hand_link.start(starts + 1);
  received.set(received_bytes, sizeof(received_bytes));
  transmitter.set(sent_bytes, sizeof(sent_bytes));
  start_uart(settings.uart_divisor, _BV(TXEN0) | _BV(RXEN0) | _BV(RXCIE0));
  start_motors();
  sei();
  for (;;) {
    sleep_unless([] { return ticked || pending || !received.empty(); });
    if (ticked) {
      ticked = false;
      wdt_reset();
      tick();
      keep();
      if (!pending) send_due();  // here a millisecond is left until the next
    }
    if (pending || !received.empty()) listen();
  }
}
