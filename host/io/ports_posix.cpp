#include <grp.h>
#include <termios.h>

#include <algorithm>
#include <set>

#include "host/io/descriptor.hpp"
#include "host/io/io.hpp"
#include "host/io/serial.hpp"

namespace flexor::io {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> entries(const fs::path& folder, const std::string& prefix) {
  std::vector<fs::path> out;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (entry.path().filename().string().starts_with(prefix)) out.push_back(entry.path());
  }
  std::ranges::sort(out);
  return out;
}

}  // namespace

std::vector<std::string> serial_ports(const fs::path& dev) {
  std::vector<std::string> out;
  std::set<fs::path> known;
  std::error_code error;
  for (const auto& [folder, prefix] :
       {std::pair(dev / "serial" / "by-id", ""), {dev, "ttyUSB"}, {dev, "ttyACM"}}) {
    for (const fs::path& name : entries(folder, prefix)) {
      if (known.insert(fs::canonical(name, error)).second && !error) out.push_back(name.string());
    }
  }
  return out;
}

std::string require_port(const std::string& port) {
  const fs::path path = fs::absolute(port);
  struct stat info {};
  if (stat(path.c_str(), &info) != 0)
    throw InputError("{}: no such port: is the board plugged in? --port auto looks for it", port);
  if (!S_ISCHR(info.st_mode)) throw InputError("{}: is no serial port", port);
  if (access(path.c_str(), R_OK | W_OK) == 0) return path.string();
  const group* owner = getgrgid(info.st_gid);
  throw InputError("{}: no permission: sudo usermod -aG {} $USER, then log in again", port,
                   owner != nullptr ? owner->gr_name : "dialout");
}

int open_for_lines(const fs::path& path, bool& is_port) {
  constexpr int kPipeBytes =
      4096;  // a second or so of lines: who comes back does not see an old hand for long
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return -errno;
  if (!S_ISCHR(status.st_mode) && !S_ISFIFO(status.st_mode)) return -ENOTTY;
  is_port = S_ISCHR(status.st_mode);
  Descriptor file(::open(path.c_str(), (is_port ? O_RDWR : O_WRONLY) | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!file) return -errno;
  termios settings{};
  if (is_port && tcgetattr(file.number(), &settings) != 0) return -ENOTTY;
  cfmakeraw(&settings);
  settings.c_cflag |= CLOCAL | CREAD;
  cfsetspeed(&settings, B115200);
  if (is_port && tcsetattr(file.number(), TCSANOW, &settings) != 0) return -ENOTTY;
  if (!is_port) (void)::fcntl(file.number(), F_SETPIPE_SZ, kPipeBytes);
  return file.release();
}

bool is_there(const std::string& port) { return fs::exists(port); }

}  // namespace flexor::io
