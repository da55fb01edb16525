#include <gtest/gtest.h>

#include <chrono>

#include "cosim/replay.hpp"
#include "cosim/simulation.hpp"
#include "host/deploy/deploy.hpp"

namespace flexor::cosim {
namespace {
TEST(Cosim, First) {
  for (const char* name : {"published_hw", "published_wiener"}) {
    for (bool assembly : {false, true}) {
      deploy::Glove g;
      g.model = model::load(std::string(FLEXOR_SOURCE_DIR) + "/models/" + name + ".json");
      g.sensor.fill(deploy::divider(35, 25, 100.0 / 180));
      g.key = deploy::key_from_hex("000102030405060708090a0b0c0d0e0f");
      g.assembly = assembly;
      const auto image = deploy::build_glove(g, "/tmp/dep");
      const Firmware f(image.elf);
      const auto start = std::chrono::steady_clock::now();
      const auto r = replay(f, g, exercise(2000, 1));
      printf("%s %d: %d %d samples %zu frames %zu mismatches %zu step %.1f/%lu sample %.1f/%lu stack %d awake %.4f  %.1fx\n", name, assembly,
             image.flash_bytes, image.ram_bytes, r.samples, r.frames, r.mismatches, r.step.mean(), r.step.worst, r.sample.mean(), r.sample.worst,
             r.stack_bytes, r.awake_share, 200 / std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    }
  }
}
}  // namespace
}  // namespace flexor::cosim
