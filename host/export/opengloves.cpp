#include "host/export/opengloves.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "host/io/io.hpp"
#include "host/io/posix.hpp"
#include "host/io/serial.hpp"

namespace flexor::exports {
namespace {

constexpr double kRetry_s = 0.5;
constexpr std::uint16_t kVersion = 1;

std::uint8_t fingers_of(const OpenGlovesOptions& options) {
  unsigned bits = 0;
  for (std::size_t i = 0; i < options.fingers.size(); ++i) bits |= options.fingers[i] ? 1u << i : 0u;
  return static_cast<std::uint8_t>(bits);
}

}  // namespace

OpenGloves::OpenGloves(const std::filesystem::path& path, const OpenGlovesOptions& options)
    : path_(path), options_(options), fingers_(fingers_of(options)) {
  values_.joystick[0] = values_.joystick[1] = link::kGloveMiddle;
  const int error = open_it();
  // A FIFO without a reader: one comes.
  if (error == 0 || error == ENXIO) return;
  close_it();
  if (error == ENOENT)
    throw io::InputError("{0}: there is none: plug the port in, or make a FIFO with `mkfifo {0}`",
                         path.string());
  if (error == ENOTTY)
    throw io::InputError("{}: is neither a serial port nor a FIFO (mkfifo makes one)", path.string());
  throw io::InputError("{}: cannot be opened: {}", path.string(), std::strerror(error));
}

int OpenGloves::open_it() {
  const int opened = io::open_for_lines(path_, is_port_);
  file_ = std::max(opened, -1);
  return opened < 0 ? -opened : 0;
}

void OpenGloves::close_it() {
  if (file_ >= 0) ::close(file_);
  file_ = -1;
  pending_.clear();
}

std::string OpenGloves::line(std::span<const double> angle_deg) {
  for (std::size_t i = 0; i < options_.fingers.size(); ++i) {
    const auto& finger = options_.fingers[i];
    if (!finger || std::isnan(angle_deg[finger->joint])) continue;
    const double bend =
        (angle_deg[finger->joint] - finger->straight_deg) / (finger->bent_deg - finger->straight_deg);
    values_.flexion[i] =
        static_cast<std::uint16_t>(std::lround(std::clamp(bend, 0.0, 1.0) * link::kGloveTop));
  }
  values_.trigger = link::trigger_pull(values_.flexion[1]);
  values_.buttons = gestures_.step(values_.flexion, fingers_);
  char text[link::kMaxGloveText];
  return {text, link::encode_gloves(values_, nullptr, 0, text)};
}

// What the driver asks; everything else it sends, forces among them, is passed over.
void OpenGloves::answer() {
  char asked[256];
  const ssize_t n = ::read(file_, asked, sizeof asked);
  if (n <= 0 || std::find(asked, asked + n, 'Z') == asked + n) return;
  char text[link::kMaxInformationText];
  pending_ += std::string(text, link::encode_glove_information(kVersion, options_.right, text));
}

// What is pending, as far as it goes without waiting.
void OpenGloves::send() {
  while (!pending_.empty()) {
    const ssize_t n = ::write(file_, pending_.data(), pending_.size());
    if (n > 0) {
      pending_.erase(0, static_cast<std::size_t>(n));
    } else if (n < 0 && errno != EINTR && errno != EAGAIN) {
      return close_it();  // the reader or the port has gone
    } else if (n == 0 || errno == EAGAIN) {
      return;
    }
  }
}

void OpenGloves::add(double t_s, std::span<const double> angle_deg) {
  const std::string text = line(angle_deg);
  if (file_ < 0 && (!tried_s_ || t_s - *tried_s_ >= kRetry_s)) {
    tried_s_ = t_s;
    if (open_it() != 0) close_it();
  }
  if (file_ >= 0) send();                      // the rest of the last line
  if (file_ < 0 || !pending_.empty()) return;  // nobody reads
  if (is_port_) answer();
  pending_ += text;
  const std::size_t size = pending_.size();
  send();
  if (pending_.size() == size) pending_.clear();  // nothing of it went out
}

}  // namespace flexor::exports
