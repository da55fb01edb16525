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

// One that was not there before. What has left since is forgotten: it may come back under its name.
std::optional<std::string> come(const fs::path& dev, Ports& before) {
  Ports now = find_ports(dev);
  for (const std::string& port : now) {
    if (std::ranges::find(before, port) == before.end()) return port;
  }
  before = std::move(now);
  return {};
}

// All names of the one that is touched: its bootloader may have the same.
Ports without(const Ports& ports, const std::string& touched) {
  Ports out;
  std::error_code error;
  for (const std::string& port : ports) {
    if (!fs::equivalent(port, touched, error)) out.push_back(port);
  }
  return out;
}

// A device node comes before udev has given it to its group.
std::string usable(const std::string& port, const fs::path& dev) {
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  return choose_port(port, dev);
}

// What the Arduino core takes for the order to leave for its bootloader; false: it has not left.
bool leaves(const std::string& port, double within_s) {
  constexpr unsigned kTouch_Bd = 1200;
  { const io::SerialPort touch(port, kTouch_Bd); }
  const auto left = await(within_s, [&]() -> std::optional<std::string> {
    if (is_plugged_in(port)) return {};
    return port;
  });
  return left.has_value();
}

}  // namespace

std::string caterina_port(const std::string& port, const std::function<void(const std::string&)>& say,
                          const fs::path& dev, const CaterinaPatience& patience) {
  Ports before = find_ports(dev);
  const bool is_auto = port == "auto";
  if (is_auto ? before.size() == 1 : is_plugged_in(port)) {
    const std::string touched = choose_port(port, dev);
    const Ports others = without(before, touched);
    if (leaves(touched, patience.leaves_s)) {
      before = others;
      const auto found = await(patience.comes_s, [&] { return come(dev, before); });
      if (found) return usable(*found, dev);
      throw io::InputError(
          fmt::format("{}: left, and no bootloader came: press reset, then try again", touched));
    }
    if (!is_auto) return touched;
  }
  say(fmt::format(
      "{}press the board's reset button, twice on a Pro Micro: its bootloader is awaited for {:g} s",
      before.empty() ? "" : "another board may be what is plugged in: ", patience.button_s));
  const auto found = await(patience.button_s, [&] { return come(dev, before); });
  if (!found) throw io::InputError("no bootloader came: press reset while this command waits");
  return usable(*found, dev);
}

}  // namespace flexor::deploy
