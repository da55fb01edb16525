// The bionic hand at a port of its own, beside the glove: what it reports of its fingers.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "host/io/json.hpp"
#include "host/listen/source.hpp"

namespace flexor::live {

// As SOCKET.md has it.
Json hand_state(const char* status, const Json& port, const std::vector<std::string>& faults,
                const std::string& board);

class HandPort {
 public:
  // `from` gives a hand's telemetry (listen::Format::hand); `begin_s`: the server's clock when its own was 0.
  HandPort(std::shared_ptr<listen::Source> from, std::string at, double begin_s);

  // Samples that came since the last time, on the server's clock; never waits.
  std::vector<listen::Sample> poll();
  Json state(double now_s) const;

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
