// The bend of five fingers as the text that OpenGloves drivers read, to a serial port, a pseudo-terminal or a FIFO.
//
// Never waits: while nobody reads, lines are left out, whole ones; who comes back gets the next. A port or a reader that
// went is looked for again twice a second. Where the driver asks on a port what this is, it is answered. Text and
// gestures are those of the glove's own firmware (runtime/link/opengloves.hpp, gestures.hpp).
//
// The process has to ignore SIGPIPE, as `flexor` does.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>

#include "host/export/sink.hpp"
#include "runtime/link/gestures.hpp"

namespace flexor::exports {

// A finger's bend is 0 at one angle of the joint that determines it, 1 at another, as a model's ends are apart.
struct FingerRange {
  std::size_t joint = 0;  // of those that add() gets
  double straight_deg = 0;
  double bent_deg = 90;
};

struct OpenGlovesOptions {
  std::array<std::optional<FingerRange>, 5>
      fingers;        // thumb first; without one a finger is straight for ever
  bool right = true;  // hand
};

class OpenGloves : public Sink {
 public:
  // Throws io::InputError: no such port or FIFO, or it is something else.
  OpenGloves(const std::filesystem::path& path, const OpenGlovesOptions& options);
  ~OpenGloves() override { close_it(); }
  OpenGloves(const OpenGloves&) = delete;
  OpenGloves& operator=(const OpenGloves&) = delete;

  // A finger whose angle is NaN stays as it was.
  void add(double t_s, std::span<const double> angle_deg) override;

 private:
  int open_it();  // 0 or errno
  void close_it();
  void answer();
  void send();
  std::string line(std::span<const double> angle_deg);

  std::filesystem::path path_;
  OpenGlovesOptions options_;
  std::uint8_t fingers_;
  link::Gestures gestures_;
  link::GloveValues values_{};
  int file_ = -1;
  bool is_port_ = false;
  std::optional<double> tried_s_;
  std::string pending_;  // of a line that only half of went out
};

}  // namespace flexor::exports
