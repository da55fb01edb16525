// A board's flash through its bootloader, by avrdude: no programmer, no compiler. A board with a USB converter of its
// own (Nano, Uno) is reset when its port is opened and listens for about a second.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "host/deploy/intel_hex.hpp"
#include "host/deploy/mcu.hpp"

namespace flexor::deploy {

inline constexpr std::size_t kOptibootBegin = 0x7e00;  // new bootloader, 115200 baud
inline constexpr int kOldRate_Bd = 57600;
inline constexpr std::size_t kOldBootloaderBegin = 0x7800;  // of Nanos before 2018, 57600 baud

// The image in the folder of a deployment, of `board`, which is glove, hand or empty: the only one there is; or `what` itself, a
// file. Throws io::InputError.
std::filesystem::path image_of(const std::string& what, const std::string& board);

// An image that the bootloader of its chip, mcu_of(), can write: read_intel_hex, and nothing where the bootloader itself
// lies. Throws io::InputError.
FlashContent read_image(const std::filesystem::path& hex);

// `port`, or with "auto" the only one there is. Throws io::InputError, one line: none or several, no such port, no
// permission (the group that has it).
std::string choose_port(const std::string& port, const std::filesystem::path& dev = "/dev");

// "writing" or "verifying" or "reading" at a rate, so many percent; "connecting" with 0.
using FlashProgress = std::function<void(const std::string& what, int percent)>;

class Bootloader {
 public:
  // At the first command `baud` is tried, or for 0 the new bootloader's rate, then the old one's; all twice, since a reset
  // may come late. Throws io::InputError where avrdude is missing.
  Bootloader(std::string port, int baud, FlashProgress progress);

  // Both throw io::JobError, one line: no answer at any rate, another chip than the image is for, an image that does not fit this
  // bootloader, a byte that reads back otherwise, a board that falls silent.
  void write(const FlashContent& image);  // and compares
  FlashContent read();                    // up to the last byte that is not erased

  int rate_Bd() const { return rates_Bd_.front(); }  // after the first command: the bootloader's

 private:
  // False: nobody answers at this rate.
  bool run(const std::string& operation, const std::filesystem::path& folder);
  void run_at_any_rate(const std::string& operation, const std::filesystem::path& folder, std::size_t end);

  std::string port_;
  std::vector<int> rates_Bd_;
  FlashProgress progress_;
};

}  // namespace flexor::deploy
