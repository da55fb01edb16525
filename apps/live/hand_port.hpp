// The bionic hand at a port of its own, beside the glove: what it says of its fingers.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "host/listen/source.hpp"
#include "host/twin/parameters.hpp"

namespace flexor::live {

class HandPort {
 public:
  // `from` gives a hand's telemetry (listen::Format::hand); `begin_s`: the server's clock when its own was 0.
  HandPort(std::shared_ptr<listen::Source> from, std::string at, double begin_s);

  // Samples that came since the last time, on the server's clock; never waits.
  std::vector<listen::Sample> poll();
  // connected; gone: unplugged; waits: for its glove, and says nothing of its fingers.
  const char* status(double now_s) const;
  // Of the newest sample, in words; "": nothing.
  std::array<std::string, twin::kFingers> faults() const;
  std::string board_faults() const { return remark(3 * twin::kFingers); }

  const std::shared_ptr<listen::Source> source;
  const std::string path;

 private:
  std::string remark(std::size_t column) const;

  double begin_s_;
  bool is_gone_ = false;
  listen::Sample newest_;
  double newest_s_;
};

}  // namespace flexor::live
