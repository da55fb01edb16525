#include "cosim/usb_board.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <simavr/avr_adc.h>
#include <simavr/avr_eeprom.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_core.h>
#include <sys/inotify.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <thread>

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

double baud_of(speed_t speed) {
  if (speed == B57600) return 57600;
  if (speed == B115200) return 115200;
  return speed == B9600 ? 9600 : 0;
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
    if (b.open_by_ > 0) b.outgoing_ += static_cast<char>(b.on_the_wire(static_cast<std::uint8_t>(value)));
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
    const std::uint8_t value = b.on_the_wire(b.incoming_.front());
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
  open_port();
  reset();
  due_ = std::chrono::steady_clock::now();
}

UsbBoard::~UsbBoard() {
  close(openings_);
  close(terminal_);
  avr_terminate(avr(avr_));
  free(avr_);
}

void UsbBoard::open_port() {
  terminal_ = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  std::array<char, 128> name{};
  if (terminal_ < 0 || grantpt(terminal_) != 0 || unlockpt(terminal_) != 0 ||
      ptsname_r(terminal_, name.data(), name.size()) != 0)
    throw io::JobError(fmt::format("pseudo-terminal: {}", std::strerror(errno)));
  port_ = name.data();
  // Until it was opened and closed once, the terminal does not say that nobody has it open.
  const int once = open(port_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  termios raw{};
  tcgetattr(once, &raw);
  cfmakeraw(&raw);
  tcsetattr(once, TCSANOW, &raw);
  close(once);
  openings_ = inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
  if (openings_ < 0 || inotify_add_watch(openings_, port_.c_str(), IN_OPEN | IN_CLOSE) < 0)
    throw io::JobError(fmt::format("{}: inotify: {}", port_, std::strerror(errno)));
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

// The wire's time for a byte, 8N1, as the registers say it: simavr's own has eleven bits.
std::uint64_t UsbBoard::byte_cycles() const {
  const std::uint8_t* data = avr(avr_)->data;
  const unsigned divisor = data[kUbrr0l] + 256U * (data[kUbrr0h] & 0xf) + 1;
  return 10 * ((data[kUcsr0a] & kU2x0) != 0 ? 8 : 16) * divisor;
}

bool UsbBoard::rates_agree() const {
  constexpr double kReceiverTakes = 0.045;  // off by half a bit at the tenth
  termios settings{};
  if (tcgetattr(terminal_, &settings) != 0) return false;
  const double ours = 10.0 * kClock_hz / static_cast<double>(byte_cycles());
  return std::abs(baud_of(cfgetospeed(&settings)) / ours - 1) < kReceiverTakes;
}

std::uint8_t UsbBoard::on_the_wire(std::uint8_t byte) const {
  return rates_agree() ? byte : static_cast<std::uint8_t>(byte * 37 + 0x81);
}

// Each opening counts, also one right after a closing: a capacitor at DTR misses none.
void UsbBoard::look_at_port() {
  alignas(inotify_event) std::array<char, 4096> buffer{};
  const ssize_t n = read(openings_, buffer.data(), buffer.size());
  inotify_event event{};
  for (ssize_t at = 0; at < n; at += static_cast<ssize_t>(sizeof(event)) + event.len) {
    std::memcpy(&event, buffer.data() + at, sizeof(event));
    const bool opened = (event.mask & IN_OPEN) != 0;
    if (opened && open_by_ == 0) reset();
    open_by_ += opened ? 1 : -1;
  }
}

void UsbBoard::exchange() {
  std::array<std::uint8_t, 1024> buffer{};
  const ssize_t n = read(terminal_, buffer.data(), buffer.size());
  const bool idle = incoming_.empty();
  if (n > 0) {
    incoming_.insert(incoming_.end(), buffer.begin(), buffer.begin() + n);
    received_ += n;
  }
  if (idle && !incoming_.empty()) avr_cycle_timer_register(avr(avr_), 1, Hooks::deliver, this);
  if (outgoing_.empty()) return;
  const ssize_t written = write(terminal_, outgoing_.data(), outgoing_.size());
  if (written > 0) outgoing_.erase(0, static_cast<std::size_t>(written));
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
    look_at_port();
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
