// A deployment's folder. Everything is made in a folder of its own inside, which only its owner can read, and
// takes the old deployment's place at the end: whenever a run is cut off, images that are there have the key
// that is there. First the old images go, then the key changes, then the new ones come; a run that was cut off in
// between is ended by the next.
#pragma once

#include <filesystem>
#include <optional>

#include "host/io/folder_lock.hpp"
#include "host/io/io.hpp"

namespace flexor::deploy {

inline constexpr const char* kKeyFile = "pair.key";
inline constexpr const char* kHardwareFile = "hardware.json";
inline constexpr const char* kArduinoFolder = "arduino/Flexor";

class OutFolder {
 public:
  // Makes `folder` where there is none, and ends or removes what a run that was cut off has left in it. Throws
  // io::InputError when it cannot be made, something else has the name of an image, or another run writes there. Until the end, new files of this process are readable by their owner alone.
  // Without publish() it is as if nothing had been.
  explicit OutFolder(const std::filesystem::path& folder);

  // To be filled: images, arduino/, reports, and kKeyFile when the key changes.
  const std::filesystem::path& staging() const { return staging_->path(); }

  // Puts what is in staging() in place of the old deployment; other files in the folder stay. Throws
  // io::InputError.
  void publish();

 private:
  struct OwnersAlone {
    unsigned before = umask(0077);
    ~OwnersAlone() { umask(before); }
  };

  void replace(const std::filesystem::path& staged) const;
  bool put_back() const;
  void end_what_was_cut_off() const;

  std::filesystem::path folder_;
  OwnersAlone owners_alone_;
  io::FolderLock lock_;
  std::optional<io::Temporary> staging_;
};

}  // namespace flexor::deploy
