// What must not outlive the process: temporary files and folders, and programs that it runs.
#pragma once

#include <signal.h>
#include <sys/types.h>

#include <atomic>
#include <filesystem>
#include <functional>
#include <list>
#include <string>
#include <string_view>

namespace flexor::io {

enum class LastWord {
  interrupted,  // one line on standard error
  none,         // whoever started this process says it
};

// From now on a thread waits for SIGINT, SIGTERM and SIGHUP, which are blocked in all others. A signal stops what the process
// runs, removes its temporaries, says "interrupted" and ends the process by that same signal. One that was ignored (nohup)
// stays ignored. To be called before other threads are started.
void end_cleanly_on_signals(LastWord word = LastWord::interrupted);

// As if it had come.
void take_signal(int signal);

// Ends so now, whoever heeds signals.
[[noreturn]] void end_by_signal(int signal);

// Once the process ends so, whoever calls this waits for that end: what it was about to report as a fault may be none.
void wait_if_ending();

// While it lives, the first signal only sets a flag that a long job looks at, so that it can end in order and say what it
// kept. The second ends the process at once.
class StopOnSignal {
 public:
  StopOnSignal();
  ~StopOnSignal();
  StopOnSignal(const StopOnSignal&) = delete;
  StopOnSignal& operator=(const StopOnSignal&) = delete;

  const std::atomic<bool>* flag() const;
  [[noreturn]] void end();  // as the signal would have ended it
};

// Is said in place of "interrupted": what remains of the work and how to go on with it. Empty: takes that back.
void set_interruption_note(std::string_view note);

// A file or a folder that is removed, with all that is in it, when its owner goes or when the process is
// interrupted.
class Temporary {
 public:
  // `make` creates it and says its name. No signal can come between the two.
  explicit Temporary(const std::function<std::filesystem::path()>& make);
  ~Temporary();
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;

  const std::filesystem::path& path() const { return path_; }
  // Gives it its name for good in one step: 0, and there is nothing to remove any more, or errno.
  int rename_to(const std::filesystem::path& path);
  // It stays where it is.
  void keep();

 private:
  std::filesystem::path path_;
  std::list<std::string>::iterator entry_;
  bool live_ = false;
};

// Does `work`, which makes no Temporary and no Child and is short, before any signal is heeded.
void uninterrupted(const std::function<void()>& work);

// A program that this process runs, in a process group of its own. An interruption ends that group.
class Child {
 public:
  // `start` returns its process id; the program gets the given signal mask.
  explicit Child(const std::function<pid_t(const sigset_t& mask)>& start);
  ~Child();
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  pid_t pid() const { return *entry_; }

 private:
  std::list<pid_t>::iterator entry_;
};

}  // namespace flexor::io
