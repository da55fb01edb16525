// The bootloader of boards with an ATmega32U4 (Leonardo, Micro, Pro Micro; "Caterina", avrdude's avr109): it has a USB
// port of its own, which is there for eight seconds after the reset button, twice pressed on a Pro Micro, or after a
// port of the Arduino core's was opened at 1200 baud and closed.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

namespace flexor::deploy {

struct CaterinaPatience {
  double leaves_s = 1.5;  // until a port that was touched is gone
  double comes_s = 8;     // from there until the bootloader's comes
  double button_s = 30;   // for the reset button, where there is no port
};

// The bootloader's port. `port` is touched where it is there, with "auto" the only one; if it leaves, what comes next is
// the bootloader's, whatever its name. A named port that stays is the bootloader's already; one of "auto" is another
// board. Else, since an image of flexor deploy has no USB, `say` gets what to press and the first port that comes is it.
// Throws io::InputError, one line: no permission; none came.
std::string caterina_port(const std::string& port, const std::function<void(const std::string&)>& say,
                          const std::filesystem::path& dev = "/dev", const CaterinaPatience& patience = {});

}  // namespace flexor::deploy
