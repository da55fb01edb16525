#include "host/io/output.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <optional>
#include <set>
#include <vector>

#include "host/io/descriptor.hpp"
#include "host/io/interrupt.hpp"

namespace flexor::io {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kBuffer = 1 << 16;

[[noreturn]] void cannot_write(const fs::path& path, int error) {
  const std::string line = fmt::format("{}: cannot be written: {}", path.string(), std::strerror(error));
  constexpr std::array kNotThePath{ENOSPC, EDQUOT, EFBIG, EIO, EPIPE, ENOMEM, EMFILE, ENFILE};
  if (std::ranges::find(kNotThePath, error) != kNotThePath.end()) throw JobError(line);
  throw InputError(line);
}

[[noreturn]] void refuse(const fs::path& path, std::string_view reason) {
  throw InputError("{}: cannot be written: {}", path.string(), reason);
}

std::vector<fs::path>& inputs() {
  static std::vector<fs::path> all;
  return all;
}

bool is_input(const fs::path& file) {
  std::error_code error;
  return std::ranges::any_of(inputs(),
                             [&](const fs::path& path) { return fs::equivalent(path, file, error); });
}

// What a path leads to.
struct Target {
  fs::path named;                       // as the user wrote it, for errors
  fs::path file;                        // behind all links
  bool through = false;                 // no file: written into
  std::optional<int> own_descriptor;    // /dev/stdout and the like
  std::optional<struct stat> existing;  // a file

  fs::path folder() const { return file.has_parent_path() ? file.parent_path() : "."; }
};

// The number when `path` is one of this process's own open files, /proc/self/fd/1.
std::optional<int> own_descriptor(const fs::path& path) {
  std::error_code error;
  const fs::path folder = fs::canonical(path.parent_path(), error);
  if (error || folder != fs::path("/proc") / std::to_string(getpid()) / "fd") return {};
  const std::string name = path.filename().string();
  if (name.empty() || name.size() > 7 ||
      !std::ranges::all_of(name, [](char c) { return c >= '0' && c <= '9'; })) {
    return {};
  }
  return std::stoi(name);
}

// Follows links one by one, since /dev/stdout leads to a file that must not be replaced behind the shell's
// back.
void follow_links(Target& target) {
  constexpr int kMostLinks = 40;
  for (int i = 0; i < kMostLinks; ++i) {
    target.own_descriptor = own_descriptor(target.file);
    if (target.own_descriptor) return;
    std::error_code error;
    const fs::path next = fs::read_symlink(target.file, error);
    if (error) return;
    target.file = target.file.parent_path() / next;
  }
  cannot_write(target.named, ELOOP);
}

void require_folder_of(const Target& target) {
  const fs::path folder = target.folder();
  std::error_code error;
  if (!target.file.has_filename() || !fs::is_directory(folder, error)) {
    refuse(target.named, fmt::format("there is no folder {}", folder.string()));
  }
  if (access(folder.c_str(), W_OK | X_OK) != 0) cannot_write(target.named, errno);
}

Target target_of(const fs::path& path) {
  Target target{.named = path, .file = path, .own_descriptor = {}, .existing = {}};
  follow_links(target);
  if (target.own_descriptor) {
    const int flags = fcntl(*target.own_descriptor, F_GETFL);
    if (flags < 0 || (flags & O_ACCMODE) == O_RDONLY) cannot_write(path, EBADF);
    target.through = true;
    return target;
  }
  struct stat status {};
  if (stat(target.file.c_str(), &status) != 0) {
    if (errno != ENOENT && errno != ENOTDIR) cannot_write(path, errno);
    require_folder_of(target);
    return target;
  }
  if (S_ISDIR(status.st_mode)) refuse(path, "is a directory");
  if (S_ISBLK(status.st_mode)) refuse(path, "is a disk");
  if (S_ISSOCK(status.st_mode)) refuse(path, "is a socket");
  if (access(target.file.c_str(), W_OK) != 0) cannot_write(path, errno);
  target.through = !S_ISREG(status.st_mode);
  if (target.through) return target;
  if (is_input(target.file)) refuse(path, "it is an input of this command; choose another name");
  require_folder_of(target);
  target.existing = status;
  return target;
}

// The process in the name of a file that make_beside() made for `stem`.
std::optional<pid_t> writer_of(std::string_view name, const std::string& stem) {
  const std::string prefix = stem + ".part-";
  if (!name.starts_with(prefix)) return {};
  name.remove_prefix(prefix.size());
  pid_t process = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), process);
  const bool ends = end == name.data() + name.size() || *end == '-' || *end == '.';
  return error == std::errc() && ends && process > 0 ? std::optional(process) : std::nullopt;
}

// What processes that were killed have left of it.
void remove_stale(const Target& target, const std::string& stem) {
  std::error_code error;
  std::error_code ignored;
  for (fs::directory_iterator at(target.folder(), error), end; !error && at != end; at.increment(error)) {
    const auto process = writer_of(at->path().filename().string(), stem);
    if (!process || !fs::is_regular_file(fs::symlink_status(at->path(), ignored))) continue;
    if (::kill(*process, 0) != 0 && errno == ESRCH) fs::remove(at->path(), ignored);
  }
}

