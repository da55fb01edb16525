// A serial port: bytes out, and bytes in within a time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace boost::asio {
class io_context;
}

namespace flexor::io {

class SerialPort {
 public:
  // 8N1 without flow control. Throws InputError, one line with the mend: no such port, no permission, no serial port,
  // a rate that it does not have.
  SerialPort(const std::string& path, unsigned baud);
  ~SerialPort();
  SerialPort(const SerialPort&) = delete;
  SerialPort& operator=(const SerialPort&) = delete;

  // False: the port does not have this rate, and keeps its own.
  bool set_baud(unsigned baud);

  // All of it. Throws JobError when the port has gone.
  void write(std::span<const std::uint8_t> bytes);
  // What comes first, as soon as it comes; empty: nothing within the time. Throws JobError when the port has gone.
  std::vector<std::uint8_t> read(double timeout_s);
  int descriptor() const;  // readable once read() has something; -1: this system has none

 private:
  struct Asio;
  std::string path_;
  std::unique_ptr<Asio> asio_;
};

// Serial ports that may be boards: below `dev` one path for each, names of serial/by-id, then ttyUSB*, ttyACM* that have none; on
// Windows COM3.
std::vector<std::string> serial_ports(const std::filesystem::path& dev = "/dev");
bool is_there(const std::string& port);
// Its whole name. Throws InputError, one line: no such port, no permission (the group that has it).
std::string require_port(const std::string& port);

// A port, raw at 115200 baud, or a FIFO, to write lines into without waiting; -errno: none, with ENOTTY neither.
int open_for_lines(const std::filesystem::path& path, bool& is_port);

// Until what it gives is let go: calls `readable` on the context's thread whenever the descriptor has something.
std::shared_ptr<void> watch(boost::asio::io_context& context, int descriptor, std::function<void()> readable);

}  // namespace flexor::io
