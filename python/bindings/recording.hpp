// A flexor.Recording of Python's as the host's rooms read it, and back.
//
// Python's holds views of the caller's arrays; a room copies the columns that it reads, because clocks are repaired and rows are
// left out there. Results are moved into arrays, not copied.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <nlohmann/json.hpp>
#include <vector>

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

// What each room's file adds to the module.
void add_recording(nb::module_& m);
void add_model(nb::module_& m);
void add_identify(nb::module_& m);
void add_twin(nb::module_& m);

}  // namespace flexor::python
