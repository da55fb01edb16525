// What a job saved for its report: results.json, and tables of numbers as CSV beside it.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host/io/io.hpp"

namespace flexor::report {

// Columns by name, all of the same length. Cells that are empty are NaN.
using Columns = std::map<std::string, std::vector<double>>;

class Saved {
 public:
  // Throws io::InputError: no results.json, or none that a report can be made of.
  explicit Saved(std::filesystem::path folder, bool draws_files = false);

  const std::filesystem::path& folder() const { return folder_; }
  const Json& results() const { return results_; }
  std::string text(const char* key) const { return results_.at(key).get<std::string>(); }

  // Figures are wanted as files of their own, too.
  bool draws_files() const { return draws_files_; }

  // A file of the folder. Throws io::InputError.
  std::string read(const std::string& file) const;

  // Of a CSV with a header. Throws io::InputError naming file and row.
  Columns columns(const std::string& file) const;

 private:
  std::filesystem::path folder_;
  Json results_;
  bool draws_files_;
};

// For names of files that come from results, which may be anybody's: throws io::InputError but for letters, digits and _.
const std::string& plain_name(const std::string& name);

// A number that may be null.
double number_or_nan(const Json& json);

}  // namespace flexor::report
