#include "cosim/usb_board.hpp"

#include <fmt/format.h>
#include <simavr/avr_adc.h>
#include <simavr/avr_eeprom.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_core.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <thread>
#include <vector>

#include "host/io/io.hpp"

namespace flexor::cosim {
namespace {

constexpr std::uint32_t kClock_hz = 16000000;
constexpr std::uint64_t kMillisecond = kClock_hz / 1000;
constexpr avr_io_addr_t kGpior0 = 0x3e;
constexpr std::uint16_t kMcusr = 0x54;
constexpr std::uint8_t kExtrf = 1U << 1;
constexpr std::uint16_t kUcsr0a = 0xc0;
constexpr std::uint16_t kUbrr0l = 0xc4;
constexpr std::uint16_t kUbrr0h = 0xc5;
constexpr std::uint8_t kU2x0 = 1U << 1;
constexpr std::uint32_t kSupply_mV = 5000;
constexpr int kAdcTop = 1023;
constexpr std::size_t kStrips = 5;

avr_t* avr(void* p) { return static_cast<avr_t*>(p); }

// Noise that comes while nobody reads is lost, and no error.
void quiet(avr_t*, const int level, const char* format, va_list arguments) {
  if (level <= LOG_ERROR && std::strstr(format, "RX buffer overrun") == nullptr)
    std::vfprintf(stderr, format, arguments);
}

}  // namespace

// Free functions for simavr, with the board as parameter.
struct UsbBoard::Hooks {
  static void marker(avr_t* a, avr_io_addr_t address, std::uint8_t value, void* board) {
    a->data[address] = value;
    ++static_cast<UsbBoard*>(board)->markers_;
  }
  static void byte(avr_irq_t*, std::uint32_t value, void* board) {
    UsbBoard& b = *static_cast<UsbBoard*>(board);
    if (b.port_.is_open())
      b.outgoing_ += static_cast<char>(b.port_.on_the_wire(static_cast<std::uint8_t>(value), b.baud()));
  }
  static void conversion(avr_irq_t*, std::uint32_t value, void* board) {
    UsbBoard& b = *static_cast<UsbBoard*>(board);
    avr_adc_mux_t mux;
    std::memcpy(&mux, &value, sizeof(value));
    if (mux.kind != ADC_MUX_SINGLE) return;  // the chip's own reference
    const int counts = strip_counts(b.conversions_++ / kStrips, static_cast<int>(mux.src));
    // The converter gives floor(1023 mV / supply).
    const std::uint32_t mV = (static_cast<std::uint32_t>(counts) * kSupply_mV + kAdcTop - 1) / kAdcTop;
    avr_raise_irq(avr_io_getirq(avr(b.avr_), AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0 + static_cast<int>(mux.src)),
                  mV);
  }
  static avr_cycle_count_t deliver(avr_t* a, avr_cycle_count_t, void* board) {
    UsbBoard& b = *static_cast<UsbBoard*>(board);
    if (b.incoming_.empty()) return 0;
    const std::uint8_t value = b.port_.on_the_wire(b.incoming_.front(), b.baud());
    b.incoming_.pop_front();
    avr_raise_irq(avr_io_getirq(a, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT), value);
    return b.incoming_.empty() ? 0 : a->cycle + b.byte_cycles();
  }
  static avr_cycle_count_t stop(avr_t*, avr_cycle_count_t, void*) { return 0; }
  static void sleep(avr_t*, avr_cycle_count_t) {}
};

UsbBoard::UsbBoard(const UsbBoardOptions& options) : options_(options) {
  avr_global_logger_set(quiet);
  avr_t* a = avr_make_mcu_by_name(options_.mcu.c_str());
  if (a == nullptr) throw io::JobError(fmt::format("simavr knows no {}", options_.mcu));
  avr_ = a;
  avr_init(a);
  a->frequency = kClock_hz;
  a->vcc = a->avcc = a->aref = kSupply_mV;
  a->sleep = Hooks::sleep;
  a->codeend = a->flashend;
  std::memset(a->flash, 0xff, a->flashend + 1);
  const auto load = [&](const deploy::FlashContent& content) {
    std::copy(content.bytes.begin() + static_cast<std::ptrdiff_t>(content.begin), content.bytes.end(),
              a->flash + content.begin);
  };
  if (options_.program) load(*options_.program);
  load(options_.bootloader);
  if (options_.frozen) frozen_ = flash();
  avr_eeprom_desc_t all{};
  all.ee = reinterpret_cast<std::uint8_t*>(options_.eeprom.data());
  all.size = static_cast<std::uint32_t>(options_.eeprom.size());
  if (all.size > 0) avr_ioctl(a, AVR_IOCTL_EEPROM_SET, &all);
  a->reset_pc = static_cast<avr_flashaddr_t>(options_.bootloader.begin);
  std::uint32_t flags = 0;
  avr_ioctl(a, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
  avr_register_io_write(a, kGpior0, Hooks::marker, this);
  avr_irq_register_notify(avr_io_getirq(a, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_OUT_TRIGGER), Hooks::conversion,
                          this);
  avr_irq_register_notify(avr_io_getirq(a, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), Hooks::byte, this);
  reset();
  due_ = std::chrono::steady_clock::now();
}

UsbBoard::~UsbBoard() {
  avr_terminate(avr(avr_));
  free(avr_);
}

void UsbBoard::reset() {
  avr_t* a = avr(avr_);
  const avr_cycle_count_t cycle = a->cycle;
  avr_reset(a);
  a->cycle = cycle;
  a->run_cycle_limit = 16;
  a->data[kMcusr] |= kExtrf;
  incoming_.clear();
  outgoing_.clear();
  markers_ = 0;
  conversions_ = 0;
}

double UsbBoard::baud() const { return 10.0 * kClock_hz / static_cast<double>(byte_cycles()); }

// The wire's time for a byte, 8N1, as the registers say it: simavr's own has eleven bits.
std::uint64_t UsbBoard::byte_cycles() const {
  const std::uint8_t* data = avr(avr_)->data;
  const unsigned divisor = data[kUbrr0l] + 256U * (data[kUbrr0h] & 0xf) + 1;
  return 10 * ((data[kUcsr0a] & kU2x0) != 0 ? 8 : 16) * divisor;
}

void UsbBoard::exchange() {
  const std::vector<std::uint8_t> bytes = port_.read();
  const bool idle = incoming_.empty();
  incoming_.insert(incoming_.end(), bytes.begin(), bytes.end());
  received_ += static_cast<long>(bytes.size());
  if (idle && !incoming_.empty()) avr_cycle_timer_register(avr(avr_), 1, Hooks::deliver, this);
  if (!outgoing_.empty()) outgoing_.erase(0, port_.write(outgoing_));
}

void UsbBoard::run_millisecond() {
  avr_t* a = avr(avr_);
  const avr_cycle_count_t end = a->cycle + kMillisecond;
  avr_cycle_timer_register(a, kMillisecond, Hooks::stop, this);
  while (a->cycle < end) {
    const avr_flashaddr_t before = a->pc;
    const int state = avr_run(a);
    if (state == cpu_Done || state == cpu_Crashed) throw io::JobError("the board's program has stopped");
    // A watchdog that bit, as bootloaders start the program: it begins to count milestones anew.
    if (a->pc == a->reset_pc && before != a->reset_pc) markers_ = 0;
  }
  if (!frozen_.empty()) std::ranges::copy(frozen_, a->flash);
}

void UsbBoard::run_ms(int ms) {
  for (; ms > 0; --ms) {
    if (port_.was_opened()) reset();
    exchange();
    run_millisecond();
    due_ = std::max(due_ + std::chrono::milliseconds(1),
                    std::chrono::steady_clock::now() - std::chrono::milliseconds(20));
    std::this_thread::sleep_until(due_);
  }
}

// There stands cli, then a jump to itself: where a C program goes that has ended.
void UsbBoard::hang() {
  constexpr std::string_view kEnd = "\xf8\x94\xff\xcf";
  const std::size_t at = flash().find(kEnd);
  if (at == std::string::npos) throw io::JobError("the board has no program that can hang");
  avr(avr_)->pc = static_cast<avr_flashaddr_t>(at);
  avr(avr_)->state = cpu_Running;
}

std::string UsbBoard::flash() const {
  const avr_t* a = avr(avr_);
  return {reinterpret_cast<const char*>(a->flash), a->flashend + 1};
}

std::string UsbBoard::eeprom() const {
  avr_eeprom_desc_t all{};
  all.size = avr(avr_)->e2end + 1U;
  avr_ioctl(avr(avr_), AVR_IOCTL_EEPROM_GET, &all);
  return {reinterpret_cast<const char*>(all.ee), all.size};
}

}  // namespace flexor::cosim
