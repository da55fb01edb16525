#include "host/listen/listener.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <random>
#include <thread>
#include <utility>

#include "host/io/io.hpp"

namespace flexor::listen {
namespace {

constexpr double kTryEvery_s = 0.1;  // to open a port that has gone
constexpr unsigned kUsualRates_Bd[] = {115200, 9600,   57600,  38400,   19200,  230400,
                                       460800, 500000, 921600, 1000000, 2000000};
constexpr const char* kWaits =
    ": a Flexor glove that waits for its hand: --key pair.key of its deployment lets this program be the "
    "hand";
constexpr const char* kHandWaits =
    ": a Flexor hand that waits for its glove: switch the glove on, and pair both if they were never (flexor "
    "pair)";
constexpr double kAfterReset_s = 3;  // opening a port resets most boards, and a bootloader listens first
constexpr double kEachRate_s = 1.2;

// A whole line of plain text among the bytes, if there is one: whoever wrote the sketch knows it again.
std::string quoted_line(const std::vector<std::uint8_t>& bytes) {
  constexpr std::size_t kLongest = 60;
  const std::string text(bytes.begin(), bytes.end());
  const std::size_t begin = text.find('\n') + 1;
  const std::string line = text.substr(begin, std::min(kLongest, text.find_first_of("\r\n", begin) - begin));
  const auto is_plain = [](unsigned char c) { return c == '\t' || (c >= 0x20 && c < 0x7f); };
  return line.empty() || !std::ranges::all_of(line, is_plain) ? "" : fmt::format(" (\"{}\")", line);
}

}  // namespace

Listener::Listener(ListenerOptions options, const std::function<void(const std::string&)>& report)
    : options_(std::move(options)) {
  if (options_.key) {
    hand_.emplace(&*options_.key);
    std::random_device random;
    // A later one than any before: the glove answers no earlier one at once.
    hand_->start(static_cast<std::uint32_t>(std::time(nullptr)));
    for (int k = 0; k < link::kStirred; ++k) hand_->stir(static_cast<std::uint16_t>(random()));
  }
  find(report);
  if (options_.readings && options_.format == Format::hand)
    throw io::InputError("{}: a hand, which gives no readings: leave out --readings", options_.port);
  if (options_.readings && options_.format == Format::gloves)
    throw io::InputError(
        "{}: lines for VR drivers carry values that the firmware computed, no readings: upload the "
        "logging sketch of the deployment",
        options_.port);
  decoder_ = make_decoder(*options_.format, options_.readings);
  decoder_->cut();
  std::vector<Sample> before;  // without a time of their own; what is wanted of them is the header
  decoder_->push(received_, now_s(), before);
}

// Listens at the port's present rate until the bytes are known. A board that waits, or has not yet received the request for
// readings, may just have been started by the port's opening.
std::optional<Guess> Listener::receive(double longest_s) {
  constexpr double kSure = 0.9;
  const double begin_s = now_s();
  received_.clear();
  std::optional<Guess> best;
  const auto lacks = [&] {
    return best->samples == 0 || (options_.readings && best->format == Format::frames && !best->readings);
  };
  while (now_s() - begin_s < (best && lacks() ? kAfterReset_s : longest_s)) {
    if (options_.stop && *options_.stop) throw io::InputError(options_.port + ": is listened to no longer");
    speak();
    const std::vector<std::uint8_t> bytes = port_->read(0.02);
    received_.insert(received_.end(), bytes.begin(), bytes.end());
    follow(bytes);
    best = bytes.empty() ? best : guess(received_, options_.readings);
    if (best && best->share > kSure && !lacks()) break;
  }
  received_bytes_ += received_.size();
  return best;
}

void Listener::find(const std::function<void(const std::string&)>& report) {
  const bool is_given = options_.baud > 0 && options_.format;  // and believed, where something comes
  const std::span<const unsigned> rates =
      options_.baud > 0 ? std::span<const unsigned>(&options_.baud, 1) : kUsualRates_Bd;
  port_ = std::make_unique<io::SerialPort>(options_.port, rates.front());
  for (const unsigned rate : rates) {
    report(fmt::format("listening at {} baud", rate));
    if (rate != rates.front() && !port_->set_baud(rate)) continue;
    const std::optional<Guess> found = receive(rate == rates.front() ? kAfterReset_s : kEachRate_s);
    const bool will_do = found && found->format == Format::hand && options_.any_will_do;
    if (found && found->samples == 0 && !will_do)
      throw io::InputError(options_.port + (found->format == Format::hand ? kHandWaits : kWaits));
    if (is_given && !found && received_bytes_ > 0) return;
    if (found && (!options_.format || *options_.format == found->format)) {
      options_.baud = rate;
      options_.format = found->format;
      if (options_.any_will_do) options_.readings = found->readings;
      return;
    }
    if (received_bytes_ == 0)  // at a wrong rate something would come
      throw io::InputError(
          "{}: nothing comes: is a program on the board that sends, and is the port its own?", options_.port);
  }
  throw io::InputError(
      "{}: {} bytes came, which are no format that is known at any usual rate{}: send numbers "
      "separated by commas, give --baud, or flash flexor deploy --output log",
      options_.port, received_bytes_, quoted_line(received_));
}

// As the hand: whether its challenge was answered.
void Listener::follow(std::span<const std::uint8_t> bytes) {
  if (!hand_) return;
  for (const std::uint8_t byte : bytes) {
    for (link::Received result = hand_->push(byte); result == link::Received::pending;)
      result = hand_->verify();
  }
}

void Listener::speak() {
  for (const double now = now_s(); hand_ && ticked_s_ < now; ticked_s_ += 1e-3) hand_->tick();
  if (hand_ && hand_->due() == link::HandEnd::Message::challenge) {
    std::array<std::uint8_t, link::kMaxWire> wire{};
    port_->write({wire.data(), hand_->challenge(wire.data())});
  }
  if (options_.readings) ask_for_readings();
}

// A glove gives them for a second. Two requests may be lost, since the hand speaks on the same line, and never two running at
// the same point of its half second.
void Listener::ask_for_readings() {
  constexpr double kEvery_s = 0.3;
  if (asked_s_ >= 0 && now_s() - asked_s_ < kEvery_s) return;
  asked_s_ = now_s();
  link::Packet packet;
  packet.body()[0] = static_cast<std::uint8_t>(link::Request::readings);
  std::array<std::uint8_t, link::kMaxWire> wire{};
  const std::uint8_t size = packet.seal({link::Type::request, false, false, 0}, 1, nullptr, wire.data());
  port_->write({wire.data(), size});
}

std::string Listener::description() const {
  const std::string remark = decoder_->remark();
  return fmt::format("{} at {} baud{}", name_of(format()), baud(), remark.empty() ? "" : ": " + remark);
}

Event Listener::wait(double timeout_s, std::vector<Sample>& out) {
  if (!port_) {
    const double due_s = tried_s_ + kTryEvery_s - now_s();
    std::this_thread::sleep_for(std::chrono::duration<double>(std::clamp(due_s, 0.0, timeout_s)));
    if (due_s > timeout_s) return Event::quiet;
    tried_s_ = now_s();
    try {
      port_ = std::make_unique<io::SerialPort>(options_.port, options_.baud);
    } catch (const io::InputError&) {  // what was let go is missed once
      return std::exchange(was_let_go_, false) ? Event::gone : Event::quiet;
    }
    was_let_go_ = false;
    return Event::back;
  }
  if (const std::string why = decoder_->refusal(); !why.empty())
    throw io::JobError("{}: {}", options_.port, why);
  try {
    speak();
    const std::vector<std::uint8_t> bytes = port_->read(timeout_s);
    if (bytes.empty()) return Event::quiet;
    follow(bytes);
    decoder_->push(bytes, now_s(), out);
    return Event::samples;
  } catch (const io::JobError&) {
    port_.reset();
    decoder_->cut();
    return Event::gone;
  }
}

}  // namespace flexor::listen
