#include "python/bindings/recording.hpp"

#include <fmt/format.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/string_view.h>
#include <nanobind/stl/vector.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "host/io/json.hpp"
#include "host/recording/csv.hpp"
#include "host/recording/pair.hpp"
#include "host/recording/unit.hpp"
#include "python/bindings/rooms.hpp"

namespace flexor::python {

nb::object to_array(std::vector<double> values, std::vector<std::size_t> shape) {
  if (shape.empty()) shape = {values.size()};
  auto held = std::make_unique<std::vector<double>>(std::move(values));
  double* const data = held->data();
  const nb::capsule owner(held.release(),
                          [](void* p) noexcept { delete static_cast<std::vector<double>*>(p); });
  return nb::cast(nb::ndarray<nb::numpy, double>(data, shape.size(), shape.data(), owner));
}

recording::Recording to_recording(const nb::handle& from) {
  recording::Recording out;
  out.source = nb::cast<std::string>(from.attr("source"));
  out.digest = nb::cast<std::string>(from.attr("digest"));
  const auto values = [](const nb::handle& array) {
    const auto all = nb::cast<Vector>(array);
    return std::vector<double>(all.data(), all.data() + all.size());
  };
  out.t_s = values(from.attr("t_s"));
  const nb::dict units = from.attr("units");
  const nb::dict columns = from.attr("columns");
  for (const auto& [name, array] : columns) {
    out.columns.push_back({nb::cast<std::string>(name), values(array), nb::cast<std::string>(units[name])});
    if (out.columns.back().value.size() != out.t_s.size())
      throw io::InputError(fmt::format("{}: column \"{}\" has {} values, the times are {}", out.source,
                                       out.columns.back().name, out.columns.back().value.size(),
                                       out.t_s.size()));
  }
  return out;
}

recording::Log to_log(const nb::handle& from) {
  return from.is_none() ? recording::Log() : recording::Log(to_recording(from));
}

nb::tuple to_python(recording::Recording from) {
  nb::dict columns;
  nb::dict units;
  for (recording::Column& column : from.columns) {
    units[column.name.c_str()] = column.unit.empty() ? recording::unit_of(column.name) : column.unit;
    columns[column.name.c_str()] = to_array(std::move(column.value));
  }
  return nb::make_tuple(from.source, to_array(std::move(from.t_s)), columns, units, from.warnings,
                        from.digest);
}

nb::object to_python(const nlohmann::ordered_json& json) {
  return nb::module_::import_("json").attr("loads")(io::dump(json));
}

namespace {

nb::tuple read(const std::string& path, const std::vector<std::string>& columns, const std::string& time_unit,
               const std::optional<std::string>& time_column, double log_rate_hz) {
  recording::TimeOptions time(time_unit.c_str());
  if (time_column) time.columns = {*time_column};
  time.log_rate_hz = log_rate_hz;
  recording::CsvReader reader(path, {columns, time, recording::Holes::all});
  return to_python(recording::read(reader));
}

}  // namespace

void add_recording(nb::module_& m) {
  m.def("read", &read, nb::arg("path"), nb::arg("columns"), nb::arg("time_unit"),
        nb::arg("time_column").none(), nb::arg("log_rate_hz"),
        "A log as flexor.Recording's parts; a missing reading is NaN.");
  m.def("unit_of", &recording::unit_of, nb::arg("column"),
        "The unit that a column's name states; empty: none.");
  m.def("known_unit", &recording::known_unit, nb::arg("text"),
        "One spelling of a unit; None where it is unknown.");
  m.def(
      "seconds_in",
      [](const std::string& name) { return recording::seconds_in(recording::cut_name(name).unit); },
      nb::arg("column"), "Seconds in the unit that a time's name states; None: it states none.");
}

}  // namespace flexor::python
