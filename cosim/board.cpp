#include "cosim/board.hpp"

#include <simavr/avr_adc.h>
#include <simavr/avr_eeprom.h>
#include <simavr/avr_extint.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_timer.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>

#include <algorithm>
#include <cstring>
#include <string_view>

#include "host/io/io.hpp"

#ifdef __has_feature
#if __has_feature(address_sanitizer)
// simavr keeps its interrupt lines, some kilobytes a board, for ever.
extern "C" const char* __lsan_default_suppressions() {
  return "leak:libsimavr";
}  // NOLINT(bugprone-reserved-identifier): LeakSanitizer asks for it by this name
#endif
#endif

namespace flexor::cosim {
namespace {

constexpr int kSupply_mV = 5000;
constexpr int kAdcTop = 1023;
constexpr avr_io_addr_t kGpior0 = 0x3e;
constexpr std::uint8_t kPaint = 0xa5;
constexpr Cycles kRunCycles = 16;  // at most between two looks for interrupts: a microsecond
constexpr int kMotors = 5;

// Where a motor's PWM is: timer, comparator, its bit in TCCRnA, direction pin; full scale of the counter.
struct Motor {
  char timer;
  int comparator;
  std::uint16_t control;
  std::uint8_t connected;
  std::uint16_t port;
  std::uint8_t direction;
  int steps;
};
constexpr std::uint16_t kPortB = 0x25;
constexpr std::uint16_t kPortD = 0x2b;
constexpr std::uint16_t kDdrD = 0x2a;
constexpr std::uint8_t kEnable = 1U << 6;
constexpr std::uint16_t kTccr0a = 0x44;
constexpr std::uint16_t kTccr1a = 0x80;
constexpr std::uint16_t kTccr2a = 0xb0;
constexpr Motor kMotor[kMotors] = {{'1', 0, kTccr1a, 0x80, kPortB, 1U << 0, 256},
                                   {'1', 1, kTccr1a, 0x20, kPortB, 1U << 4, 256},
                                   {'2', 0, kTccr2a, 0x80, kPortD, 1U << 2, 256},
                                   {'2', 1, kTccr2a, 0x20, kPortD, 1U << 4, 256},
                                   {'0', 1, kTccr0a, 0x20, kPortD, 1U << 7, 250}};

// Bytes that come while nobody reads are lost, and no error.
void quiet(avr_t*, const int level, const char* format, va_list arguments) {
  if (level <= LOG_ERROR && std::strstr(format, "RX buffer overrun") == nullptr)
    std::vfprintf(stderr, format, arguments);
}

constexpr char kUart = '0';

avr_t* avr(void* p) { return static_cast<avr_t*>(p); }

std::uint32_t uart_irqs(char name) { return static_cast<std::uint32_t>(AVR_IOCTL_UART_GETIRQ(name)); }

avr_uart_t* find_uart(avr_t* a) {
  for (avr_io_t* io = a->io_port; io != nullptr; io = io->next) {
    if (std::strcmp(io->kind, "uart") == 0) return reinterpret_cast<avr_uart_t*>(io);
  }
  throw io::JobError("simavr: no UART");
}

}  // namespace

std::uint16_t Firmware::address(const std::string& symbol) const {
  const auto found = symbols.find(symbol);
  if (found != symbols.end()) return found->second;
  throw io::JobError("the image has no symbol {}", symbol);
}

// Free functions for simavr, with the board as parameter.
struct Board::Hooks {
  static void marker(avr_t* a, avr_io_addr_t address, std::uint8_t value, void* board) {
    a->data[address] = value;
    const auto& call = static_cast<Board*>(board)->on_marker;
    if (call) call(a->cycle, value);
  }
  static void byte(avr_irq_t*, std::uint32_t value, void* board) {
    Board& b = *static_cast<Board*>(board);
    if (b.on_byte) b.on_byte(avr(b.avr_)->cycle, static_cast<std::uint8_t>(value));
  }
  static void conversion(avr_irq_t*, std::uint32_t value, void* board) {
    Board& b = *static_cast<Board*>(board);
    if (!b.on_sample) return;
    avr_adc_mux_t mux;
    std::memcpy(&mux, &value, sizeof(value));
    if (mux.kind != ADC_MUX_SINGLE) return;  // the chip's own reference
    const int pin = static_cast<int>(mux.src);
    b.set_counts(pin, b.on_sample(avr(b.avr_)->cycle, pin));
  }
  static void width(avr_irq_t*, std::uint32_t value, void* width) {
    *static_cast<int*>(width) = static_cast<int>(value);
  }
  static avr_cycle_count_t deliver(avr_t*, avr_cycle_count_t, void* board) {
    Board& b = *static_cast<Board*>(board);
    const std::uint8_t value = b.incoming_.front().value;
    b.incoming_.pop_front();
    avr_raise_irq(avr_io_getirq(avr(b.avr_), uart_irqs(kUart), UART_IRQ_INPUT), value);
    b.schedule_byte();
    return 0;
  }
  static avr_cycle_count_t stop(avr_t*, avr_cycle_count_t, void*) {
    return 0;
  }                                                // ends a sleep at a quantum's end
  static void sleep(avr_t*, avr_cycle_count_t) {}  // simulated time only
};

Board::Board(const Firmware& firmware) : firmware_(firmware) {
  [[maybe_unused]] static const bool is_quiet = (avr_global_logger_set(quiet), true);
  avr_t* a = avr_make_mcu_by_name(firmware.mcu.c_str());
  if (a == nullptr) throw io::JobError("simavr knows no {}", firmware.mcu);
  ram_end_ = a->ramend;
  avr_ = a;
  avr_init(a);
  a->sleep = Hooks::sleep;
  std::vector<std::uint8_t> flash(
      firmware.content.bytes.begin() + static_cast<std::ptrdiff_t>(firmware.content.begin),
      firmware.content.bytes.end());
  elf_firmware_t image{};
  image.frequency = 1000 * kCyclesPerMs;
  image.flashbase = static_cast<std::uint32_t>(firmware.content.begin);
  image.flashsize = static_cast<std::uint32_t>(flash.size());
  image.flash = flash.data();
  avr_load_firmware(a, &image);
  a->vcc = a->aref = kSupply_mV;
  uart_ = find_uart(a);
  std::uint32_t flags = 0;
  avr_ioctl(a, static_cast<std::uint32_t>(AVR_IOCTL_UART_SET_FLAGS(kUart)), &flags);
  avr_register_io_write(a, kGpior0, Hooks::marker, this);
  avr_irq_register_notify(avr_io_getirq(a, uart_irqs(kUart), UART_IRQ_OUTPUT), Hooks::byte, this);
  avr_irq_register_notify(avr_io_getirq(a, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_OUT_TRIGGER), Hooks::conversion,
                          this);
  listen_to_motors();  // a glove has none
  power_on();
}

void Board::listen_to_motors() {
  for (std::size_t motor = 0; motor < width_.size(); ++motor) {
    const Motor& m = kMotor[motor];
    avr_irq_register_notify(
        avr_io_getirq(avr(avr_), static_cast<std::uint32_t>(AVR_IOCTL_TIMER_GETIRQ(m.timer)),
                      TIMER_IRQ_OUT_PWM0 + m.comparator),
        Hooks::width, &width_[motor]);
  }
}

Board::~Board() {
  avr_terminate(avr(avr_));
  free(avr_);
}

Cycles Board::now() const { return avr(avr_)->cycle; }

void Board::power_on() {
  avr_t* a = avr(avr_);
  const Cycles cycle = a->cycle;
  avr_reset(a);
  a->cycle = cycle;
  set_supply(kSupply_mV);
  std::fill(a->data + 0x100, a->data + ram_end_ + 1, kPaint);
  after_reset();
}

// What simavr forgets with any reset: cycle timers, and how we want it to run.
void Board::after_reset() {
  avr_t* a = avr(avr_);
  a->run_cycle_limit = kRunCycles;
  // Otherwise a low PD2 or PD3, motor pins here, is polled in every cycle.
  for (std::uint8_t interrupt = 0; interrupt < 2; ++interrupt)
    avr_extint_set_strict_lvl_trig(a, interrupt, 0);
  width_ = {};
  schedule_byte();
}

void Board::put_bootloader(const deploy::FlashContent& bootloader) {
  avr_t* a = avr(avr_);
  std::copy(bootloader.bytes.begin() + static_cast<std::ptrdiff_t>(bootloader.begin), bootloader.bytes.end(),
            a->flash + bootloader.begin);
  a->codeend = a->flashend;
  a->reset_pc = static_cast<avr_flashaddr_t>(bootloader.begin);
  power_on();
}

void Board::reset() {
  constexpr std::uint16_t kMcusr = 0x54;
  constexpr std::uint8_t kExternal = 1U << 1;
  incoming_.clear();
  power_on();
  avr(avr_)->data[kMcusr] |= kExternal;
}

double Board::baud() const {
  constexpr std::uint16_t kUcsr0a = 0xc0;
  constexpr std::uint16_t kUbrr0l = 0xc4;
  constexpr std::uint8_t kDouble = 1U << 1;
  const unsigned divisor = read(kUbrr0l) + 256U * (read(kUbrr0l + 1) & 0xfU) + 1;
  const unsigned cycles = (read(kUcsr0a) & kDouble) != 0 ? 8 : 16;
  return 1000.0 * static_cast<double>(kCyclesPerMs) / (cycles * divisor);
}

// There stands cli, then a jump to itself.
void Board::hang(bool interrupts) {
  constexpr avr_flashaddr_t kCliBytes = 2;
  constexpr std::string_view kEnd = "\xf8\x94\xff\xcf";
  const std::span<std::uint8_t> all = flash();
  const std::size_t at = std::string_view(reinterpret_cast<const char*>(all.data()), all.size()).find(kEnd);
  if (at == std::string_view::npos) throw io::JobError("the board has no program that can hang");
  avr(avr_)->pc = static_cast<avr_flashaddr_t>(at) + (interrupts ? kCliBytes : 0);
  avr(avr_)->state = cpu_Running;
}

void Board::set_pin(int digital, bool high) {
  const char port = digital < 8 ? 'D' : 'B';
  const int bit = digital % 8;
  Held& held = held_[port];
  const unsigned mask = 1U << bit;
  held.pins |= mask;
  held.high = high ? held.high | mask : held.high & ~mask;
  // Else a write to the port lifts a pin that is held low to its pull-up.
  avr_ioport_external_t external{};
  external.name = static_cast<unsigned>(port) & 0x7fU;
  external.mask = held.pins & 0xffU;
  external.value = held.high & 0xffU;
  avr_ioctl(avr(avr_), static_cast<std::uint32_t>(AVR_IOCTL_IOPORT_SET_EXTERNAL(port)), &external);
  avr_raise_irq(avr_io_getirq(avr(avr_), static_cast<std::uint32_t>(AVR_IOCTL_IOPORT_GETIRQ(port)), bit),
                high ? 1 : 0);
}

void Board::power_off(Cycles until) {
  off_ = true;
  on_at_ = until;
  width_ = {};
}

void Board::run_until(Cycles end) {
  avr_t* a = avr(avr_);
  if (off_) {
    a->cycle = std::max(a->cycle, std::min(end, on_at_));
    while (!incoming_.empty() && incoming_.front().end <= a->cycle) incoming_.pop_front();
    if (end < on_at_) return;
    off_ = false;
    power_on();
  }
  if (a->cycle >= end) return;
  avr_cycle_timer_register(a, end - a->cycle, Hooks::stop, this);
  // simavr gives a byte eleven bit-times, 8N1 has ten.
  auto* uart = static_cast<avr_uart_t*>(uart_);
  if (uart->cycles_per_byte != byte_cycles_)
    uart->cycles_per_byte = byte_cycles_ = uart->cycles_per_byte * 10 / 11;
  while (a->cycle < end) {
    const bool awake = a->state == cpu_Running;
    const Cycles before = a->cycle;
    const bool bitten =
        a->run != avr_callback_run_raw;  // simavr's watchdog has put its reset there, for once
    const int state = avr_run(a);
    if (bitten) {
      after_reset();
      avr_cycle_timer_register(a, end - a->cycle, Hooks::stop, this);
      if (on_bite) on_bite(a->cycle);
    }
    if (awake && a->state == cpu_Running) awake_ += a->cycle - before;
    if (state == cpu_Done || state == cpu_Crashed) throw io::JobError("the firmware has stopped");
  }
}

void Board::set_counts(int pin, int counts) {
  // The converter gives floor(1023 mV / supply).
  const int mV = (std::clamp(counts, 0, kAdcTop) * supply_mV_ + kAdcTop - 1) / kAdcTop;
  avr_raise_irq(avr_io_getirq(avr(avr_), AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0 + pin),
                static_cast<std::uint32_t>(mV));
}

void Board::set_supply(int mV) {
  supply_mV_ = mV;
  avr(avr_)->avcc = static_cast<std::uint32_t>(mV);
}

void Board::receive(Cycles end, std::uint8_t byte) {
  incoming_.push_back({end, byte});
  if (incoming_.size() == 1 && !off_) schedule_byte();
}

// simavr raises "receive complete" a byte-time after its input: hand the byte over that much earlier.
void Board::schedule_byte() {
  if (incoming_.empty()) return;
  avr_t* a = avr(avr_);
  const Cycles due = incoming_.front().end - std::min<Cycles>(byte_cycles_, incoming_.front().end);
  avr_cycle_timer_register(a, due > a->cycle ? due - a->cycle : 1, Hooks::deliver, this);
}

double Board::duty(int motor) const {
  const std::uint8_t* data = avr(avr_)->data;
  if (off_ || (data[kDdrD] & data[kPortD] & kEnable) == 0) return 0;
  if (const auto stuck = stuck_.find(motor); stuck != stuck_.end()) return stuck->second;
  const Motor& m = kMotor[motor];
  if ((data[m.control] & m.connected) == 0) return 0;
  const double share = (width_[static_cast<std::size_t>(motor)] + 1.0) / m.steps;
  return (data[m.port] & m.direction) != 0 ? share : -share;
}

std::uint8_t Board::read(std::uint16_t address) const { return avr(avr_)->data[address]; }

void Board::write(std::uint16_t address, std::uint8_t byte) { avr(avr_)->data[address] = byte; }

Board::Eeprom Board::eeprom() {
  avr_eeprom_desc_t all{};
  all.size = kEepromBytes;
  avr_ioctl(avr(avr_), AVR_IOCTL_EEPROM_GET, &all);
  return {all.ee};
}

std::span<std::uint8_t> Board::flash() { return {avr(avr_)->flash, avr(avr_)->flashend + 1U}; }

int Board::stack_bytes() const {
  const std::uint8_t* data = avr(avr_)->data;
  int at = firmware_.address("__bss_end");
  while (at <= ram_end_ && data[at] == kPaint) ++at;
  return ram_end_ + 1 - at;
}

}  // namespace flexor::cosim
