// Signals end what runs in order: SIGINT, SIGTERM and SIGHUP set a flag, and whoever looks at it throws, so that everything cleans
// up behind itself as after any other failure. The second signal ends the process at once.
#pragma once

#include <atomic>
#include <string_view>

namespace flexor::io {

// From now on. A signal that was ignored (nohup) stays ignored. `may_be_heeded`: by a StopOnSignal. What does not heed it and has
// not looked within ten seconds is ended.
void stop_on_signals(bool may_be_heeded);

// Whether a signal came that nobody heeds.
bool is_interrupted();
// Looks: throws Cancelled where is_interrupted().
void go_on();
// As if SIGTERM had come, and nobody heeded it.
void interrupt();
// As the first signal ends a process by default.
[[noreturn]] void end_by_signal();

// While it lives, the first signal only sets a flag that a long job looks at, so that it can end in order and report what it kept.
class StopOnSignal {
 public:
  StopOnSignal();
  ~StopOnSignal();
  StopOnSignal(const StopOnSignal&) = delete;
  StopOnSignal& operator=(const StopOnSignal&) = delete;

  const std::atomic<bool>* flag() const;
};
// Sets the flag; throws Cancelled where nobody looks at it.
void stop_job();

// Is printed in place of "interrupted": what remains of the work and how to go on with it. Empty: takes that back.
void set_interruption_note(std::string_view note);

}  // namespace flexor::io
