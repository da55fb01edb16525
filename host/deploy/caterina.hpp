// The bootloader of boards with an ATmega32U4 (Leonardo, Micro, Pro Micro; "Caterina", avrdude's avr109): it has a USB
// port of its own, which is there for eight seconds after the reset button, twice pressed on a Pro Micro, or after a
// port of the Arduino core's was opened at 1200 baud and closed.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

namespace flexor::deploy {

struct CaterinaPatience {
  double leaves_s = 1.5;  // until a port that was touched is gone; else it is the bootloader's already
  double comes_s = 8;     // from there until the bootloader's comes
  double button_s = 30;   // for the reset button, where there is no port
};

// The bootloader's port. `port` is touched where it is there; where it is not, or with "auto" none is, `say` gets what to
// press and the first port that comes is the bootloader's: an image of flexor deploy has no USB. Throws io::InputError,
// one line: several ports with "auto", no permission; none came.
std::string caterina_port(const std::string& port, const std::function<void(const std::string&)>& say,
                          const std::filesystem::path& dev = "/dev", const CaterinaPatience& patience = {});

}  // namespace flexor::deploy
