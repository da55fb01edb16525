#include "host/deploy/deploy.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

namespace flexor::deploy {
namespace {

TEST(Deploy, Builds) {
  Glove g;
  g.model = model::load(std::string(FLEXOR_SOURCE_DIR) + "/models/published_hw.json");
  g.sensor.fill(divider(35, 25, 100.0 / 180));
  g.key = key_from_hex("000102030405060708090a0b0c0d0e0f");
  Hand h;
  h.lower_deg = {90, 28, 28, 28, 28};
  h.upper_deg = {170, 113, 113, 113, 113};
  h.rest_deg = {90, 29, 29, 29, 29};
  h.key = g.key;
  auto a = build_glove(g, "/tmp/dep");
  auto b = build_hand(h, "/tmp/dep");
  printf("%d %d  %d %d\n", a.flash_bytes, a.ram_bytes, b.flash_bytes, b.ram_bytes);
}

}  // namespace
}  // namespace flexor::deploy
