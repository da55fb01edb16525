#include "host/io/posix_windows.hpp"

#include <windows.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <codecvt>
#include <filesystem>
#include <system_error>
#include <thread>

namespace {

// Windows' last error as errno; -1.
int failed() {
  const auto error =
      std::error_code(static_cast<int>(GetLastError()), std::system_category()).default_error_condition();
  errno = error.category() == std::generic_category() ? error.value() : EIO;
  return -1;
}

HANDLE handle_of(int file) { return reinterpret_cast<HANDLE>(_get_osfhandle(file)); }

std::atomic<void (*)(int)> on_alarm = nullptr;

}  // namespace

int open(const wchar_t* name, int flags, int) {
  const DWORD access = (flags & O_ACCMODE) == O_RDONLY ? GENERIC_READ
                       : (flags & O_ACCMODE) == O_RDWR ? GENERIC_READ | GENERIC_WRITE
                                                       : GENERIC_WRITE;
  const DWORD how = (flags & O_CREAT) == 0 ? OPEN_EXISTING : (flags & O_EXCL) != 0 ? CREATE_NEW : OPEN_ALWAYS;
  const HANDLE file = CreateFileW(name, access, FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE,
                                  nullptr, how, FILE_ATTRIBUTE_NORMAL, nullptr);
  if (file == INVALID_HANDLE_VALUE) return failed();
  return _open_osfhandle(reinterpret_cast<intptr_t>(file), (flags & (O_ACCMODE | O_APPEND)) | O_BINARY);
}

int stat(const wchar_t* name, struct stat* status) {
  const int failed = _wstat64(name, status);
  status->st_dev = 0;  // as fstat has it
  return failed;
}

int access(const wchar_t* name, int mode) { return _waccess(name, mode & ~X_OK); }

int rename(const wchar_t* from, const wchar_t* to) {
  constexpr int kAttempts = 40;
  for (int attempt = 1;; ++attempt) {
    if (MoveFileExW(from, to, MOVEFILE_REPLACE_EXISTING | MOVEFILE_WRITE_THROUGH) != 0) return 0;
    const DWORD error = GetLastError();
    if (attempt == kAttempts || (error != ERROR_SHARING_VIOLATION && error != ERROR_ACCESS_DENIED))
      return failed();
    Sleep(50);
  }
}

int flock(int file, int) {
  OVERLAPPED lock = {};
  lock.OffsetHigh = 1;  // others read who has it
  if (LockFileEx(handle_of(file), LOCKFILE_EXCLUSIVE_LOCK | LOCKFILE_FAIL_IMMEDIATELY, 0, 1, 0, &lock) != 0)
    return 0;
  if (GetLastError() != ERROR_LOCK_VIOLATION) return failed();
  errno = EWOULDBLOCK;
  return -1;
}

int fcntl(int file, int what, int) {
  if (what == F_DUPFD_CLOEXEC) return dup(file);
  return _get_osfhandle(file) == -1 ? -1 : O_RDWR;
}

int fsync(int file) { return FlushFileBuffers(handle_of(file)) != 0 ? 0 : failed(); }

ssize_t write(int file, const void* bytes, std::size_t count) {
  return _write(file, bytes, static_cast<unsigned>(std::min<std::size_t>(count, 1 << 20)));
}

ssize_t pread(int file, void* bytes, std::size_t count, off_t offset) {
  OVERLAPPED at = {};
  at.Offset = static_cast<DWORD>(offset);
  DWORD done = 0;
  const bool read = ReadFile(handle_of(file), bytes, static_cast<DWORD>(count), &done, &at) != 0;
  return read || GetLastError() == ERROR_HANDLE_EOF ? static_cast<ssize_t>(done) : failed();
}

char* mkdtemp(char* pattern) {
  const std::size_t letters = std::char_traits<char>::length(pattern) - 6;
  std::error_code error;
  for (unsigned number = GetTickCount() ^ (GetCurrentProcessId() << 8);; ++number) {
    for (std::size_t i = 0; i < 6; ++i) pattern[letters + i] = "0123456789abcdef"[number >> (4 * i) & 15];
    if (std::filesystem::create_directory(pattern, error)) return pattern;
    if (error) break;
  }
  errno = error.default_error_condition().value();
  return nullptr;
}

