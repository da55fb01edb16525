// What all bindings use: a flexor.Recording of Python's as the host's rooms read it, and back, and long jobs of the rooms.
// A room copies the columns that it reads, because clocks are repaired and rows are left out there. Results are moved into arrays.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/string_view.h>
#include <nanobind/stl/vector.h>

#include <chrono>
#include <future>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <tuple>
#include <utility>

#include "host/io/io.hpp"
#include "host/recording/csv.hpp"

namespace flexor::python {

namespace nb = nanobind;

using Vector = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Matrix = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

// The array owns the values: `shape` has as many.
nb::object to_array(std::vector<double> values, std::vector<std::size_t> shape = {});

// (source, t_s, {name: array}, {name: unit}, warnings)
nb::tuple to_python(recording::Recording recording);

// Of a JSON document, by Python's own reader.
nb::object to_python(const Json& json);

// A request of a room, whose members Python sets: FLEXOR_REQUEST(Request, a, b).
#define FLEXOR_MEMBER(name) .def_rw(#name, &Members::name, nb::arg().none())
#define FLEXOR_REQUEST(T, ...)                                                 \
  {                                                                            \
    using Members = T;                                                         \
    nb::class_<T>(m, #T).def(nb::init<>())                                     \
        NLOHMANN_JSON_EXPAND(NLOHMANN_JSON_PASTE(FLEXOR_MEMBER, __VA_ARGS__)); \
  }

struct Progress {
  // From any thread of the job. Throws io::Cancelled where it shall stop.
  void step(std::size_t done, std::size_t of, const std::string& what) {
    const std::lock_guard lock(mutex);
    if (stop) throw io::Cancelled("stopped");
    news.emplace(done, of, what);
  }
  // What a job calls with (done, of).
  auto counts(const char* what) {
    return [this, what](std::size_t done, std::size_t of) { step(done, of, what); };
  }

  std::mutex mutex;  // of both below
  std::optional<std::tuple<std::size_t, std::size_t, std::string>> news;
  bool stop = false;
};

// work(Progress&) -> result, without the interpreter's lock. `show`: None, or called with (done, of, what) in the caller's own thread.
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
    if (raised) continue;  // it must stop
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

// What each room's file adds to the module.
void add_recording(nb::module_& m);
void add_model(nb::module_& m);
void add_identify(nb::module_& m);
void add_twin(nb::module_& m);

}  // namespace flexor::python
