// What differs between an ATmega328P (Uno, Nano) and an ATmega32U4 (Leonardo, Micro, Pro Micro): the number in the names of
// the UART at D0 and D1, and which channel of the ADC an analog pin is. Timer 1, EEPROM and watchdog are the same.
#pragma once

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <stdint.h>

#ifdef __AVR_ATmega32U4__
#define UCSR0A UCSR1A
#define UCSR0B UCSR1B
#define UBRR0H UBRR1H
#define UBRR0L UBRR1L
#define UDR0 UDR1
#define U2X0 U2X1
#define RXEN0 RXEN1
#define TXEN0 TXEN1
#define RXCIE0 RXCIE1
#define UDRIE0 UDRIE1
#define USART_RX_vect USART1_RX_vect
#define USART_UDRE_vect USART1_UDRE_vect
#endif

namespace flexor {
namespace firmware {

// Of an analog pin the channel of the ADC, which is its input from the next conversion on. A Leonardo has A0 to A11 at
// the channels below (its pins_arduino.h in the Arduino core), those from 8 on under a bit of their own; an Uno has
// them in order. The LED: an Uno's at D13; a Leonardo's, Micro's and Pro Micro's that otherwise shows what USB
// receives, on while its pin is low, since a Pro Micro has no other.
#ifdef __AVR_ATmega32U4__
const uint8_t kAdcChannel[] PROGMEM = {7, 6, 5, 4, 1, 0, 8, 10, 11, 12, 13, 9};
inline uint8_t adc_channel(uint8_t pin) { return pgm_read_byte(kAdcChannel + pin); }
inline void select_analog(uint8_t pin) {
  const uint8_t channel = adc_channel(pin);
  ADCSRB = channel < 8 ? 0 : _BV(MUX5);
  ADMUX = static_cast<uint8_t>(_BV(REFS0) | (channel & 7));
}
inline void start_led() { DDRB |= _BV(PB0); }
inline void set_led(bool on) { PORTB = static_cast<uint8_t>(on ? PORTB & ~_BV(PB0) : PORTB | _BV(PB0)); }
#else
inline uint8_t adc_channel(uint8_t pin) { return pin; }
inline void select_analog(uint8_t pin) { ADMUX = static_cast<uint8_t>(_BV(REFS0) | pin); }
inline void start_led() { DDRB |= _BV(PB5); }
inline void set_led(bool on) { PORTB = static_cast<uint8_t>(on ? PORTB | _BV(PB5) : PORTB & ~_BV(PB5)); }
#endif

// A bit for each pin -> a bit for each channel.
inline uint8_t adc_channels(uint8_t pins) {
  uint8_t out = 0;
  for (uint8_t pin = 0; pin < 6; ++pin) {
    if ((pins >> pin) & 1) out = static_cast<uint8_t>(out | 1U << adc_channel(pin));
  }
  return out;
}

}  // namespace firmware
}  // namespace flexor
