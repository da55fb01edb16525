#include "host/io/serial.hpp"

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/serial_port.hpp>
#include <boost/asio/write.hpp>
#include <chrono>
#include <optional>

#include "host/io/interrupt.hpp"
#include "host/io/io.hpp"
#include "host/io/posix.hpp"

namespace flexor::io {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

}  // namespace

struct SerialPort::Asio {
  asio::io_context context;
  asio::serial_port port{context};
};

SerialPort::SerialPort(const std::string& path, unsigned baud)
    : path_(path), asio_(std::make_unique<Asio>()) {
  error_code error;
  asio_->port.open(require_port(path), error);
  if (error == boost::system::errc::device_or_resource_busy ||
      error == boost::system::errc::permission_denied)
    throw InputError("{}: is in use: close the program that has it open", path);
  if (error) throw InputError("{}: cannot be opened as a serial port ({})", path, error.message());
  // Two that read one port would each get a part of what it sends.
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

void SerialPort::write(std::span<const std::uint8_t> bytes) {
  error_code error;
  asio::write(asio_->port, asio::buffer(bytes.data(), bytes.size()), error);
  if (error) throw JobError("{}: the port has gone ({})", path_, error.message());
}

std::vector<std::uint8_t> SerialPort::read(double timeout_s) {
  std::vector<std::uint8_t> out(512);
  std::optional<error_code> error;
  asio_->port.async_read_some(asio::buffer(out), [&](const error_code& how, std::size_t count) {
    error = how;
    out.resize(count);
  });
  asio_->context.restart();
  asio_->context.poll();
  if (!error && timeout_s > 0)
    asio_->context.run_for(std::chrono::microseconds(static_cast<std::int64_t>(1e6 * timeout_s)));
  if (!error) {
    asio_->port.cancel();
    asio_->context.restart();
    asio_->context.run();
  }
  go_on();
  if (*error && *error != asio::error::operation_aborted)
    throw JobError("{}: the port has gone ({})", path_, error->message());
  return out;
}

#ifdef _WIN32
int SerialPort::descriptor() const { return -1; }
std::shared_ptr<void> watch(asio::io_context&, int, std::function<void()>) { return {}; }
#else
int SerialPort::descriptor() const { return asio_->port.native_handle(); }

std::shared_ptr<void> watch(asio::io_context& context, int descriptor, std::function<void()> readable) {
  using Stream = asio::posix::stream_descriptor;
  const auto stream = std::make_shared<Stream>(context, descriptor);
  const auto wait = [stream, act = std::move(readable)](const auto& again) -> void {
    stream->async_wait(Stream::wait_read, [stream, act, again](const error_code& error) {
      if (error || !stream->is_open()) return;
      act();
      if (stream->is_open()) again(again);
    });
  };
  wait(wait);
  return {stream.get(), [stream](void*) { stream->release(); }};
}
#endif

}  // namespace flexor::io
