// Ctrl-C, SIGTERM and SIGHUP as a flag that a long job looks at, so that it can end in order and say what it kept.
#pragma once

#include <array>
#include <atomic>
#include <csignal>
#include <cstdlib>

namespace flexor::cli {

// One at a time. A second signal of the same kind does what it did before, which is to end the process.
class StopOnSignal {
 public:
  StopOnSignal() {
    stop_ = false;
    for (std::size_t i = 0; i < kSignals.size(); ++i) {
      sigaction(kSignals[i], nullptr, &before_[i]);
      if (before_[i].sa_handler == SIG_IGN) continue;  // as nohup wants it
      struct sigaction now {};
      now.sa_handler = [](int signal) {
        last_ = signal;
        stop_ = true;
        sigaction(signal, &before_[signal == SIGINT ? 0 : signal == SIGTERM ? 1 : 2], nullptr);
      };
      now.sa_flags = SA_RESTART;
      sigaction(kSignals[i], &now, nullptr);
    }
  }
  ~StopOnSignal() { restore(); }
  StopOnSignal(const StopOnSignal&) = delete;
  StopOnSignal& operator=(const StopOnSignal&) = delete;

  const std::atomic<bool>* flag() const { return &stop_; }

  // Ends the process as the signal would have, through whatever handled it before.
  [[noreturn]] void end() {
    restore();
    std::raise(last_);
    std::_Exit(128 + last_);
  }

 private:
  static constexpr std::array<int, 3> kSignals = {SIGINT, SIGTERM, SIGHUP};
  static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<int>::is_always_lock_free);

  static void restore() {
    for (std::size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &before_[i], nullptr);
  }

  inline static std::atomic<bool> stop_ = false;
  inline static std::atomic<int> last_ = SIGTERM;
  inline static std::array<struct sigaction, 3> before_{};
};

}  // namespace flexor::cli
