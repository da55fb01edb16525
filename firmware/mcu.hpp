// What differs between an ATmega328P (Uno, Nano) and an ATmega32U4 (Leonardo, Micro, Pro Micro): the number in the names of
// the UART at D0 and D1, and which channel of the ADC an analog pin is. Timer 1, EEPROM and watchdog are the same.
#pragma once

#include <avr/interrupt.h>
#include <avr/io.h>
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

// Of the pins A0 to A5 the channel of the ADC. A Leonardo has A0 to A3 at ADC7 to ADC4, A4 and A5 at ADC1 and
// ADC0 (its pins_arduino.h in the Arduino core); an Uno has them in order.
#ifdef __AVR_ATmega32U4__
inline uint8_t adc_channel(uint8_t pin) { return static_cast<uint8_t>(pin < 4 ? 7 - pin : 5 - pin); }
#else
inline uint8_t adc_channel(uint8_t pin) { return pin; }
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
