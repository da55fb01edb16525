#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "runtime/link/counter_store.hpp"
#include "runtime/link/latency.hpp"
#include "runtime/link/opengloves.hpp"
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
  for (const uint8_t byte : bytes) last = receiver.receive(byte);
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
    Receiver receiver(sealed ? &key : nullptr);
    receiver.resume(frame.counter > 0 ? frame.counter - 1 : 0);
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
  Receiver receiver(&kKey);
  receiver.resume((7U << 16) | 65534);
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

TEST(Link, ComputesAtMostOneTagACall) {
  Receiver receiver(&kKey);
  Key other = kKey;
  other.bytes[0] ^= 1;
  const auto forged = wire_of(frame_number(9), &other);
  Received result = Received::nothing;
  for (const uint8_t byte : forged) result = receiver.push(byte);
  int calls = 0;
  for (; result == Received::pending; ++calls) result = receiver.verify();
  EXPECT_EQ(calls, kEpochsAhead + 1);
  EXPECT_EQ(result, Received::not_trusted);
}

TEST(Latency, SaysHowMuchLaterThanTheQuickestAcrossWrapsAndDrift) {
  Latency latency;
  for (int k = 0; k < 20000; ++k) {
    const auto sent = static_cast<uint16_t>(50 * k);
    // The receiver's clock gains 20 ppm: a millisecond in 1000 frames.
    const auto now = static_cast<uint16_t>(50 * k + 12345 + 30 + k / 1000 + (k % 7 == 3 ? 8 : 0));
    const uint16_t late = latency.add(now, sent);
    if (k < 7) continue;
    EXPECT_NEAR(late, k % 7 == 3 ? 8 : 0, 1) << k;
  }
  EXPECT_LE(latency.worst_ms(), 9);
}

// EEPROM that can lose power after any byte, or in the middle of one.
struct FakeEeprom {
  std::vector<uint8_t> bytes = std::vector<uint8_t>(1024, 0xff);
  std::vector<int> writes = std::vector<int>(1024, 0);
  uint8_t read(uint16_t address) const { return bytes[address]; }
  bool ready() const { return true; }
  void write(uint16_t address, uint8_t byte) {
    bytes[address] = byte;
    ++writes[address];
  }
};

TEST(CounterStore, GrowsThroughResetsAtAnyInstantAndSpreadsTheWear) {
  std::mt19937 random(3);
  FakeEeprom eeprom;
  uint32_t safe = 0;  // the last value that was written to the end
  for (int start = 0; start < 3000; ++start) {
    CounterStore<FakeEeprom> store;
    const uint32_t found = store.load(eeprom);
    ASSERT_GE(found, safe);
    const auto next = static_cast<uint32_t>(found + 1 + random() % 1000);
    ASSERT_TRUE(store.save(next));
    EXPECT_FALSE(store.save(next + 1));
    const auto power = random() % 9;  // bytes until the supply fails; from seven on it does not
    bool done = false;
    for (unsigned k = 0; k < power && !done; ++k) done = store.work(eeprom);
    if (done) safe = next;
    if (!done && random() % 2 == 0) eeprom.bytes[random() % 768] &= static_cast<uint8_t>(random());
    // A record that the failing supply spoils is lost; the test knows then only what is still there.
    if (!done) safe = CounterStore<FakeEeprom>().load(eeprom);
  }
  EXPECT_LT(*std::max_element(eeprom.writes.begin(), eeprom.writes.end()), 3 * 3000 / kSlots);
}

TEST(CounterStore, ErasedAndZeroedMemoryHoldNothing) {
  FakeEeprom eeprom;
  EXPECT_EQ(CounterStore<FakeEeprom>().load(eeprom), 0U);
  eeprom.bytes.assign(1024, 0);
  EXPECT_EQ(CounterStore<FakeEeprom>().load(eeprom), 0U);
}

std::string text_of(std::array<uint16_t, kGloveFingers> flexion) {
  char text[kMaxGloveText];
  return {text, encode_gloves(flexion.data(), text)};
}

TEST(OpenGloves, WritesWhatTheDriverReads) {
  EXPECT_EQ(text_of({0, 1, 42, 1000, 1023}), "A0B1C42D1000E1023F512G512\n");
  EXPECT_EQ(text_of({65535, 0, 0, 0, 0}), "A1023B0C0D0E0F512G512\n");
}

TEST(OpenGloves, ReadsAsTheDriverDoes) {
  const auto parse = [](const std::string& text, GloveLine& line) {
    return parse_gloves(text.data(), static_cast<uint16_t>(text.size()), line);
  };
  GloveLine line{};
  EXPECT_EQ(parse("A5B6C7D8E9F512G512HJ(AB)300 x\r\n", line), GloveParse::ok);
  EXPECT_EQ(line.flexion[4], 9);
  EXPECT_EQ(parse("A5F512G512\n", line), GloveParse::ok);
  EXPECT_TRUE(line.has[0]);
  EXPECT_FALSE(line.has[1]);
  EXPECT_EQ(parse("A0B0C0D0E0\n", line), GloveParse::no_fingers);
  EXPECT_EQ(parse("A-5F512G512\n", line), GloveParse::no_digits);
  EXPECT_EQ(parse("A5BF512G512\n", line), GloveParse::no_digits);
  EXPECT_EQ(parse("A99999F512G512\n", line), GloveParse::too_large);
  EXPECT_EQ(parse("A5F512", line), GloveParse::no_end);
  EXPECT_EQ(parse("", line), GloveParse::no_end);
}

}  // namespace
}  // namespace flexor::link
