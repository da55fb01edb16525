#include "host/deploy/caterina.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <system_error>
#include <thread>
#include <vector>

#include "host/deploy/flash.hpp"
#include "host/io/io.hpp"
#include "host/io/serial.hpp"

namespace flexor::deploy {
namespace {

namespace fs = std::filesystem;
using Ports = std::vector<std::string>;

// Looks ten times a second until `found` has something, or not within the time.
std::optional<std::string> await(double seconds, const std::function<std::optional<std::string>()>& found) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (std::chrono::steady_clock::now() < end) {
    if (auto port = found()) return port;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  return {};
}

bool is_plugged_in(const std::string& port) {
  std::error_code error;
  return fs::exists(port, error);
}

// One that was not there before.
std::optional<std::string> come(const fs::path& dev, const Ports& before) {
  for (const std::string& port : find_ports(dev)) {
    if (std::ranges::find(before, port) == before.end()) return port;
  }
  return {};
}

// A device node comes before udev has given it to its group.
std::string usable(const std::string& port, const fs::path& dev) {
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  return choose_port(port, dev);
}

}  // namespace

std::string caterina_port(const std::string& port, const std::function<void(const std::string&)>& say,
                          const fs::path& dev, const CaterinaPatience& patience) {
  const Ports before = find_ports(dev);
  const bool absent = port == "auto" ? before.empty() : !is_plugged_in(port);
  if (absent) {
    say(fmt::format(
        "press the board's reset button, twice on a Pro Micro: its bootloader is awaited for {:g} s",
        patience.button_s));
    const auto found = await(patience.button_s, [&] { return come(dev, before); });
    if (!found) throw io::InputError("no bootloader came: press reset while this command waits");
    return usable(*found, dev);
  }
  const std::string touched = choose_port(port, dev);
  constexpr unsigned kTouch_Bd = 1200;
  { const io::SerialPort touch(touched, kTouch_Bd); }
  Ports others = before;
  std::erase(others, touched);
  const auto left = await(patience.leaves_s, [&]() -> std::optional<std::string> {
    if (is_plugged_in(touched)) return {};
    return touched;
  });
  if (!left) return touched;
  const auto found = await(patience.comes_s, [&] { return come(dev, others); });
  if (!found)
    throw io::InputError(
        fmt::format("{}: left, and no bootloader came: press reset, then try again", touched));
  return usable(*found, dev);
}

}  // namespace flexor::deploy
