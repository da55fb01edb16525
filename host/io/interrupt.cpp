#include "host/io/interrupt.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <mutex>

namespace flexor::io {
namespace {

constexpr std::array kSignals{SIGINT, SIGTERM, SIGHUP};
constexpr int kHalt = SIGUSR2;  // to this process's own threads

// Changed only inside a Section; read by the handler when there is none. Never destroyed: a signal may come
// at any time.
struct Live {
  std::mutex mutex;
  std::list<std::string> paths;
  std::list<pid_t> children;
};

Live& live() {
  static Live& all = *new Live;
  return all;
}

std::atomic<bool> ending = false;
std::atomic<int> sections = 0;
std::atomic<int> halted = 0;
std::array<char, 1001> note{};
bool terminal = false;
LastWord last_word = LastWord::interrupted;

[[noreturn]] void wait_for_the_end() {
  for (;;) pause();
}

// Signals wait until it is over, in this thread because they are blocked, in others because the handler looks
// at `sections`.
class Section {
 public:
  Section() {
    sigset_t blocked;
    sigemptyset(&blocked);
    for (const int s : kSignals) sigaddset(&blocked, s);
    pthread_sigmask(SIG_BLOCK, &blocked, &before_);
    ++sections;
    if (ending) {
      --sections;
      wait_for_the_end();
    }
    live().mutex.lock();
  }
  ~Section() {
    live().mutex.unlock();
    --sections;
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }
  Section(const Section&) = delete;
  Section& operator=(const Section&) = delete;
  const sigset_t& before() const { return before_; }

 private:
  sigset_t before_;
};

// From here to the end of on_signal: only what POSIX allows in a signal handler, so no memory, no locks, no
// readdir.

void pause_ms(int ms) {
  const timespec span{0, ms * 1'000'000L};
  nanosleep(&span, nullptr);
}

// The other threads stop where they are: what they write to is about to go, and must not look like a fault.
void halt_other_threads() {
  constexpr int kPatience_ms = 200;
  const int folder = open("/proc/self/task", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) return;
  const auto self = static_cast<pid_t>(syscall(SYS_gettid));
  int asked = 0;
  alignas(dirent64) std::array<char, 2048> buffer;
  for (long n = 0; (n = syscall(SYS_getdents64, folder, buffer.data(), buffer.size())) > 0;) {
    for (long at = 0; at < n;) {
      const auto* entry = reinterpret_cast<const dirent64*>(buffer.data() + at);
      at += entry->d_reclen;
      pid_t thread = 0;
      for (const char* c = entry->d_name; *c >= '0' && *c <= '9'; ++c) thread = 10 * thread + (*c - '0');
      if (thread > 0 && thread != self && syscall(SYS_tgkill, getpid(), thread, kHalt) == 0) ++asked;
    }
  }
  close(folder);
  for (int ms = 0; ms < kPatience_ms && halted < asked; ++ms) pause_ms(1);
}

void remove_tree(int parent, const char* name, int depth) {
  constexpr int kDeepest = 32;
  constexpr int kAttempts = 20;  // something may still write into it
  if (unlinkat(parent, name, 0) == 0 || (errno != EISDIR && errno != EPERM) || depth > kDeepest) return;
  const int folder = openat(parent, name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (folder < 0) return;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    lseek(folder, 0, SEEK_SET);
    alignas(dirent64) std::array<char, 2048> buffer;
    for (long n = 0; (n = syscall(SYS_getdents64, folder, buffer.data(), buffer.size())) > 0;) {
      for (long at = 0; at < n;) {
        const auto* entry = reinterpret_cast<const dirent64*>(buffer.data() + at);
        at += entry->d_reclen;
        if (std::strcmp(entry->d_name, ".") == 0 || std::strcmp(entry->d_name, "..") == 0) continue;
        remove_tree(folder, entry->d_name, depth + 1);
      }
    }
    if (unlinkat(parent, name, AT_REMOVEDIR) == 0 || errno != ENOTEMPTY) break;
    pause_ms(5);
  }
  close(folder);
}

void end_child(pid_t child) {
  constexpr int kPatience_ms = 2000;
  if (child <= 1) return;
  kill(-child, SIGTERM);  // compilers remove their own temporaries then
  for (int ms = 0; ms < kPatience_ms && waitpid(child, nullptr, WNOHANG) == 0; ++ms) pause_ms(1);
  kill(-child, SIGKILL);
}

void say(const char* text) {
  std::size_t length = std::strlen(text);
  while (length > 0) {
    const ssize_t n = write(STDERR_FILENO, text, length);
    if (n <= 0) return;
    text += n;
    length -= static_cast<std::size_t>(n);
  }
}

void on_halt(int) {
  ++halted;
  wait_for_the_end();
}

void on_signal(int signal) {
  if (ending.exchange(true)) wait_for_the_end();
  constexpr int kPatience_ms = 1000;
  // Whoever is in one for longer waits for what this thread holds, the allocator's lock perhaps: the lists are whole then.
  for (int ms = 0; ms < kPatience_ms && sections > 0; ++ms) pause_ms(1);
  halt_other_threads();
  for (const pid_t child : live().children) end_child(child);
  for (const std::string& path : live().paths) remove_tree(AT_FDCWD, path.c_str(), 0);
  if (last_word == LastWord::interrupted) {
    say(terminal ? "\r\033[Kflexor: " : "flexor: ");
    say(note[0] != '\0' ? note.data() : "interrupted");
    say("\n");
  }
  ::signal(signal, SIG_DFL);
  raise(signal);  // comes as soon as this handler returns
}

}  // namespace

void end_cleanly_on_signals(LastWord word) {
  (void)live();
  last_word = word;
  terminal = isatty(STDERR_FILENO) != 0;
  struct sigaction action {};
  action.sa_handler = on_signal;
  action.sa_flags = SA_RESTART;
  for (const int s : kSignals) sigaddset(&action.sa_mask, s);
  struct sigaction halt {};
  halt.sa_handler = on_halt;
  sigaction(kHalt, &halt, nullptr);
  for (const int s : kSignals) {
    struct sigaction before {};
    if (sigaction(s, nullptr, &before) == 0 && before.sa_handler != SIG_IGN) sigaction(s, &action, nullptr);
  }
}

void set_interruption_note(std::string_view text) {
  const Section section;
  note.fill('\0');
  std::ranges::copy(text.substr(0, note.size() - 1), note.begin());
}

Temporary::Temporary(const std::function<std::filesystem::path()>& make) {
  const Section section;
  path_ = make();
  entry_ = live().paths.insert(live().paths.end(), std::filesystem::absolute(path_).string());
  live_ = true;
}

Temporary::~Temporary() {
  if (!live_) return;
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
  const Section section;
  live().paths.erase(entry_);
}

int Temporary::rename_to(const std::filesystem::path& path) {
  const Section section;
  if (std::rename(path_.c_str(), path.c_str()) != 0) return errno;
  live().paths.erase(entry_);
  live_ = false;
  return 0;
}

void Temporary::keep() {
  const Section section;
  live().paths.erase(entry_);
  live_ = false;
}

void uninterrupted(const std::function<void()>& work) {
  const Section section;
  work();
}

Child::Child(const std::function<pid_t(const sigset_t& mask)>& start) {
  const Section section;
  entry_ = live().children.insert(live().children.end(), start(section.before()));
}

Child::~Child() {
  const Section section;
  live().children.erase(entry_);
}

}  // namespace flexor::io
