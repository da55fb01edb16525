#include "host/study/journal.hpp"

#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>

#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/io/write_all.hpp"

namespace flexor::study {
namespace {
namespace fs = std::filesystem;

constexpr const char* kSeal = "rows_digest";

std::string me() {
  std::array<char, 256> host{};
  if (::gethostname(host.data(), host.size() - 1) != 0) host[0] = '?';
  return fmt::format("process {} on {} since {:%F %T}\n", ::getpid(), host.data(),
                     fmt::localtime(std::time(nullptr)));
}

// The first line of a lock; anything may have been put there.
std::string holder(int file) {
  std::array<char, 200> text{};
  const ssize_t bytes = ::pread(file, text.data(), text.size(), 0);
  std::string out(text.data(), static_cast<std::size_t>(std::max<ssize_t>(bytes, 0)));
  out = out.substr(0, out.find('\n'));
  std::ranges::replace_if(
      out, [](char c) { return static_cast<unsigned char>(c) < ' '; }, '?');
  return out.empty() ? "another process" : out;
}

// Whoever is done with a lock removes it: what was opened just before must not count.
bool is_still_there(int file, const fs::path& path) {
  struct stat mine {};
  struct stat there {};
  return ::fstat(file, &mine) == 0 && ::stat(path.c_str(), &there) == 0 && mine.st_ino == there.st_ino &&
         mine.st_dev == there.st_dev;
}

std::uintmax_t size_of(const fs::path& path) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  return error ? 0 : size;
}

std::string seal_of(const fs::path& folder) {
  const fs::path path = folder / "run.json";
  return io::parse_json(io::read_document(path), path.string()).value(kSeal, "");
}

}  // namespace

FolderLock::FolderLock(fs::path folder) : folder_(std::move(folder)) {
  io::require_folder(folder_);
  std::error_code error;
  made_ = !fs::exists(folder_, error);
  io::make_folder(folder_);
  const fs::path path = folder_ / "lock";
  for (;;) {
    file_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0644);
    if (file_ < 0) {
      throw io::InputError(fmt::format("{}: cannot be written: {}", path.string(), std::strerror(errno)));
    }
    if (::flock(file_, LOCK_EX | LOCK_NB) != 0) {
      const int reason = errno;
      const std::string who = holder(file_);
      ::close(file_);
      if (reason != EWOULDBLOCK) {
        throw io::InputError(fmt::format("{}: cannot be locked: {}", path.string(), std::strerror(reason)));
      }
      throw io::InputError(
          fmt::format("{}: another run works in this folder ({}): wait for it or choose another folder",
                      folder_.string(), who));
    }
    if (is_still_there(file_, path)) break;
    ::close(file_);
  }
  // Who, for others' information: the lock holds without it, on a full disk too.
  if (::ftruncate(file_, 0) == 0) (void)io::write_all(file_, me());
}

FolderLock::~FolderLock() {
  std::error_code ignored;
  fs::remove(folder_ / "lock", ignored);
  if (made_) ::rmdir(folder_.c_str());  // if it is empty
  ::close(file_);
}

Journal::Journal(const fs::path& folder, const std::string& settings, const std::string& header)
    : folder_(folder), path_(folder / "trials.csv"), header_(header) {
  std::error_code error;
  if (fs::exists(path_, error) && !fs::is_regular_file(path_, error)) {
    throw io::InputError(fmt::format("{}: is no ordinary file; choose another folder", path_.string()));
  }
  old_.open(path_, std::ios::binary);
  std::string line;
  const bool whole = old_.is_open() && std::getline(old_, line) && !old_.eof();
  if (whole && line + "\n" != header) {
    throw io::InputError(
        fmt::format("{}: its columns are not those of this version of Flexor: choose another "
                    "folder or remove it",
                    path_.string()));
  }
  require_same_run(settings, header);
  if (whole) kept_bytes_ = read_bytes_ = header.size();
}

bool is_same_run(const fs::path& folder, const std::string& settings) {
  const fs::path path = folder / "run.json";
  if (size_of(path) == 0) return false;
  const std::string text = io::read_file(path);
  auto there = nlohmann::ordered_json::parse(text, nullptr, false);
  if (there.is_object()) there.erase(kSeal);
  if (text == settings || io::dump(there) == settings) return true;
  throw io::InputError(
      fmt::format("{} holds the results of other settings (see run.json there): choose another folder "
                  "or remove it",
                  folder.string()));
}

void seal(const fs::path& folder, const std::string& settings, const std::string& digest) {
  if (is_sealed(folder)) return require_sealed(folder, digest);
  auto json = nlohmann::ordered_json::parse(settings);
  json[kSeal] = digest;
  io::write_file(folder / "run.json", io::dump(json));
}

bool is_sealed(const fs::path& folder) { return !seal_of(folder).empty(); }

void require_sealed(const fs::path& folder, const std::string& digest) {
  const std::string there = seal_of(folder);
  if (there == digest) return;
  if (there.empty())
    throw io::InputError(
        fmt::format("{}: its run has not ended: give that shard's command once more, it goes on from there",
                    folder.string()));
  throw io::InputError(
      fmt::format("{}: its rows are not those that its run ended with: give that shard's command into a new "
                  "folder",
                  folder.string()));
}

void Journal::require_same_run(const std::string& settings, const std::string& header) {
  if (is_same_run(folder_, settings)) return;
  // run.json is written first: rows without it are somebody else's.
  if (size_of(path_) > header.size()) {
    throw io::InputError(
        fmt::format("{}: no run.json beside it says what these rows are: choose another folder or remove it",
                    path_.string()));
  }
  io::write_file(folder_ / "run.json", settings);
}

bool Journal::next(std::string& row) {
  if (kept_bytes_ == 0 || !std::getline(old_, row) || old_.eof()) return false;
  read_bytes_ += row.size() + 1;
  return true;
}

void Journal::start() {
  old_.close();
  file_.emplace(path_, kept_bytes_);
  if (kept_bytes_ == 0) file_->append(header_);
}

}  // namespace flexor::study
