#include "host/io/folder_lock.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>

#include "host/io/io.hpp"

namespace flexor::io {
namespace {
namespace fs = std::filesystem;

constexpr const char* kNobody = "another process";

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
  return out.empty() ? kNobody : out;
}

// Whoever is done with a lock removes it: what was opened just before must not count.
bool is_still_there(int file, const fs::path& path) {
  struct stat mine {};
  struct stat there {};
  return ::fstat(file, &mine) == 0 && ::stat(path.c_str(), &there) == 0 && mine.st_ino == there.st_ino &&
         mine.st_dev == there.st_dev;
}

}  // namespace

FolderLock::FolderLock(fs::path folder, std::string_view kind, const std::vector<std::string_view>& files)
    : folder_(std::move(folder)) {
  require_folder(folder_, kind);
  std::vector<std::string_view> written = files;
  if (!kind.empty()) written.insert(written.end(), {"results.json", "report.html"});
  for (const std::string_view file : written)
    if (fs::exists(folder_ / file)) require_writable(folder_ / file);
  std::error_code error;
  made_ = !fs::exists(folder_, error);
  make_folder(folder_);
  const fs::path path = folder_ / "lock";
  do {
    file_ = Descriptor(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0644));
    const int reason = file_ ? EINVAL : errno;
    // Left by another user: to hold it, reading is enough.
    if (!file_) file_ = Descriptor(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC | O_NOFOLLOW));
    struct stat status {};
    if (!file_ || ::fstat(file_.number(), &status) != 0 || !S_ISREG(status.st_mode))
      throw InputError("{}: cannot be written: {}", path.string(), std::strerror(reason));
    if (::flock(file_.number(), LOCK_EX | LOCK_NB) == 0) continue;
    if (errno != EWOULDBLOCK)
      throw InputError("{}: cannot be locked: {}", path.string(), std::strerror(errno));
    throw InputError("{}: another run works in this folder ({}): wait for it or choose another folder",
                     folder_.string(), holder(file_.number()));
  } while (!is_still_there(file_.number(), path));
  if (const std::string who = holder(file_.number()); who != kNobody && !who.starts_with("process "))
    throw InputError("{}: is no lock of a job: move it elsewhere", path.string());
  // Who, for others' information: the lock holds without it, on a full disk too.
  if (::ftruncate(file_.number(), 0) == 0) (void)write_all(file_.number(), me());
}

FolderLock::~FolderLock() {
  std::error_code ignored;
  fs::remove(folder_ / "lock", ignored);
  if (made_) fs::remove(folder_, ignored);  // if it is empty
}

}  // namespace flexor::io
