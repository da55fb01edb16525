#include "host/report/saved.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <limits>
#include <sstream>
#include <string_view>

#include "host/io/json.hpp"

namespace flexor::report {
namespace {

// The cells of a line; none of what jobs write is quoted.
std::vector<std::string_view> cells(std::string_view line) {
  std::vector<std::string_view> out;
  for (;;) {
    const auto comma = line.find(',');
    out.push_back(line.substr(0, comma));
    if (comma == std::string_view::npos) return out;
    line.remove_prefix(comma + 1);
  }
}

}  // namespace

Saved::Saved(std::filesystem::path folder, bool draws_files)
    : folder_(std::move(folder)), draws_files_(draws_files) {
  const auto path = folder_ / "results.json";
  if (!std::filesystem::is_regular_file(path)) {
    throw io::InputError(
        "{}: no results.json: give a folder that identify --report, experiment --out, track "
        "--report, deploy or latency --out has written",
        folder_.string());
  }
  results_ = io::parse_json(io::read_document(path), path.string());
  if (!results_.is_object() || !results_.contains("kind") || !results_.at("kind").is_string()) {
    throw io::InputError(
        "{}: says of no kind of job that its results are: it was written by another version of "
        "flexor; run the job again",
        path.string());
  }
}

std::string Saved::read(const std::string& file) const {
  const auto path = folder_ / file;
  if (!std::filesystem::is_regular_file(path))
    throw io::InputError("{}: no such file; run the job again", path.string());
  return io::read_file(path);
}

const std::string& plain_name(const std::string& name) {
  const bool good = !name.empty() && std::ranges::all_of(name, [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_';
  });
  if (!good) throw io::InputError("\"{}\" cannot be the name of a file", name);
  return name;
}

Columns Saved::columns(const std::string& file) const {
  std::istringstream lines(read(file));
  std::vector<std::string> names;
  std::vector<std::vector<double>> values;
  std::size_t row = 0;
  for (std::string text; std::getline(lines, text);) {
    const auto line = cells(text);
    if (row++ == 0) {
      names.assign(line.begin(), line.end());
      values.resize(names.size());
      continue;
    }
    bool good = line.size() == names.size();
    for (std::size_t i = 0; good && i < line.size(); ++i) {
      double& value = values[i].emplace_back(std::numeric_limits<double>::quiet_NaN());  // of an empty cell
      const char* const last = line[i].data() + line[i].size();
      const auto [stop, error] = std::from_chars(line[i].data(), last, value);
      good = line[i].empty() || (error == std::errc() && stop == last);
    }
    if (!good)
      throw io::InputError("{}: row {}: not {} numbers", (folder_ / file).string(), row, names.size());
  }
  Columns out;
  for (std::size_t i = 0; i < names.size(); ++i) out[names[i]] = std::move(values[i]);
  return out;
}

double number_or_nan(const Json& json) {
  return json.is_number() ? json.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace flexor::report
