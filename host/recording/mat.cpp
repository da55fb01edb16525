#include "host/recording/mat.hpp"

#include <fmt/format.h>
#include <matio.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <memory>

#include "host/io/output.hpp"

namespace flexor::recording {
namespace {

constexpr std::size_t kMatlabNameLength = 63;

bool is_ascii_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

// A file in memory. matio reports a full disk as success, and HDF5 tells it in a hundred lines; so they do
// not see the disk.
class Memory {
 public:
  explicit Memory(const std::filesystem::path& path) : descriptor_(memfd_create("flexor", MFD_CLOEXEC)) {
    if (descriptor_ < 0) throw io::JobError(fmt::format("{}: {}", path.string(), std::strerror(errno)));
  }
  ~Memory() { close(descriptor_); }
  Memory(const Memory&) = delete;
  Memory& operator=(const Memory&) = delete;

  std::string name() const { return fmt::format("/proc/self/fd/{}", descriptor_); }

  void copy_to(const std::filesystem::path& path) const {
    io::Output output(path);
    std::array<char, 1 << 16> piece;
    off_t at = 0;
    for (ssize_t n = 0; (n = pread(descriptor_, piece.data(), piece.size(), at)) > 0; at += n) {
      output.write({piece.data(), static_cast<std::size_t>(n)});
    }
    output.commit();
  }

 private:
  int descriptor_;
};

bool write_vector(mat_t* file, const std::string& name, const std::vector<double>& values) {
  std::size_t dims[2] = {values.size(), 1};
  // matio takes a non-const pointer but only copies from it.
  auto* data = const_cast<double*>(values.data());
  const std::unique_ptr<matvar_t, decltype(&Mat_VarFree)> variable(
      Mat_VarCreate(name.c_str(), MAT_C_DOUBLE, MAT_T_DOUBLE, 2, dims, data, MAT_F_DONT_COPY_DATA),
      &Mat_VarFree);
  return variable && Mat_VarWrite(file, variable.get(), MAT_COMPRESSION_NONE) == 0;
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
  io::require_writable(path);
  const Memory memory(path);
  const auto format = version == MatVersion::v5 ? MAT_FT_MAT5 : MAT_FT_MAT73;
  mat_t* file = Mat_CreateVer(memory.name().c_str(), nullptr, format);
  bool good = file != nullptr && write_vector(file, "t_s", recording.t_s);
  for (const Column& c : recording.columns) good = good && write_vector(file, mat_name(c.name), c.value);
  if (file != nullptr) good = Mat_Close(file) == 0 && good;
  if (!good) throw io::JobError(fmt::format("{}: cannot be written as a MAT file", path.string()));
  memory.copy_to(path);
}

}  // namespace flexor::recording
