#include "cosim/usb_port.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/inotify.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/asio/serial_port_base.hpp>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>

#include "host/io/io.hpp"

namespace flexor::cosim {
UsbPort::UsbPort() {
  terminal_ = io::Descriptor(posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  std::array<char, 128> name{};
  if (!terminal_ || grantpt(terminal_.number()) != 0 || unlockpt(terminal_.number()) != 0 ||
      ptsname_r(terminal_.number(), name.data(), name.size()) != 0)
    throw io::JobError("pseudo-terminal: {}", std::strerror(errno));
  name_ = name.data();
  // Until it was opened and closed once, the terminal does not report that nobody has it open.
  const int once = open(name_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  termios raw{};
  tcgetattr(once, &raw);
  cfmakeraw(&raw);
  tcsetattr(once, TCSANOW, &raw);
  close(once);
  openings_ = io::Descriptor(inotify_init1(IN_NONBLOCK | IN_CLOEXEC));
  if (!openings_ || inotify_add_watch(openings_.number(), name_.c_str(), IN_OPEN | IN_CLOSE) < 0)
    throw io::JobError("{}: inotify: {}", name_, std::strerror(errno));
}

bool UsbPort::is_open() const {
  pollfd end{terminal_.number(), 0, 0};
  return ::poll(&end, 1, 0) == 0;
}

// Two openings at once may come as one event, and so may two closings: once nothing more comes, the terminal reports
// whether anybody is left.
bool UsbPort::was_opened() {
  const bool open = is_open();
  alignas(inotify_event) std::array<char, 4096> buffer{};
  bool out = false;
  const ssize_t n = ::read(openings_.number(), buffer.data(), buffer.size());
  inotify_event event{};
  for (ssize_t at = 0; at < n; at += static_cast<ssize_t>(sizeof(event)) + event.len) {
    std::memcpy(&event, buffer.data() + at, sizeof(event));
    const bool opened = (event.mask & IN_OPEN) != 0;
    out = out || (opened && open_by_ == 0);
    open_by_ = opened ? open_by_ + 1 : std::max(open_by_ - 1, 0);
  }
  if (n <= 0 && open == was_open_) open_by_ = open ? std::max(open_by_, 1) : 0;
  was_open_ = open;
  return out;
}

std::vector<std::uint8_t> UsbPort::read() {
  std::array<std::uint8_t, 1024> buffer{};
  const ssize_t n = ::read(terminal_.number(), buffer.data(), buffer.size());
  return {buffer.begin(), buffer.begin() + std::max<ssize_t>(n, 0)};
}

std::size_t UsbPort::write(std::string_view bytes) {
  const ssize_t n = ::write(terminal_.number(), bytes.data(), bytes.size());
  return n > 0 ? static_cast<std::size_t>(n) : 0;
}

double UsbPort::baud() const {
  termios settings{};
  if (tcgetattr(terminal_.number(), &settings) != 0) return 0;
  boost::asio::serial_port_base::baud_rate rate;
  boost::system::error_code unknown;
  rate.load(settings, unknown);
  return rate.value();
}

std::uint8_t UsbPort::on_the_wire(std::uint8_t byte, double board_baud) const {
  constexpr double kReceiverTakes = 0.045;  // off by half a bit at the tenth
  const bool agree = std::abs(baud() / board_baud - 1) < kReceiverTakes;
  return agree ? byte : static_cast<std::uint8_t>(byte * 37 + 0x81);
}

}  // namespace flexor::cosim