// A new file beside the target, which ends as the user wrote it: libraries go by that.
fs::path make_beside(const Target& target, Access who, Descriptor& descriptor) {
  constexpr std::size_t kLongest = 200;  // file systems end at 255
  constexpr std::size_t kLongestExtension = 16;
  constexpr int kAttempts =
      1000;  // several outputs of one process, or one that was killed and had its number
  const std::string stem = target.file.filename().string().substr(0, kLongest);
  std::string extension = target.named.extension().string();
  if (extension.size() > kLongestExtension) extension.clear();
  remove_stale(target, stem);
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const std::string more = attempt > 0 ? fmt::format("-{}", attempt) : "";
    fs::path name =
        target.file.parent_path() / fmt::format("{}.part-{}{}{}", stem, getpid(), more, extension);
    const mode_t mode = who == Access::owner ? 0600 : 0666;
    descriptor = Descriptor(::open(name.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_NOFOLLOW | O_CLOEXEC, mode));
    if (descriptor) return name;
    if (errno != EEXIST) break;
  }
  cannot_write(target.named, errno);
}

void take_over_permissions(const Target& target, Access who, int descriptor) {
  if (!target.existing) return;
  // Only root can, and root should: `sudo` must not take a user's file away.
  if (fchown(descriptor, target.existing->st_uid, target.existing->st_gid) != 0) errno = 0;
  if (who == Access::usual && fchmod(descriptor, target.existing->st_mode & 0777) != 0) {
    cannot_write(target.named, errno);
  }
}

void write_into(const Target& target, int descriptor, std::string_view bytes) {
  if (const int error = write_all(descriptor, bytes); error != 0) cannot_write(target.named, error);
}

// Devices and pipes have no disk to be brought to.
void bring_to_disk(const Target& target, int descriptor) {
  if (fsync(descriptor) != 0 && errno != EINVAL && errno != ENOTSUP && errno != EROFS) {
    cannot_write(target.named, errno);
  }
}

void replace(const Target& target, Temporary& temporary) {
  if (const int error = temporary.rename_to(target.file); error != 0) cannot_write(target.named, error);
  // The new name outlives a power cut; a file system that cannot confirm it is no reason to fail.
  const Descriptor open(::open(target.folder().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (open) (void)fsync(open.number());
}

Descriptor open_through(const Target& target) {
  Descriptor out(target.own_descriptor ? fcntl(*target.own_descriptor, F_DUPFD_CLOEXEC, 3)
                                       : ::open(target.file.c_str(), O_WRONLY | O_NOCTTY | O_CLOEXEC));
  if (!out) cannot_write(target.named, errno);
  return out;
}

}  // namespace

void note_input(const fs::path& path) {
  std::error_code error;
  if (fs::is_regular_file(path, error)) inputs().push_back(path);
}

void require_writable(const fs::path& path) { (void)target_of(path); }

void require_file(const fs::path& path) {
  if (target_of(path).through) refuse(path, "is no file");
}

void require_outputs(std::initializer_list<fs::path> files, const fs::path& report) {
  std::set<fs::path> taken;
  for (const fs::path& path : files) {
    if (path.empty()) continue;
    const Target target = target_of(path);
    if (target.through) continue;
    const fs::path file = fs::weakly_canonical(fs::absolute(target.file));
    if (!taken.insert(file).second) refuse(path, "another output of this command has this name");
    if (!report.empty() &&
        file.string().starts_with((fs::weakly_canonical(fs::absolute(report)) / "").string()))
      refuse(path, "it lies in the folder of the report, whose own files may take its place");
  }
}

struct Output::Open {
  Target target;
  Descriptor descriptor;
  std::optional<Temporary> temporary;
};

bool is_standard_output(const fs::path& path) {
  Target target{.named = path, .file = path, .own_descriptor = {}, .existing = {}};
  follow_links(target);
  return target.own_descriptor == STDOUT_FILENO;
}

Output::Output(const fs::path& path, Access access) : open_(std::make_unique<Open>()) {
  Open& o = *open_;
  o.target = target_of(path);
  if (o.target.through) {
    o.descriptor = open_through(o.target);
    return;
  }
  o.temporary.emplace(make_beside(o.target, access, o.descriptor));
  take_over_permissions(o.target, access, o.descriptor.number());
}

Output::~Output() = default;

void Output::flush() {
  write_into(open_->target, open_->descriptor.number(), buffer_);
  buffer_.clear();
}

void Output::write(std::string_view bytes) {
  go_on();
  if (buffer_.size() + bytes.size() > kBuffer) flush();
  if (bytes.size() > kBuffer || open_->target.through) {
    write_into(open_->target, open_->descriptor.number(), bytes);
  } else {
    buffer_.append(bytes);
  }
}

void Output::commit() {
  Open& o = *open_;
  flush();
  bring_to_disk(o.target, o.descriptor.number());
  if (const int error = o.descriptor.close(); error != 0) cannot_write(o.target.named, error);
  if (o.temporary) replace(o.target, *o.temporary);
}

const fs::path& Output::name() const {
  if (open_->target.through) refuse(open_->target.named, "is no file");
  return open_->temporary->path();
}

void Output::require_room() {
  (void)lseek(open_->descriptor.number(), 0, SEEK_END);
  write_into(open_->target, open_->descriptor.number(), std::string(kBuffer, '\0'));
  bring_to_disk(open_->target, open_->descriptor.number());
}

void write_file(const fs::path& path, std::string_view content, Access access) {
  Output output(path, access);
  output.write(content);
  output.commit();
}

}  // namespace flexor::io
