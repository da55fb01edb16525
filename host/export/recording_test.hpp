// For tests only: a CSV file for the time being, and a place beside it.
#pragma once

#include <filesystem>
#include <string>

#include "host/io/io.hpp"

namespace flexor::exports {

class TestRecording {
 public:
  explicit TestRecording(const std::string& text) { io::write_file(path(), text); }
  std::filesystem::path path() const { return folder_.path() / "log.csv"; }
  std::filesystem::path beside(const std::string& name) const { return folder_.path() / name; }
  // What lies there, the recording included.
  std::size_t files() const {
    std::size_t count = 0;
    for ([[maybe_unused]] const auto& entry : std::filesystem::recursive_directory_iterator(folder_.path()))
      ++count;
    return count;
  }

 private:
  io::TemporaryFolder folder_;
};

}  // namespace flexor::exports
