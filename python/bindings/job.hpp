// A long job of the host's rooms, called from Python: the interpreter runs on meanwhile, the caller's progress function is called in
// the caller's own thread, and what it raises, or Ctrl-C, stops the job.
#pragma once

#include <nanobind/nanobind.h>

#include <chrono>
#include <future>
#include <mutex>
#include <optional>
#include <string>
#include <tuple>

#include "host/io/io.hpp"

namespace flexor::python {

namespace nb = nanobind;

struct Progress {
  // From any thread of the job. Throws io::Cancelled where it shall stop.
  void step(std::size_t done, std::size_t of, const std::string& what) {
    const std::lock_guard lock(mutex);
    if (stop) throw io::Cancelled("stopped");
    news.emplace(done, of, what);
  }

  std::mutex mutex;  // of both below
  std::optional<std::tuple<std::size_t, std::size_t, std::string>> news;
  bool stop = false;
};

// work(Progress&) -> result, without the interpreter's lock. `show`: None, or called with (done, of, what).
template <class Work>
auto run(const nb::object& show, Work work) {
  constexpr std::chrono::milliseconds kLook(50);  // between two looks for Ctrl-C
  Progress progress;
  auto result = std::async(std::launch::async, [&] { return work(progress); });
  std::optional<nb::python_error> raised;
  for (bool is_done = false; !is_done;) {
    decltype(Progress::news) news;
    {
      const nb::gil_scoped_release released;
      is_done = result.wait_for(kLook) == std::future_status::ready;
      const std::lock_guard lock(progress.mutex);
      progress.news.swap(news);
    }
    if (raised) continue;  // it was told to stop
    try {
      if (PyErr_CheckSignals() != 0) throw nb::python_error();
      if (news && !show.is_none()) std::apply(show, *news);
    } catch (nb::python_error& error) {
      raised.emplace(std::move(error));
      const std::lock_guard lock(progress.mutex);
      progress.stop = true;
    }
  }
  if (raised) throw std::move(*raised);
  return result.get();
}

}  // namespace flexor::python
