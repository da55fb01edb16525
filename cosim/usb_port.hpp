// A board's serial port as a PC has it: a pseudo-terminal. Bytes between ends whose rates differ arrive as noise.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "host/io/descriptor.hpp"

namespace flexor::cosim {

class UsbPort {
 public:
  // Throws io::JobError.
  UsbPort();

  const std::string& name() const { return name_; }

  // Whether the first of whoever has it open has opened it since the last call, which resets a board. An opening counts
  // also right after a closing: a capacitor at DTR misses none.
  bool was_opened();
  bool is_open() const;

  // What the PC sent.
  std::vector<std::uint8_t> read();
  // How much of it there is room for.
  std::size_t write(std::string_view bytes);

  // The PC's rate; 0: none of the usual.
  double baud() const;
  // A byte between the PC and a board of this rate.
  std::uint8_t on_the_wire(std::uint8_t byte, double board_baud) const;

 private:
  io::Descriptor terminal_;
  std::string name_;
  io::Descriptor openings_;  // inotify of the port
  int open_by_ = 0;          // so many, by the events
  bool was_open_ = false;
};

}  // namespace flexor::cosim
