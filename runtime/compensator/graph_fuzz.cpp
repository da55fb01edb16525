// Any bytes as a part of a graph, with size and CRC as they must be: refused, or run, and nothing is read or written
// outside part and arena.
#include <stddef.h>
#include <cstring>
#include <memory>

#include "runtime/compensator/graph.hpp"

namespace {

using namespace flexor;

constexpr uint16_t kCalibration[compensator::kSensors] = {};

template <class Graph>
void run(const uint8_t* part, uint16_t size, const uint8_t* readings, size_t count) {
  const auto graph = std::make_unique<Graph>();
  if (graph->add(part, size, {kCalibration, 50}) != compensator::Loaded::ok) return;
  for (size_t k = 0; k < count; ++k) {
    for (int16_t& alpha : graph->alpha) alpha = static_cast<int16_t>(257 * readings[k]);
    (void)graph->step();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  constexpr size_t kReadings = 8;
  if (size < kReadings + compensator::kHeaderBytes || size > 2000) return 0;
  const uint16_t bytes = static_cast<uint16_t>(size - kReadings + compensator::kCrcBytes);
  const std::unique_ptr<uint8_t[]> part(new uint8_t[bytes]);  // nothing lies behind it
  std::memcpy(part.get(), data + kReadings, bytes - compensator::kCrcBytes);
  part[0] = compensator::kGraphVersion;
  part[1] = static_cast<uint8_t>(bytes);
  part[2] = static_cast<uint8_t>(bytes >> 8);
  part[3] = 50;
  uint16_t crc = 0;
  for (uint16_t i = 0; i + compensator::kCrcBytes < bytes; ++i) crc = core::crc16_add(crc, part[i]);
  part[bytes - 2] = static_cast<uint8_t>(crc);
  part[bytes - 1] = static_cast<uint8_t>(crc >> 8);
  run<compensator::Graph<core::Ram, 200>>(part.get(), bytes, data, kReadings);
  run<compensator::Graph<core::Ram, 2000>>(part.get(), bytes, data, kReadings);
  return 0;
}
