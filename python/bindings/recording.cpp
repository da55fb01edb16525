#include "python/bindings/bindings.hpp"

#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/string_view.h>
#include <nanobind/stl/vector.h>

#include <memory>

#include "host/io/json.hpp"
#include "host/recording/pair.hpp"
#include "host/recording/resample.hpp"
#include "host/recording/unit.hpp"
#include "host/score/judge.hpp"
#include "host/score/score.hpp"

namespace flexor::python {

nb::object to_array(std::vector<double> values, std::vector<std::size_t> shape) {
  if (shape.empty()) shape = {values.size()};
  auto held = std::make_unique<std::vector<double>>(std::move(values));
  double* const data = held->data();
  const nb::capsule owner(held.release(),
                          [](void* p) noexcept { delete static_cast<std::vector<double>*>(p); });
  return nb::cast(nb::ndarray<nb::numpy, double>(data, shape.size(), shape.data(), owner));
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

nb::object to_python(const Json& json) { return nb::module_::import_("json").attr("loads")(io::dump(json)); }

namespace {

// `from`: has source, t_s, columns {name: array}, units {name: unit} and digest. Throws io::InputError: columns of other lengths
// than the times.
recording::Log to_log(const nb::handle& from) {
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
      throw io::InputError("{}: column \"{}\" has {} values, the times are {}", out.source,
                           out.columns.back().name, out.columns.back().value.size(), out.t_s.size());
  }
  return recording::Log(std::move(out));
}

// `columns`: names, or a function of those there are. `repair`: its clock; else rows are as they stand, also where it goes back or
// starts again.
nb::tuple read(const std::filesystem::path& path, const nb::object& columns, const std::string& time_unit,
               const std::vector<std::string>& time_columns, double log_rate_hz, bool repair) {
  recording::TimeOptions time(time_unit.c_str());
  time.columns = time_columns;
  time.log_rate_hz = log_rate_hz;
  const bool chooses = PyCallable_Check(columns.ptr()) != 0;
  using Names = std::vector<std::string>;
  recording::CsvReader reader(path,
                              {chooses ? Names() : nb::cast<Names>(columns), time, recording::Holes::all});
  if (chooses) reader.choose(nb::cast<Names>(columns(reader.columns())));
  if (repair) return to_python(recording::read(reader));
  recording::Recording out;
  for (std::size_t i = 0; i < reader.columns().size(); ++i)
    out.columns.push_back({reader.columns()[i], {}, reader.units()[i]});
  for (recording::Row row; reader.next(row);) {
    out.t_s.push_back(row.t_s);
    for (std::size_t i = 0; i < row.value.size(); ++i) out.columns[i].value.push_back(row.value[i]);
  }
  if (out.t_s.empty()) throw io::InputError(reader.name() + ": no row of data");
  out.source = reader.name();
  out.warnings = reader.notes();
  out.digest = reader.digest();
  return to_python(std::move(out));
}

nb::object score_columns(const recording::Log& measured, const std::string& measured_column,
                         const recording::Log& estimated, const std::string& estimated_column) {
  const auto angles = [](const recording::Log& log, const std::string& column) {
    recording::Recording out = recording::read_angle(log, column, {});
    recording::to_degrees(out, column, "");
    return out;
  };
  const recording::Recording reference = angles(measured, measured_column);
  const recording::Recording estimate = angles(estimated, estimated_column);
  const auto series = [](const recording::Recording& r, const std::string& column) {
    const recording::Series s = r.series(column);
    return score::Angles{s.t_s, s.value, recording::default_max_gap_s(s.t_s)};
  };
  return to_python(
      Json(score::compare(series(reference, measured_column), series(estimate, estimated_column))));
}

nb::object judge(const std::vector<double>& error_deg,
                 const std::map<std::string, std::vector<double>>& baselines, double period_s,
                 const std::vector<std::size_t>& part_ends) {
  return to_python(score::to_json(score::judge(error_deg, baselines, period_s, part_ends)));
}

}  // namespace

void add_recording(nb::module_& m) {
  nb::class_<recording::Log>(m, "Log", "A flexor.Recording as the rooms read it; without one, none.")
      .def(nb::init<>())
      .def("__init__", [](recording::Log* self, const nb::handle& recording) {
        new (self) recording::Log(to_log(recording));
      });
  m.def("read", &read, "A log as flexor.Recording's parts; a missing reading is NaN.");
  m.def("write_file", [](const std::filesystem::path& path, const nb::bytes& bytes) {
    io::write_file(path, {bytes.c_str(), bytes.size()});
  });
  m.def("unit_of", &recording::unit_of, nb::arg("column"),
        "The unit that a column's name states; empty: none.");
  m.def("known_unit", &recording::known_unit, nb::arg("text"),
        "One spelling of a unit; None where it is unknown.");
  m.def(
      "seconds_in",
      [](const std::string& name) { return recording::seconds_in(recording::cut_name(name).unit); },
      nb::arg("column"), "Seconds in the unit that a time's name states; None: it states none.");
  m.def("score", &score_columns);
  m.def("judge", &judge);
}

}  // namespace flexor::python
