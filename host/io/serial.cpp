#include "host/io/serial.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/file.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/serial_port.hpp>
#include <boost/asio/write.hpp>
#include <cmath>

#include "host/io/interrupt.hpp"
#include "host/io/io.hpp"

namespace flexor::io {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

std::string refusal(const std::string& path, const error_code& error) {
  if (error == boost::system::errc::permission_denied) {
    return fmt::format(
        "{}: permission denied: join the group that owns it (sudo usermod -a -G dialout $USER), "
        "then log in again",
        path);
  }
  if (error == boost::system::errc::no_such_file_or_directory)
    return fmt::format("{}: there is no such port: is the board plugged in?", path);
  if (error == boost::system::errc::device_or_resource_busy)
    return fmt::format("{}: is in use: close the program that has it open", path);
  return fmt::format("{}: cannot be opened as a serial port ({})", path, error.message());
}

}  // namespace

struct SerialPort::Asio {
  asio::io_context context;
  asio::serial_port port{context};
};

SerialPort::SerialPort(const std::string& path, unsigned baud)
    : path_(path), asio_(std::make_unique<Asio>()) {
  error_code error;
  asio_->port.open(path, error);
  if (error) throw InputError(refusal(path, error));
  // Two that read one port would each get a part of what it says.
  if (::flock(asio_->port.native_handle(), LOCK_EX | LOCK_NB) != 0)
    throw InputError("{}: another flexor listens to it: end that one, or record in its page", path);
  using Option = asio::serial_port_base;
  if (!set_baud(baud)) throw InputError("{}: does not do {} baud", path, baud);
  asio_->port.set_option(Option::character_size(8), error);
  asio_->port.set_option(Option::parity(Option::parity::none), error);
  asio_->port.set_option(Option::stop_bits(Option::stop_bits::one), error);
  asio_->port.set_option(Option::flow_control(Option::flow_control::none), error);
}

SerialPort::~SerialPort() = default;

bool SerialPort::set_baud(unsigned baud) {
  error_code error;
  asio_->port.set_option(asio::serial_port_base::baud_rate(baud), error);
  return !error;
}

int SerialPort::descriptor() const { return asio_->port.native_handle(); }

void SerialPort::write(std::span<const std::uint8_t> bytes) {
  error_code error;
  asio::write(asio_->port, asio::buffer(bytes.data(), bytes.size()), error);
  if (error) throw JobError("{}: the port has gone ({})", path_, error.message());
}

std::vector<std::uint8_t> SerialPort::read(double timeout_s) {
  pollfd ready{descriptor(), POLLIN, 0};
  const int count = ::poll(&ready, 1, static_cast<int>(std::ceil(1000 * timeout_s)));
  go_on();
  if (count <= 0) return {};
  std::vector<std::uint8_t> out(512);
  error_code error;
  out.resize(asio_->port.read_some(asio::buffer(out), error));
  if (error) throw JobError("{}: the port has gone ({})", path_, error.message());
  return out;
}

}  // namespace flexor::io
