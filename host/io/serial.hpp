// A serial port: bytes out, and bytes in within a time.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

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
  int descriptor() const;  // readable once read() has something

 private:
  struct Asio;
  std::string path_;
  std::unique_ptr<Asio> asio_;
};

}  // namespace flexor::io
