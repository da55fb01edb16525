// What both boards share: markers, the UART with its rings, EEPROM, sleep.
#pragma once

#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <stdint.h>

#include "firmware/markers.hpp"
#include "runtime/link/key_record.hpp"

namespace flexor {
namespace firmware {

// The LED of the board.
inline void start_led() { DDRB |= _BV(PB5); }
inline void set_led(bool on) { PORTB = static_cast<uint8_t>(on ? PORTB | _BV(PB5) : PORTB & ~_BV(PB5)); }

inline void mark(Marker marker) { GPIOR0 = static_cast<uint8_t>(marker); }

// One producer, one consumer, one of them an interrupt. kSize is a power of two; one place stays empty.
template <uint16_t kSize>
class Ring {
  static_assert((kSize & (kSize - 1)) == 0 && kSize <= 256, "a power of two");

 public:
  bool empty() const { return head_ == tail_; }

  bool push(uint8_t byte) {
    const uint8_t next = static_cast<uint8_t>((head_ + 1) & (kSize - 1));
    if (next == tail_) return false;
    bytes_[head_] = byte;
    head_ = next;
    return true;
  }

  bool pop(uint8_t& byte) {
    if (empty()) return false;
    byte = bytes_[tail_];
    tail_ = static_cast<uint8_t>((tail_ + 1) & (kSize - 1));
    return true;
  }

 private:
  volatile uint8_t head_ = 0;
  volatile uint8_t tail_ = 0;
  uint8_t bytes_[kSize];
};

// What is to be sent: main fills it, the UART's interrupt empties it.
template <uint16_t kBytes>
class Transmitter {
 public:
  bool idle() const { return ring_.empty(); }
  void send(const uint8_t* bytes, uint8_t size) {
    for (uint8_t i = 0; i < size; ++i) ring_.push(bytes[i]);
    UCSR0B |= _BV(UDRIE0);
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
  Ring<kBytes> ring_;
};

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

// Begins to convert an analog pin; the ADC's interrupt says when it is done.
inline void convert(uint8_t pin) {
  ADMUX = static_cast<uint8_t>(_BV(REFS0) | pin);
  ADCSRA |= _BV(ADSC);
}

// One conversion of each of the first pins after the other: begun by a timer's interrupt, continued by the ADC's until
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

// Likewise of any channels in any order: kScan, in flash, has kCount of them.
template <const uint8_t* kScan, uint8_t kCount>
class Scan {
 public:
  void begin() { next(0); }

  bool go_on() {
    const uint8_t at = at_;
    counts_[at] = ADC;
    if (at + 1 == kCount) return true;
    next(static_cast<uint8_t>(at + 1));
    return false;
  }

  uint16_t operator[](uint8_t i) const { return counts_[i]; }

 private:
  void next(uint8_t at) {
    at_ = at;
    convert(pgm_read_byte(kScan + at));
  }

  volatile uint16_t counts_[kCount];
  uint8_t at_;
};

struct Eeprom {
  uint8_t read(uint16_t address) { return eeprom_read_byte(reinterpret_cast<const uint8_t*>(address)); }
  bool ready() { return eeprom_is_ready(); }
  void write(uint16_t address, uint8_t byte) { eeprom_write_byte(reinterpret_cast<uint8_t*>(address), byte); }
};

// The pair's key out of its record, null for plain frames. A board whose record is damaged stays silent: plain it would
// listen to anybody.
inline const link::Key* pair_key(const link::KeyRecord& record) {
  static link::Key key;
  while (!link::load(&record, key)) wdt_reset();
  return link::is_plain(key) ? nullptr : &key;
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

// Sleeps until an interrupt, unless `busy` says that there is something to do. It is asked with interrupts
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
