#include "host/io/interrupt.hpp"

#include <mutex>
#include <string>

#include "host/io/io.hpp"
#include "host/io/posix.hpp"

namespace flexor::io {
namespace {

constexpr unsigned kPatience_s = 10;  // a busy machine looks late

std::atomic<int> first_signal = 0;
std::atomic<int> heeding = 0;  // StopOnSignal
std::atomic<bool> may_be_heeded = false;
std::atomic<bool> is_stopped = false;
std::atomic<bool> is_ending = false;
std::mutex note_mutex;
std::string interruption_note;

void end_by_default() {
  const int signal = first_signal != 0 ? first_signal.load() : SIGTERM;
  std::signal(signal, SIG_DFL);
  (void)::kill(::getpid(), signal);
}

void end_soon() {
  is_ending = true;
  ::alarm(kPatience_s);
}

void take(int signal) {
  int none = 0;
  if (!first_signal.compare_exchange_strong(none, signal)) return end_by_default();
  is_stopped = true;
  if (heeding == 0 || !may_be_heeded) end_soon();
}

void lose_patience(int) {
  constexpr std::string_view kLine = "flexor: interrupted\n";
  if (may_be_heeded) (void)!::write(STDERR_FILENO, kLine.data(), kLine.size());
  end_by_default();
}

}  // namespace

void stop_on_signals(bool heeded) {
  may_be_heeded = heeded;
  struct sigaction action {};
  action.sa_flags = SA_RESTART;
  action.sa_handler = lose_patience;
  sigaction(SIGALRM, &action, nullptr);
  action.sa_handler = take;
  for (const int s : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction before {};
    if (sigaction(s, nullptr, &before) == 0 && before.sa_handler != SIG_IGN) sigaction(s, &action, nullptr);
  }
}

bool is_interrupted() { return is_ending; }

void go_on() {
  if (!is_ending) return;
  ::alarm(0);  // what cleans up may take its time
  const std::lock_guard lock(note_mutex);
  throw Cancelled(interruption_note.empty() ? "interrupted" : interruption_note);
}

void interrupt() { end_soon(); }

void end_by_signal() {
  end_by_default();
  for (;;) ::pause();
}

StopOnSignal::StopOnSignal() {
  is_stopped = false;
  ++heeding;
}
StopOnSignal::~StopOnSignal() { --heeding; }
const std::atomic<bool>* StopOnSignal::flag() const { return &is_stopped; }

void stop_job() {
  if (heeding == 0) throw Cancelled("stopped");
  is_stopped = true;
}

void set_interruption_note(std::string_view text) {
  const std::lock_guard lock(note_mutex);
  interruption_note = text;
}

}  // namespace flexor::io
