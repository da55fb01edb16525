#include "python/bindings/bindings.hpp"

#include <memory>

#include "host/identify/compare.hpp"
#include "host/io/folder_lock.hpp"
#include "host/io/json.hpp"
#include "host/io/output.hpp"
#include "host/recording/unit.hpp"
#include "host/score/judge.hpp"

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

// `from`: has source, t_s, columns {name: array}, units {name: unit} and the file's digest, if it was one; a digest of
// the values else. Throws io::InputError: columns of other lengths than the times.
recording::Log to_log(const nb::handle& from) {
  recording::Recording out;
  out.source = nb::cast<std::string>(from.attr("source"));
  out.digest = nb::cast<std::string>(from.attr("_digest"));
  std::string bytes;
  const auto values = [&](const nb::handle& array) {
    const auto all = nb::cast<Vector>(array);
    bytes.append(reinterpret_cast<const char*>(all.data()), all.size() * sizeof(double));
    return std::vector<double>(all.data(), all.data() + all.size());
  };
  out.t_s = values(from.attr("t_s"));
  const nb::dict units = from.attr("units");
  const nb::dict columns = from.attr("columns");
  for (const auto& [name, array] : columns) {
    out.columns.push_back({nb::cast<std::string>(name), values(array), nb::cast<std::string>(units[name])});
    bytes += out.columns.back().name;
    if (out.columns.back().value.size() != out.t_s.size())
      throw io::InputError("{}: column \"{}\" has {} values, the times are {}", out.source,
                           out.columns.back().name, out.columns.back().value.size(), out.t_s.size());
  }
  if (out.digest.empty()) out.digest = io::digest(bytes);
  return recording::Log(std::move(out));
}

// `columns`: names, or a function of those there are. `repair`: its clock; else rows are as they stand.
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
  return to_python(repair ? recording::read(reader) : recording::read_rows(reader));
}

// (figures, warnings)
nb::tuple score_columns(const recording::Log& measured, const std::string& measured_column,
                        const recording::Log& estimated, const std::string& estimated_column) {
  const identify::Compared found = identify::compare(measured, measured_column, estimated, estimated_column);
  return nb::make_tuple(to_python(Json(found.score)), found.warnings);
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
      .def(nb::init<std::filesystem::path>())
      .def("__init__", [](recording::Log* self, const nb::handle& recording) {
        new (self) recording::Log(to_log(recording));
      });
  m.def("read", &read);
  m.def("write_file", [](const std::filesystem::path& path, const nb::bytes& bytes) {
    io::write_file(path, {bytes.c_str(), bytes.size()});
  });
  m.def("require_writable", &io::require_writable);
  nb::class_<io::FolderLock>(m, "FolderLock").def(nb::init<std::filesystem::path>());
  m.def("without_unit", [](const std::string& column) { return recording::without_unit(column); });
  m.def("unit_of", &recording::unit_of);
  m.def("known_unit", &recording::known_unit);
  m.def("seconds_in",
        [](const std::string& name) { return recording::seconds_in(recording::cut_name(name).unit); });
  m.def("score", &score_columns);
  m.def("judge", &judge);
}

}  // namespace flexor::python
