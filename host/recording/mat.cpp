#include "host/recording/mat.hpp"

#include <fmt/format.h>
#include <matio.h>

#include <algorithm>
#include <memory>

#include "host/io/output.hpp"
#include "host/io/process.hpp"

namespace flexor::recording {
namespace {

constexpr std::size_t kMatlabNameLength = 63;

bool is_ascii_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

bool write_vector(mat_t* file, const std::string& name, const std::vector<double>& values) {
  std::size_t dims[2] = {values.size(), 1};
  // matio takes a non-const pointer but only copies from it.
  auto* data = const_cast<double*>(values.data());
  const std::unique_ptr<matvar_t, decltype(&Mat_VarFree)> variable(
      Mat_VarCreate(name.c_str(), MAT_C_DOUBLE, MAT_T_DOUBLE, 2, dims, data, MAT_F_DONT_COPY_DATA),
      &Mat_VarFree);
  return variable && Mat_VarWrite(file, variable.get(), MAT_COMPRESSION_NONE) == 0;
}

bool holds_vector(mat_t* file, const std::string& name, const std::vector<double>& values) {
  const std::unique_ptr<matvar_t, decltype(&Mat_VarFree)> variable(Mat_VarRead(file, name.c_str()),
                                                                   &Mat_VarFree);
  return variable && variable->class_type == MAT_C_DOUBLE && variable->data != nullptr &&
         variable->nbytes == values.size() * sizeof(double) &&
         std::memcmp(variable->data, values.data(), variable->nbytes) == 0;
}

// Columns that MATLAB would call the same get numbers: a second variable of one name hides the first.
std::vector<std::string> names_of(const Recording& recording) {
  std::vector<std::string> names = {"t_s"};
  for (const Column& c : recording.columns) {
    const std::string name = mat_name(c.name);
    std::string free = name;
    for (int i = 2; std::ranges::find(names, free) != names.end(); ++i) {
      const std::string number = fmt::format("_{}", i);
      free = name.substr(0, kMatlabNameLength - number.size()) + number;
    }
    names.push_back(free);
  }
  return names;
}

// `act` for time and every column.
template <class Act>
bool each(const Recording& recording, const Act& act) {
  const std::vector<std::string> names = names_of(recording);
  bool good = act(names[0], recording.t_s);
  for (std::size_t i = 0; good && i < recording.columns.size(); ++i) {
    good = act(names[i + 1], recording.columns[i].value);
  }
  return good;
}

bool write(const Recording& recording, const std::filesystem::path& path, mat_ft version) {
  mat_t* file = Mat_CreateVer(path.c_str(), nullptr, version);
  if (file == nullptr) return false;
  const bool good =
      each(recording, [&](const auto& name, const auto& v) { return write_vector(file, name, v); });
  return Mat_Close(file) == 0 && good;
}

bool holds(const Recording& recording, const std::filesystem::path& path) {
  mat_t* file = Mat_Open(path.c_str(), MAT_ACC_RDONLY);
  if (file == nullptr) return false;
  const bool good =
      each(recording, [&](const auto& name, const auto& v) { return holds_vector(file, name, v); });
  return Mat_Close(file) == 0 && good;
}

}  // namespace

std::string mat_name(std::string_view column) {
  std::string name;
  if (column.empty() || !is_ascii_letter(column.front())) name.push_back('x');
  for (const char c : column) {
    if (is_ascii_letter(c) || (c >= '0' && c <= '9')) {
      name.push_back(c);
    } else if (name.back() != '_') {
      name.push_back('_');
    }
  }
  return name.substr(0, kMatlabNameLength);
}

void write_mat(const Recording& recording, const std::filesystem::path& path, MatVersion version) {
  io::StagedOutput output(path);
  // On a full disk matio reports success, and HDF5 writes a hundred lines, on leaving, too.
  const bool good = io::in_a_silent_process([&] {
    return write(recording, output.name(), version == MatVersion::v5 ? MAT_FT_MAT5 : MAT_FT_MAT73) &&
           holds(recording, output.name());
  });
  if (!good) {
    output.require_room();
    throw io::JobError(fmt::format("{}: cannot be written as a MAT file", path.string()));
  }
  output.commit();
}

}  // namespace flexor::recording
