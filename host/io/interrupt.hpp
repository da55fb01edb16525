// What must not outlive the process: temporary files and folders, and programs that it runs.
#pragma once

#include <signal.h>
#include <sys/types.h>

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

// From now on SIGINT, SIGTERM and SIGHUP stop what the process runs, remove its temporaries, say "interrupted"
// and end the process by that same signal. A signal that was ignored (nohup) stays ignored.
void end_cleanly_on_signals(LastWord word = LastWord::interrupted);

// Is said in place of "interrupted", cut to 1000 bytes: what remains of the work and how to go on with it.
// Empty: takes that back.
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
