// What both boards share: markers, the UART with its rings, EEPROM, sleep.
#pragma once

#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <stddef.h>
#include <stdint.h>

#include "firmware/markers.hpp"
#include "runtime/core/flash_map.hpp"
#include "runtime/link/key_record.hpp"
#include "runtime/link/messages.hpp"

inline void* operator new(size_t, void* place) { return place; }  // avr-libc has no <new>

namespace flexor {
namespace firmware {

// Room for an object that is made when its settings are known.
template <class T>
class Memory {
 public:
  template <class... Arguments>
  T& make(Arguments&... arguments) {
    return *new (bytes_) T(arguments...);
  }
  T* operator->() { return reinterpret_cast<T*>(bytes_); }

 private:
  uint8_t bytes_[sizeof(T)];
};

// The LED of the board.
inline void start_led() { DDRB |= _BV(PB5); }
inline void set_led(bool on) { PORTB = static_cast<uint8_t>(on ? PORTB | _BV(PB5) : PORTB & ~_BV(PB5)); }

inline void mark(Marker marker) { GPIOR0 = static_cast<uint8_t>(marker); }

// One producer, one consumer, one of them an interrupt. Its size is a power of two, up to 256; one place stays empty.
class Ring {
 public:
  // Before the first byte; `bytes` outlive it.
  void set(uint8_t* bytes, uint16_t size) {
    bytes_ = bytes;
    mask_ = static_cast<uint8_t>(size - 1);
  }

  bool empty() const { return head_ == tail_; }

  bool push(uint8_t byte) {
    const uint8_t next = static_cast<uint8_t>((head_ + 1) & mask_);
    if (next == tail_) return false;
    bytes_[head_] = byte;
    head_ = next;
    return true;
  }

  bool pop(uint8_t& byte) {
    if (empty()) return false;
    byte = bytes_[tail_];
    tail_ = static_cast<uint8_t>((tail_ + 1) & mask_);
    return true;
  }

  // While it is empty, bytes may be put where it begins.
  uint8_t* restart() {
    head_ = tail_ = 0;
    return bytes_;
  }
  void fill(uint8_t size) { head_ = size; }

 private:
  volatile uint8_t head_ = 0;
  volatile uint8_t tail_ = 0;
  uint8_t mask_ = 0;
  uint8_t* bytes_ = nullptr;
};

// What is to be sent: main fills it, the UART's interrupt empties it.
class Transmitter {
 public:
  void set(uint8_t* bytes, uint16_t size) { ring_.set(bytes, size); }

  bool idle() const { return ring_.empty(); }
  void send(const uint8_t* bytes, uint8_t size) {
    for (uint8_t i = 0; i < size; ++i) ring_.push(bytes[i]);
    start();
  }
  // While idle: room for a line, and of it so many bytes go.
  char* room() { return reinterpret_cast<char*>(ring_.restart()); }
  void send(uint8_t size) {
    ring_.fill(size);
    start();
  }
  void on_ready() {
    uint8_t byte;
    if (ring_.pop(byte)) {
      UDR0 = byte;
    } else {
      UCSR0B &= static_cast<uint8_t>(~_BV(UDRIE0));
    }
  }

 private:
  static void start() { UCSR0B |= _BV(UDRIE0); }

