#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <fstream>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "runtime/link/receiver.hpp"

namespace flexor::link {
namespace {

const Key kKey = {{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15}};

std::vector<uint8_t> wire_of(const Frame& frame, const Key* key) {
  std::vector<uint8_t> wire(kWireSealed);
  wire.resize(encode(frame, key, wire.data()));
  return wire;
}

Received feed(Receiver& receiver, const std::vector<uint8_t>& bytes) {
  Received last = Received::nothing;
  for (const uint8_t byte : bytes) last = receiver.push(byte);
  return last;
}

Frame frame_number(uint32_t counter) {
  Frame frame{};
  frame.counter = counter;
  frame.time_ms = static_cast<uint16_t>(100 * counter);
  for (int i = 0; i < kFingers; ++i) frame.angle[i] = static_cast<int16_t>(16 * (30 + 10 * i));
  return frame;
}

TEST(Crc16, HasTheCheckValueOfItsCatalogue) {
  const std::string text = "123456789";
  EXPECT_EQ(crc16(reinterpret_cast<const uint8_t*>(text.data()), 9), 0x31C3);
}

TEST(SipHash, HasTheReferencesVectors) {
  // Appendix A of the paper, and the first of the reference implementation.
  std::vector<uint8_t> message;
  EXPECT_EQ(siphash24(kKey, message.data(), 0), 0x726fdb47dd0e0e31ULL);
  for (uint8_t i = 0; i < 15; ++i) message.push_back(i);
  EXPECT_EQ(siphash24(kKey, message.data(), 15), 0xa129ca6149be45e5ULL);
  EXPECT_EQ(siphash24(kKey, message.data(), 8), 0x93f5f5799a932462ULL);
}

TEST(Link, SpeaksTheGoldenVectors) {
  std::ifstream file(std::string(FLEXOR_SOURCE_DIR) + "/runtime/link/golden.txt");
  std::string line;
  std::getline(file, line);
  int vectors = 0;
  while (std::getline(file, line)) {
    std::istringstream fields(line);
    std::string key_hex;
    std::string wire_hex;
    Frame frame{};
    fields >> key_hex >> frame.counter >> frame.time_ms;
    for (int16_t& angle : frame.angle) fields >> angle;
    for (SensorStatus& status : frame.status) {
      int value = 0;
      fields >> value;
      status = static_cast<SensorStatus>(value);
    }
    fields >> wire_hex;
    Key key{};
    const bool sealed = key_hex != "-";
    for (std::size_t i = 0; sealed && i < 16; ++i) {
      key.bytes[i] = static_cast<uint8_t>(std::stoi(key_hex.substr(2 * i, 2), nullptr, 16));
    }
    std::vector<uint8_t> expected;
    for (std::size_t i = 0; i < wire_hex.size(); i += 2) {
      expected.push_back(static_cast<uint8_t>(std::stoi(wire_hex.substr(i, 2), nullptr, 16)));
    }
    const std::vector<uint8_t> wire = wire_of(frame, sealed ? &key : nullptr);
    EXPECT_EQ(wire, expected) << line;
    EXPECT_EQ(wire.size(), sealed ? kWireSealed : kWirePlain);
    Receiver receiver(sealed ? &key : nullptr, frame.counter > 0 ? frame.counter - 1 : 0);
    if (frame.counter == 0) continue;
    ASSERT_EQ(feed(receiver, wire), Received::frame) << line;
    EXPECT_EQ(receiver.frame().counter, frame.counter);
    EXPECT_EQ(receiver.frame().time_ms, frame.time_ms);
    for (int i = 0; i < kFingers; ++i) {
      EXPECT_EQ(receiver.frame().angle[i], frame.angle[i]);
      EXPECT_EQ(receiver.frame().status[i], frame.status[i]);
    }
    ++vectors;
  }
  EXPECT_GE(vectors, 10);
}

RC_GTEST_PROP(Link, CobsGivesBackEveryPayload, (const std::vector<uint8_t>& any)) {
  std::vector<uint8_t> payload(
      any.begin(), any.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(any.size(), 253)));
  std::vector<uint8_t> wire(payload.size() + 2);
  const uint8_t size = cobs_encode(payload.data(), static_cast<uint8_t>(payload.size()), wire.data());
  RC_ASSERT(size == payload.size() + 2);
  RC_ASSERT(std::find(wire.begin(), wire.end() - 1, 0) == wire.end() - 1);
  RC_ASSERT(cobs_decode(wire.data(), static_cast<uint8_t>(size - 1)) == payload.size());
  wire.resize(payload.size());
  RC_ASSERT(wire == payload);
}

TEST(Link, RefusesReplayedReorderedForgedAndForeignFrames) {
  Receiver receiver(&kKey);
  const auto first = wire_of(frame_number(1), &kKey);
  const auto second = wire_of(frame_number(2), &kKey);
  EXPECT_EQ(feed(receiver, second), Received::frame);
  EXPECT_EQ(feed(receiver, second), Received::not_trusted);
  EXPECT_EQ(feed(receiver, first), Received::not_trusted);
  Key other = kKey;
  other.bytes[15] ^= 1;
  EXPECT_EQ(feed(receiver, wire_of(frame_number(3), &other)), Received::not_trusted);
  EXPECT_EQ(feed(receiver, wire_of(frame_number(3), nullptr)), Received::not_trusted);
  EXPECT_EQ(feed(receiver, wire_of(frame_number(4), &kKey)), Received::frame);
  EXPECT_EQ(receiver.statistics().not_trusted, 4U);
  EXPECT_EQ(receiver.statistics().lost, 1U);
  EXPECT_EQ(receiver.statistics().received, 2U);
}

TEST(Link, FollowsWrapsAndRestartsOfTheGlove) {
  Receiver receiver(&kKey, (7U << 16) | 65534);
  EXPECT_EQ(feed(receiver, wire_of(frame_number((7U << 16) | 65535), &kKey)), Received::frame);
  EXPECT_EQ(feed(receiver, wire_of(frame_number(8U << 16), &kKey)), Received::frame);
  EXPECT_EQ(receiver.statistics().lost, 0U);
  EXPECT_EQ(feed(receiver, wire_of(frame_number(12U << 16), &kKey)),
            Received::frame);  // restarted four times
  EXPECT_EQ(feed(receiver, wire_of(frame_number(17U << 16), &kKey)),
            Received::not_trusted);  // five are too many
  EXPECT_EQ(feed(receiver, wire_of(frame_number(11U << 16), &kKey)), Received::not_trusted);
}

// Ten million corrupted frames: one to four flipped bits and at times a lost byte; good ones in between.
TEST(LinkRecovery, NoCorruptedFrameIsAcceptedAndTheNextGoodOneIs) {
  std::mt19937 random(5);
  Receiver receiver(&kKey);
  uint32_t counter = 1;
  auto good = wire_of(frame_number(counter), &kKey);
  int accepted = 0;
  constexpr int kFrames = 10'000'000;
  for (int k = 0; k < kFrames; ++k) {
    std::vector<uint8_t> bad = good;
    const auto draws = random();
    for (unsigned flips = draws % 4 + 1, i = 0; i < flips; ++i) {
      const auto bit = random() % (8 * (bad.size() - 1));
      bad[bit / 8] = static_cast<uint8_t>(bad[bit / 8] ^ (1U << (bit % 8)));
    }
    if ((draws >> 8) % 4 == 0)
      bad.erase(bad.begin() + static_cast<std::ptrdiff_t>((draws >> 16) % (bad.size() - 1)));
    if (bad == good) continue;
    accepted += feed(receiver, bad) == Received::frame;
    if (k % 1000 != 0) continue;
    ASSERT_EQ(feed(receiver, good), Received::frame) << k;
    good = wire_of(frame_number(++counter), &kKey);
  }
  EXPECT_EQ(accepted, 0);
  EXPECT_GT(receiver.statistics().corrupt, 0U);
}

}  // namespace
}  // namespace flexor::link
