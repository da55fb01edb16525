// A flexor.Recording of Python's as the host's rooms read it, and back.
//
// Python's holds views of the caller's arrays; a room copies the columns that it reads, because clocks are repaired and rows are
// left out there. Results are moved into arrays, not copied.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host/recording/log.hpp"

namespace flexor::python {

namespace nb = nanobind;

using Vector = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Matrix = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

// The array owns the values: `shape` has as many.
nb::object to_array(std::vector<double> values, std::vector<std::size_t> shape = {});

// `recording`: has source, t_s, columns {name: array}, units {name: unit} and digest. Throws io::InputError: columns of other
// lengths than the times.
recording::Recording to_recording(const nb::handle& recording);
recording::Log to_log(const nb::handle& recording);  // None: an empty one

// (source, t_s, {name: array}, {name: unit}, warnings)
nb::tuple to_python(recording::Recording recording);

// Of a JSON document, by Python's own reader.
nb::object to_python(const nlohmann::ordered_json& json);

}  // namespace flexor::python
