#include "host/io/interrupt.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <mutex>
#include <thread>

namespace flexor::io {
namespace {

// Never destroyed: a signal may come at any time. Whoever holds the mutex is waited for before the process ends; once it
// ends, nobody gets it any more.
struct Kept {
  std::mutex mutex;
  std::list<std::string> paths;
  std::list<pid_t> children;
  std::string note;
};

Kept& kept() {
  static Kept& all = *new Kept;
  return all;
}

std::atomic<bool> ending = false;
std::atomic<int> heeded = 0;  // StopOnSignal
std::atomic<int> first_signal = 0;
std::atomic<bool> stop = false;
LastWord last_word = LastWord::interrupted;

sigset_t usual_mask() {
  sigset_t mask;
  pthread_sigmask(SIG_SETMASK, nullptr, &mask);
  return mask;
}
sigset_t programs_mask = usual_mask();

void pause_ms(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

void end_child(pid_t child) {
  constexpr int kPatience_ms = 2000;
  if (child <= 1) return;
  kill(-child, SIGTERM);  // compilers remove their own temporaries then
  for (int ms = 0; ms < kPatience_ms && waitpid(child, nullptr, WNOHANG) == 0; ++ms) pause_ms(1);
  kill(-child, SIGKILL);
}

void remove(const std::string& path) {
  constexpr int kAttempts = 20;  // something may still write into it
  std::error_code error;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    std::filesystem::remove_all(path, error);
    if (!error) return;
    pause_ms(5);
  }
}

}  // namespace

void wait_if_ending() {
  while (ending) ::pause();
}

void end_by_signal(int signal) {
  ending = true;
  kept().mutex.lock();
  for (const pid_t child : kept().children) end_child(child);
  for (const std::string& path : kept().paths) remove(path);
  if (last_word == LastWord::interrupted) {
    const std::string& note = kept().note;
    (void)std::fprintf(stderr, "%sflexor: %s\n", isatty(STDERR_FILENO) != 0 ? "\r\033[K" : "",
                       note.empty() ? "interrupted" : note.c_str());
    (void)std::fflush(stderr);
  }
  std::signal(signal, SIG_DFL);
  sigset_t only;  // another that waits would be handed on to this very thread, again and again
  sigemptyset(&only);
  sigaddset(&only, signal);
  pthread_sigmask(SIG_UNBLOCK, &only, nullptr);
  (void)std::raise(signal);
  std::_Exit(128 + signal);
}

void take_signal(int signal) {
  if (heeded == 0 || stop) end_by_signal(signal);
  first_signal = signal;
  stop = true;
}

void end_cleanly_on_signals(LastWord word) {
  last_word = word;
  sigset_t ours;
  sigemptyset(&ours);
  constexpr std::array kSignals{SIGINT, SIGTERM, SIGHUP};
  for (const int s : kSignals) {
    struct sigaction before {};
    if (sigaction(s, nullptr, &before) == 0 && before.sa_handler != SIG_IGN) sigaddset(&ours, s);
  }
  pthread_sigmask(SIG_BLOCK, &ours, &programs_mask);  // in all threads that follow
  static pthread_t waiting;
  std::thread waits([ours] {
    for (int signal = 0;;) {
      if (sigwait(&ours, &signal) == 0) take_signal(signal);
    }
  });
  waiting = waits.native_handle();
  waits.detach();
  // A library may have begun a thread before main(): it hands the signal on.
  struct sigaction hand_on {};
  hand_on.sa_handler = [](int signal) { (void)pthread_kill(waiting, signal); };
  hand_on.sa_flags = SA_RESTART;
  for (const int s : kSignals) {
    if (sigismember(&ours, s) == 1) sigaction(s, &hand_on, nullptr);
  }
}

StopOnSignal::StopOnSignal() {
  stop = false;
  ++heeded;
}
StopOnSignal::~StopOnSignal() { --heeded; }
const std::atomic<bool>* StopOnSignal::flag() const { return &stop; }
void StopOnSignal::end() { end_by_signal(first_signal != 0 ? first_signal.load() : SIGTERM); }

void set_interruption_note(std::string_view text) {
  const std::lock_guard lock(kept().mutex);
  kept().note = text;
}

Temporary::Temporary(const std::function<std::filesystem::path()>& make) {
  const std::lock_guard lock(kept().mutex);
  path_ = make();
  entry_ = kept().paths.insert(kept().paths.end(), std::filesystem::absolute(path_).string());
  live_ = true;
}

Temporary::~Temporary() {
  if (!live_) return;
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
  keep();
}

int Temporary::rename_to(const std::filesystem::path& path) {
  const std::lock_guard lock(kept().mutex);
  if (std::rename(path_.c_str(), path.c_str()) != 0) return errno;
  kept().paths.erase(entry_);
  live_ = false;
  return 0;
}

void Temporary::keep() {
  const std::lock_guard lock(kept().mutex);
  kept().paths.erase(entry_);
  live_ = false;
}

void uninterrupted(const std::function<void()>& work) {
  const std::lock_guard lock(kept().mutex);
  work();
}

Child::Child(const std::function<pid_t(const sigset_t& mask)>& start) {
  const std::lock_guard lock(kept().mutex);
  entry_ = kept().children.insert(kept().children.end(), start(programs_mask));
}

Child::~Child() {
  const std::lock_guard lock(kept().mutex);
  kept().children.erase(entry_);
}

}  // namespace flexor::io
