#include "host/deploy/out_folder.hpp"

#include <array>
#include <cerrno>
#include <cstring>
#include <string_view>

namespace flexor::deploy {
namespace {

namespace fs = std::filesystem;
using io::InputError;

constexpr const char* kStaging = ".deploy-";
constexpr const char* kWhole = ".whole";      // in it: all files are there
constexpr const char* kOld = "old";           // in it: those that were there
constexpr const char* kCleared = ".cleared";  // in it: the old ones have gone

// All that a deployment consists of beside the key.
constexpr std::array kParts = {"glove.hex",   "hand.hex",         kHardwareFile,     kArduinoFolder,
                               "wiring.md",   "wiring_glove.svg", "wiring_hand.svg", "report.html",
                               "report.json", "results.json",     "time_budget.svg"};

bool is_there(const fs::path& path) {
  std::error_code error;
  return fs::symlink_status(path, error).type() != fs::file_type::not_found;
}

void move(const fs::path& from, const fs::path& to) {
  std::error_code error;
  fs::create_directories(to.parent_path(), error);
  if (!error) fs::rename(from, to, error);
  if (error) throw InputError("{}: cannot be written: {}", to.string(), error.message());
}

}  // namespace

OutFolder::OutFolder(const fs::path& folder) : folder_(fs::absolute(folder)), lock_(folder_) {
  for (const char* part : kParts) {
    std::error_code error;
    const bool is_folder = part == std::string_view(kArduinoFolder);
    if (is_there(folder_ / part) && fs::is_directory(folder_ / part, error) != is_folder)
      throw InputError("{}: cannot be written: a {} has this name", (folder_ / part).string(),
                       is_folder ? "file" : "folder");
  }
  end_what_was_cut_off();
  std::string pattern = (folder_ / (std::string(kStaging) + "XXXXXX")).string();
  if (mkdtemp(pattern.data()) == nullptr)
    throw InputError("{}: cannot be written: {}", folder_.string(), std::strerror(errno));
  staging_.emplace(pattern);
}

void OutFolder::publish() {
  try {
    io::write_file(staging() / kWhole, "");
    replace(staging());
  } catch (...) {
    // What was there is in it: the next that opens this folder ends what was begun.
    if (!put_back()) staging_->keep();
    throw;
  }
}

// One that had begun to publish has all its files here, or in their places.
void OutFolder::end_what_was_cut_off() const {
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder_, ignored)) {
    if (!entry.path().filename().string().starts_with(kStaging)) continue;
    if (is_there(entry.path() / kWhole)) replace(entry.path());
    fs::remove_all(entry.path(), ignored);
  }
}

// False: new files are in their places already, or the old ones do not go back.
bool OutFolder::put_back() const {
  if (is_there(staging() / kCleared)) return false;
  std::error_code error;
  for (const char* part : kParts) {
    if (is_there(folder_ / part)) continue;
    fs::rename(staging() / kOld / part, folder_ / part, error);
    if (error && is_there(staging() / kOld / part)) return false;
  }
  return true;
}

// May be cut off anywhere, and done again.
void OutFolder::replace(const fs::path& staged) const {
  const fs::path old = staged / kOld;
  for (const char* part : kParts) {
    if (!is_there(staged / kCleared) && is_there(folder_ / part)) move(folder_ / part, old / part);
  }
  io::write_file(staged / kCleared, "");
  if (is_there(staged / kKeyFile)) move(staged / kKeyFile, folder_ / kKeyFile);
  for (const char* part : kParts) {
    if (is_there(staged / part)) move(staged / part, folder_ / part);
  }
}

}  // namespace flexor::deploy
