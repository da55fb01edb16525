#include "host/twin/radio.hpp"

#include <gtest/gtest.h>

namespace flexor::twin {
namespace {

Parameters clean() {
  Parameters p;
  p.frame_bytes = 12;
  p.module_latency_s = 0.002;
  p.jitter_s = 0;
  return p;
}

TEST(Radio, AFrameTakesItsAirtime) {
  const Parameters p = clean();
  Radio radio(p, 1);
  radio.send(100, {160, 0, 0, 0, 0});
  EXPECT_EQ(radio.next_arrival_ms(),
            115);  // 12 bytes of 10 bits at 9600 baud are 12.5 ms, and the module's 2 ms
  EXPECT_EQ(radio.receive(114), nullptr);
  const FrameAngles* angles = radio.receive(115);
  ASSERT_NE(angles, nullptr);
  EXPECT_EQ((*angles)[0], 160);
  EXPECT_EQ(radio.receive(116), nullptr);
}

TEST(Radio, WhatDoesNotFitTheAirIsLost) {
  const Parameters p = clean();
  Radio radio(p, 1);
  for (int k = 0; k < 100; ++k) radio.send(k, {});
  EXPECT_EQ(radio.sent(), 100);
  EXPECT_EQ(radio.sent() - radio.lost(), 9);  // one every 12.5 ms, and one that waits
}

TEST(Radio, LosesTheShareItIsGiven) {
  Parameters p = clean();
  p.loss = 0.1;
  p.corruption = 0.1;
  Radio radio(p, 7);
  for (int k = 0; k < 10000; ++k) {
    radio.send(100 * k, {});
    (void)radio.receive(100 * k + 99);
  }
  EXPECT_NEAR(radio.lost() / 10000.0, 1 - 0.9 * 0.9, 0.015);
}

TEST(Radio, AnOutageIsSilentAndEnds) {
  Parameters p = clean();
  p.outage_start_s = 1;
  p.outage_s = 2;
  Radio radio(p, 1);
  int received = 0;
  for (int ms = 0; ms < 5000; ++ms) {
    if (ms % 100 == 0) radio.send(ms, {});
    if (radio.receive(ms) != nullptr) {
      ++received;
      EXPECT_TRUE(ms < 1000 || ms >= 3000);
    }
  }
  EXPECT_EQ(received, 30);
}

TEST(Radio, AnOvertakenFrameIsDropped) {
  Parameters p = clean();
  p.jitter_s = 0.5;
  Radio radio(p, 3);
  int last = -1;
  for (int ms = 0; ms < 20000; ++ms) {
    if (ms % 20 == 0) radio.send(ms, {static_cast<std::int16_t>(ms / 20), 0, 0, 0, 0});
    const FrameAngles* angles = radio.receive(ms);
    if (angles == nullptr) continue;
    EXPECT_GT((*angles)[0], last);
    last = (*angles)[0];
  }
  EXPECT_GT(radio.lost(), 100);
}

}  // namespace
}  // namespace flexor::twin
