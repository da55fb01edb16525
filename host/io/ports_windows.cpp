#include <windows.h>

#include <algorithm>

#include "host/io/descriptor.hpp"
#include "host/io/io.hpp"
#include "host/io/serial.hpp"

namespace flexor::io {

// What the system's registry has, by number: COM3, COM10.
std::vector<std::string> serial_ports(const std::filesystem::path&) {
  std::vector<std::string> out;
  HKEY ports = nullptr;
  if (RegOpenKeyExW(HKEY_LOCAL_MACHINE, L"HARDWARE\\DEVICEMAP\\SERIALCOMM", 0, KEY_READ, &ports) != 0)
    return out;
  for (DWORD i = 0;; ++i) {
    wchar_t device[256];
    wchar_t name[64] = {};
    DWORD device_size = 256;
    DWORD name_bytes = sizeof name - sizeof *name;
    if (RegEnumValueW(ports, i, device, &device_size, nullptr, nullptr, reinterpret_cast<BYTE*>(name),
                      &name_bytes) != 0)
      break;
    out.push_back(std::filesystem::path(name).string());
  }
  RegCloseKey(ports);
  std::ranges::sort(out, {}, [](const std::string& name) { return std::pair(name.size(), name); });
  return out;
}

bool is_there(const std::string& port) {
  return port.starts_with("\\\\") || std::ranges::count(serial_ports(""), port) > 0;
}

std::string require_port(const std::string& port) {
  std::string name = port;
  std::ranges::transform(name, name.begin(), [](char c) { return c >= 'a' && c <= 'z' ? c - 32 : c; });
  if (!is_there(name))
    throw InputError("{}: no such port: is the board plugged in? flexor ports lists what there is", port);
  return name;
}

int open_for_lines(const std::filesystem::path& path, bool& is_port) {
  is_port = true;
  Descriptor file(::open((L"\\\\.\\" + path.filename().wstring()).c_str(), O_RDWR));
  if (!file) return -errno;
  const auto port = reinterpret_cast<HANDLE>(_get_osfhandle(file.number()));
  DCB settings = {};
  settings.DCBlength = sizeof settings;
  COMMTIMEOUTS timeouts = {};
  timeouts.ReadIntervalTimeout = MAXDWORD;  // at once, whatever came
  timeouts.WriteTotalTimeoutConstant = 1;
  if (GetCommState(port, &settings) == 0) return -ENOTTY;
  if (BuildCommDCBW(L"115200,n,8,1", &settings) == 0 || SetCommState(port, &settings) == 0 ||
      SetCommTimeouts(port, &timeouts) == 0)
    return -ENOTTY;
  return file.release();
}

}  // namespace flexor::io