  Ring ring_;
};

// Digital pins D2 to D12: a button between one and ground.
inline void pull_up(uint8_t pin) {
  if (pin < 8) PORTD = static_cast<uint8_t>(PORTD | 1 << pin);
  if (pin >= 8) PORTB = static_cast<uint8_t>(PORTB | 1 << (pin - 8));
}
inline bool is_closed(uint8_t pin) {
  const uint8_t levels = pin < 8 ? PIND : PINB;
  return (levels & 1 << (pin & 7)) == 0;
}

// 8N1, as after a reset, at double speed: baud = F_CPU / (8 (divisor + 1)).
inline void start_uart(uint16_t divisor, uint8_t enables) {
  UCSR0A = _BV(U2X0);
  UBRR0H = static_cast<uint8_t>(divisor >> 8);
  UBRR0L = static_cast<uint8_t>(divisor);
  UCSR0B = enables;
}

// The ADC at 125 kHz: a conversion takes 0.1 ms. analog: a bit for each of A0 .. A5 that nobody reads as a
// digital pin.
inline void start_adc(uint8_t analog = 0x1f) {
  DIDR0 = analog;
  ADMUX = _BV(REFS0);
  ADCSRA = _BV(ADEN) | _BV(ADIE) | 7;
}

// Begins to convert an analog pin; the ADC's interrupt reports its end.
inline void convert(uint8_t pin) {
  ADMUX = static_cast<uint8_t>(_BV(REFS0) | pin);
  ADCSRA |= _BV(ADSC);
}

// One conversion of each of the first pins after the other, quicker than a Scan: begun by a timer's interrupt, continued by the ADC's until
// it is true. Whoever converts something else in between (the hand's bandgap) finds the pin in ADMUX.
inline void begin_scan() { convert(0); }

template <uint8_t kChannels>
inline bool continue_scan(volatile uint16_t (&counts)[kChannels]) {
  const uint8_t channel = ADMUX & 7;
  counts[channel] = ADC;
  if (channel + 1 == kChannels) return true;
  convert(static_cast<uint8_t>(channel + 1));
  return false;
}

// Likewise of any channels in any order.
template <uint8_t kMost>
class Scan {
 public:
  void set(const uint8_t* channels, uint8_t count) {
    channels_ = channels;
    count_ = count;
  }
  void begin() { next(0); }

  bool go_on() {
    const uint8_t at = at_;
    counts_[at] = ADC;
    if (at + 1 == count_) return true;
    next(static_cast<uint8_t>(at + 1));
    return false;
  }

  uint16_t operator[](uint8_t i) const { return counts_[i]; }

 private:
  void next(uint8_t at) {
    at_ = at;
    convert(channels_[at]);
  }

  const uint8_t* channels_;
  volatile uint16_t counts_[kMost];
  uint8_t count_;
  uint8_t at_;
};

struct Eeprom {
  uint8_t read(uint16_t address) { return eeprom_read_byte(reinterpret_cast<const uint8_t*>(address)); }
  bool ready() { return eeprom_is_ready(); }
  void write(uint16_t address, uint8_t byte) { eeprom_write_byte(reinterpret_cast<uint8_t*>(address), byte); }
};

// The pair's key out of its record, null for plain frames. A board whose record is damaged stays silent: plain it would
// listen to anybody.
inline const link::Key* pair_key() {
  static link::Key key;
  while (!link::load(reinterpret_cast<const link::KeyRecord*>(core::kKeyBegin), key)) wdt_reset();
  return link::is_plain(key) ? nullptr : &key;
}

// Behind the vectors, where `flexor ports --ask` looks.
#define FLEXOR_IMAGE(board)                                                   \
  extern const core::ImageId image_id;                                        \
  __attribute__((used, section(".vectors"))) const core::ImageId image_id = { \
      {'F', 'X'}, static_cast<uint8_t>(link::BoardKind::board), {FLEXOR_IMAGE_VERSION}};

// The settings of this image's version, where they lie in flash. A board without any stays silent, its motors off.
template <class Settings>
inline const Settings* find_settings() {
  for (;;) {
    wdt_reset();
    const auto* const found = core::find_settings<Settings>(nullptr);
    if (found != nullptr) return found;
  }
}

// A watchdog that bit runs on with its shortest time: it is stopped first of all, then started with ours.
// Returns why the board has started, as MCUSR has it.
inline uint8_t start_watchdog(uint8_t timeout) {
  const uint8_t cause = MCUSR;
  MCUSR = 0;
  wdt_disable();
  wdt_enable(timeout);
  return cause;
}

// Sleeps until an interrupt, unless `busy` reports something to do. It is asked with interrupts
// off, so that none comes in between.
template <class Busy>
inline void sleep_unless(Busy busy) {
  set_sleep_mode(SLEEP_MODE_IDLE);
  cli();
  if (busy()) {
    sei();
    return;
  }
  sleep_enable();
  sei();
  sleep_cpu();
  sleep_disable();
}

}  // namespace firmware
}  // namespace flexor
