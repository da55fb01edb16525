// Ports: which there are, who speaks at them, the place of the glove and that of the hand.
#include <algorithm>

#include "apps/live/live.hpp"
#include "host/deploy/flash.hpp"
#include "host/deploy/pair_key.hpp"
#include "host/io/io.hpp"
#include "host/listen/listener.hpp"

namespace flexor::live {
namespace {

constexpr std::size_t kMostTried = 2;  // ports that nobody has named: a glove's and a hand's

bool is_same_port(const std::string& a, const std::string& b) {
  std::error_code error;
  return a == b || std::filesystem::equivalent(a, b, error);
}

}  // namespace

// Those that the options name.
void Live::connect_named() {
  if (options_.port != "auto") named_.push_back(deploy::choose_port(options_.port));
  if (!options_.hand.empty()) named_.push_back(hand_path_ = deploy::choose_port(options_.hand));
  if (named_.size() == 2 && is_same_port(named_.front(), named_.back()))
    throw io::InputError(hand_path_ + ": --port and --hand name the same port");
  if (!named_.empty()) listen_to(named_, true);
}

// Where nothing was said, something may be later.
void Live::look_at_named() {
  constexpr double kEvery_s = 5;
  if (wall_s() - named_tried_s_ < kEvery_s) return;
  named_tried_s_ = wall_s();
  std::vector<std::string> silent;
  for (const std::string& path : free_ports(named_)) {
    const bool has_place = path == hand_path_ ? !hand_port_ : !source_;
    if (has_place && std::filesystem::exists(path)) silent.push_back(path);
  }
  if (!silent.empty()) listen_to(silent, false);
}

void Live::connect(const std::string& port) {
  if (port.empty()) throw io::InputError("no port is chosen: plug the glove in, and choose its port");
  const std::vector<std::string> free = free_ports(deploy::find_ports(options_.devices));
  const bool any = port == "auto" && !free.empty() && free.size() <= kMostTried;
  listen_to(any ? free : std::vector{deploy::choose_port(port, options_.devices)}, true);
}

// The ports there are, also when they are plugged in later. One that said nothing that is known is tried again when others
// come. A board that is being written comes and goes: nobody takes its port meanwhile.
void Live::look_for_port() {
  const bool is_whole = source_ && hand_port_;
  if (options_.worn || replay_ || jobs_.is_running() || is_whole || search_.is_running() ||
      device_ == DeviceState::left)
    return;
  look_at_named();
  if (options_.port != "auto" || search_.is_running()) return;
  const std::vector<std::string> ports = deploy::find_ports(options_.devices);
  if (ports == tried_ports_) return;
  tried_ports_ = ports;
  const std::vector<std::string> free = free_ports(ports);
  if (!free.empty() && free.size() <= kMostTried) listen_to(free, false);
}

std::vector<std::string> Live::free_ports(std::vector<std::string> ports) const {
  std::erase_if(ports, [this](const std::string& path) {
    return (source_ && is_same_port(path, port_)) || (hand_port_ && is_same_port(path, hand_port_->path()));
  });
  return ports;
}

// One after the other. The glove and the hand stay until another one is found, but at a port that is listened to anew.
void Live::listen_to(std::vector<std::string> paths, bool is_chosen) {
  listen::ListenerOptions options;
  options.baud = options_.baud;
  options.readings = true;
  options.angles_will_do = true;
  options.waiting_hand_will_do = true;
  // Of a file it may be another by now; standard input is read once.
  if (std::filesystem::is_regular_file(options_.key)) key_ = deploy::load_key(options_.key);
  options.key = key_;
  search_.end();
  for (const std::string& path : paths) {
    const bool is_over = is_chosen && (replay_ || device_ == DeviceState::gone);
    if (source_ && (is_over || is_same_port(path, port_))) detach();
    if (hand_port_ && is_same_port(path, hand_port_->path())) hand_port_.reset();
  }
  if (!source_) {
    device(DeviceEvent::listens);
    port_ = paths.front();
    says_ = port_ + ": listening";
  }
  search_.begin(
      std::move(paths), std::move(options),
      {[this](const std::string& path, const std::string& what) {
         if (!source_) says_ = path + ": " + what;
       },
       [this, is_chosen](const FoundPort& found) { found_port(found, is_chosen); }, [this] { searched(); }});
}

// What is chosen takes the place of who is there.
void Live::found_port(const FoundPort& found, bool is_chosen) {
  if (!found.listener) {
    if (source_ && is_chosen) say_failed("port", found.trouble);
    if (source_) return;
    says_ = found.trouble;
    device(DeviceEvent::misunderstands);
    return;
  }
  const bool is_hand = found.listener->format() == listen::Format::hand;
  if (!is_hand && found.path == hand_path_) {
    if (is_chosen) say_failed("port", found.path + ": --hand names a glove's port");
    return;
  }
  if (!is_hand) {
    if (is_chosen || !source_) attach(found.listener, found.path, DeviceEvent::speaks);
  } else if (is_chosen || !hand_port_) {
    hand_port_.emplace(found.listener, found.path, now_s() - found.listener->now_s());
  }
}

void Live::searched() {
  if (source_ || device_ == DeviceState::left) return;
  device(DeviceEvent::ends);
  port_.clear();
  if (device_ == DeviceState::none) says_ = "no glove";
}

void Live::hear_hand() {
  if (!hand_port_ || held_) return;
  const std::vector<listen::Sample> samples = hand_port_->poll();
  if (samples.empty()) return;
  Rows rows(Kind::hand, twin::kFingers);
  for (const listen::Sample& sample : samples) {
    rows.add(
        sample.host_s, [&](std::size_t i) { return hand_duty_percent(sample, i); },
        [&](std::size_t i) { return hand_deg(sample, i); });
  }
  server_->send_all(rows.bytes());
  guard_recording([&] {
    for (const listen::Sample& sample : samples) recording_->add_hand(sample, hand_port_->columns());
  });
}

}  // namespace flexor::live
