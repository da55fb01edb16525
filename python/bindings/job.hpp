// A long job of the host's rooms, called from Python: the interpreter runs on meanwhile, the caller's progress function is called in
// the caller's own thread, and what it raises, or Ctrl-C, stops the job.
#pragma once

#include <nanobind/nanobind.h>

#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "host/io/io.hpp"

namespace flexor::python {

namespace nb = nanobind;

struct Progress {
  // From any thread of the job. Throws io::Cancelled where it shall stop.
  void step(std::size_t done, std::size_t of, const std::string& what) {
    const std::lock_guard lock(mutex);
    if (stop) throw io::Cancelled("stopped");
    newest = {done, of, what};
    is_new = true;
  }

  struct Step {
    std::size_t done = 0;
    std::size_t of = 0;
    std::string what;
  };

  std::mutex mutex;  // of all below
  std::condition_variable ended;
  Step newest;
  bool is_new = false;
  bool stop = false;
  bool has_ended = false;
};

// work(Progress&) -> result, without the interpreter's lock. `show`: None, or called with (done, of, what).
template <class Work>
auto run(const nb::object& show, Work work) {
  constexpr std::chrono::milliseconds kLook(50);  // between two looks for Ctrl-C
  Progress progress;
  std::optional<decltype(work(progress))> result;
  std::exception_ptr failure;
  std::thread thread([&] {
    try {
      result.emplace(work(progress));
    } catch (...) {
      failure = std::current_exception();
    }
    const std::lock_guard lock(progress.mutex);
    progress.has_ended = true;
    progress.ended.notify_all();
  });
  std::optional<nb::python_error> raised;
  for (bool is_done = false; !is_done;) {
    std::optional<Progress::Step> news;
    {
      const nb::gil_scoped_release released;
      std::unique_lock lock(progress.mutex);
      progress.ended.wait_for(lock, kLook, [&] { return progress.has_ended; });
      is_done = progress.has_ended;
      if (std::exchange(progress.is_new, false)) news = progress.newest;
    }
    if (raised) continue;  // it was told to stop
    try {
      if (PyErr_CheckSignals() != 0) throw nb::python_error();
      if (news && !show.is_none()) show(news->done, news->of, news->what);
    } catch (nb::python_error& error) {
      raised.emplace(std::move(error));
      const std::lock_guard lock(progress.mutex);
      progress.stop = true;
    }
  }
  thread.join();
  if (raised) throw std::move(*raised);
  if (failure) std::rethrow_exception(failure);
  return std::move(*result);
}

}  // namespace flexor::python
