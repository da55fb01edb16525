// Model -> firmware: configuration, both images, folders for the Arduino IDE, and what was measured of them.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host/deploy/config.hpp"
#include "host/model/lti.hpp"

namespace flexor::deploy {

inline constexpr double kWorstError_deg = model::kFixedError_deg;
inline constexpr int kFlashBudget = 10240;      // bytes of an image whose model is code: a third of the flash
inline constexpr int kRamBudget = 640;          // bytes, static: a third of the RAM
inline constexpr int kHandFlashBudget = 12288;  // with its watch: docs/adr/0015-hand-watches-motors.md
inline constexpr int kHandRamBudget = 720;

struct Image {
  std::filesystem::path elf;
  std::filesystem::path hex;
  int flash_bytes = 0;  // code and initialised data
  int ram_bytes = 0;    // static
};

// avr-g++ is in the folders of `path`, or io::InputError that says what to install.
void require_toolchain(const char* path = std::getenv("PATH"));

// The compiler with the options of every image; what it compiles, and from where, is to be appended.
std::vector<std::string> compiler();

// Writes the configuration and the images NAME.elf and NAME.hex into `folder`. Throws io::InputError when an
// image does not fit the microcontroller, io::JobError when the compiler fails.
Image build_glove(const Glove& glove, const std::filesystem::path& folder);
// Likewise from a text that takes the place of glove_config(): for comparisons.
Image build_glove(const std::string& config, const std::filesystem::path& folder);
Image build_hand(const Hand& hand, const std::filesystem::path& folder);

// Library folders that the Arduino IDE takes as they are, with an example sketch each.
void write_arduino(const Glove& glove, const Hand& hand, const std::filesystem::path& folder);

// Largest |fixed point - double| of any joint, degrees, both given the same inputs.
struct Error {
  double range_deg = 0;                 // the worst that a search over all valid inputs finds
  std::optional<double> recording_deg;  // over what was given
  double worst_deg() const { return std::max(range_deg, recording_deg.value_or(0)); }
};

// recording: readings of the model's inputs, a row for each sample; empty: none. Throws io::InputError when the error
// exceeds kWorstError_deg.
Error fixed_point_error(const model::Model& model, const std::vector<std::vector<double>>& recording);

}  // namespace flexor::deploy