int gethostname(char* name, std::size_t size) {
  auto room = static_cast<DWORD>(size);
  return GetComputerNameA(name, &room) != 0 ? 0 : -1;
}

int poll(Waiting* files, std::size_t count, int timeout_ms) {
  const ULONGLONG begin = GetTickCount64();
  for (int ready = 0;; Sleep(1)) {
    for (Waiting* file = files; file != files + count; ++file) {
      DWORD bytes = 0;
      const bool is_pipe = file->fd >= 0 && GetFileType(handle_of(file->fd)) == FILE_TYPE_PIPE;
      const bool has_end =
          is_pipe && PeekNamedPipe(handle_of(file->fd), nullptr, 0, nullptr, &bytes, nullptr) == 0;
      const bool is_ready = file->fd >= 0 && (!is_pipe || bytes > 0 || has_end);
      file->revents = file->events == kToRead && !is_ready ? 0 : file->fd >= 0 ? file->events : 0;
      ready += file->revents != 0 ? 1 : 0;
    }
    if (ready > 0 || (timeout_ms >= 0 && GetTickCount64() - begin >= static_cast<ULONGLONG>(timeout_ms)))
      return ready;
  }
}

std::filesystem::path this_program() {
  std::wstring name(1 << 15, L'\0');
  name.resize(GetModuleFileNameW(nullptr, name.data(), static_cast<DWORD>(name.size())));
  return name;
}

int kill(pid_t process, int signal) {
  if (signal != 0) _exit(128 + signal);
  const HANDLE there = OpenProcess(SYNCHRONIZE, FALSE, static_cast<DWORD>(process));
  const bool runs = there != nullptr ? WaitForSingleObject(there, 0) == WAIT_TIMEOUT
                                     : GetLastError() == ERROR_ACCESS_DENIED;
  if (there != nullptr) CloseHandle(there);
  errno = runs ? 0 : ESRCH;
  return runs ? 0 : -1;
}

int sigaction(int signal, const struct sigaction* now, struct sigaction* before) {
  if (before != nullptr) before->sa_handler = SIG_DFL;
  if (now == nullptr) return 0;
  if (signal == SIGALRM) return on_alarm = now->sa_handler, 0;
  return std::signal(signal, now->sa_handler) == SIG_ERR ? -1 : 0;
}

unsigned alarm(unsigned seconds) {
  static std::atomic<unsigned> last = 0;
  const unsigned mine = ++last;
  if (seconds > 0)
    std::thread([=] {
      std::this_thread::sleep_for(std::chrono::seconds(seconds));
      if (last == mine) on_alarm.load()(SIGALRM);
    }).detach();
  return 0;
}

int pause() {
  Sleep(INFINITE);
  return -1;
}

// Names are UTF-8: GCC 12's std::filesystem::path makes them so, and reads them by these, which go by msvcrt's locale.
namespace std {

using Letters = codecvt<wchar_t, char, mbstate_t>;
using Utf8 = codecvt_utf8_utf16<wchar_t>;

Letters::result Letters::do_out(mbstate_t& state, const wchar_t* from, const wchar_t* end,
                                const wchar_t*& next, char* to, char* to_end, char*& to_next) const {
  return Utf8().out(state, from, end, next, to, to_end, to_next);
}
Letters::result Letters::do_in(mbstate_t& state, const char* from, const char* end, const char*& next,
                               wchar_t* to, wchar_t* to_end, wchar_t*& to_next) const {
  return Utf8().in(state, from, end, next, to, to_end, to_next);
}
int Letters::do_encoding() const noexcept { return 0; }
int Letters::do_length(mbstate_t& state, const char* from, const char* end, size_t most) const {
  return Utf8().length(state, from, end, most);
}
int Letters::do_max_length() const noexcept { return 4; }

}  // namespace std
