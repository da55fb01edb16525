#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <deque>
#include <fstream>
#include <functional>
#include <map>
#include <random>
#include <set>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "runtime/link/counter_store.hpp"
#include "runtime/link/gestures.hpp"
#include "runtime/link/glove_sender.hpp"
#include "runtime/link/hand_end.hpp"
#include "runtime/link/key_record.hpp"
#include "runtime/link/latency.hpp"
#include "runtime/link/opengloves.hpp"

namespace flexor::link {
namespace {

const Key kKey = {{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15}};

TEST(Crc16, HasTheCheckValueOfItsCatalogue) {
  const std::string text = "123456789";
  EXPECT_EQ(core::crc16(reinterpret_cast<const uint8_t*>(text.data()), 9), 0x31C3);
}

TEST(SipHash, HasTheReferencesVectors) {
  // Appendix A of the paper, and the first of the reference implementation.
  std::vector<uint8_t> message;
  EXPECT_EQ(siphash24(kKey, message.data(), 0), 0x726fdb47dd0e0e31ULL);
  for (uint8_t i = 0; i < 15; ++i) message.push_back(i);
  EXPECT_EQ(siphash24(kKey, message.data(), 15), 0xa129ca6149be45e5ULL);
  EXPECT_EQ(siphash24(kKey, message.data(), 8), 0x93f5f5799a932462ULL);
}

Session session_of(const Key& pair, const Nonce& nonce) {
  Session session;
  session.start(nonce);
  while (!session.ready()) session.derive(pair);
  return session;
}

std::vector<uint8_t> sealed(Packet& packet, Head head, uint8_t body_bytes, const Key* key) {
  std::vector<uint8_t> wire(kMaxWire);
  wire.resize(packet.seal(head, body_bytes, key, wire.data()));
  return wire;
}

// A line of golden.txt, field by field.
class Fields {
 public:
  explicit Fields(const std::string& line) : line_(line) {}

  std::string text() {
    std::string out;
    line_ >> out;
    return out;
  }
  template <class Number>
  Number number() {
    return static_cast<Number>(std::stol(text()));
  }
  std::vector<uint8_t> bytes() {
    const std::string hex = text();
    std::vector<uint8_t> out;
    for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
      out.push_back(static_cast<uint8_t>(std::stoi(hex.substr(i, 2), nullptr, 16)));
    return out;
  }
  // A key or a nonce; of "-" zeros.
  template <class Bytes>
  Bytes secret() {
    Bytes out{};
    std::ranges::copy(bytes(), out.bytes);
    return out;
  }
  // A list of "a,b" or "a/b,c/d".
  std::vector<std::vector<int>> table() {
    std::vector<std::vector<int>> out;
    std::istringstream rows(text());
    for (std::string row; std::getline(rows, row, ',');) {
      std::istringstream fields(row);
      out.emplace_back();
      for (std::string field; std::getline(fields, field, '/');) out.back().push_back(std::stoi(field));
    }
    return out;
  }
  // The last one is this frame.
  std::vector<uint8_t> expect_wire(Packet& packet, Head head, uint8_t body_bytes, const Key* key = nullptr) {
    const std::vector<uint8_t> wire = bytes();
    EXPECT_EQ(sealed(packet, head, body_bytes, key), wire);
    return wire;
  }

 private:
  std::istringstream line_;
};

void check_golden_angles(Fields& f) {
  const Key pair = f.secret<Key>();
  const bool guarded = !is_plain(pair);
  const Key key = session_of(pair, f.secret<Nonce>()).key();
  const auto counter = f.number<uint32_t>();
  const bool listens = f.number<int>() != 0;
  const auto time_ms = f.number<uint16_t>();
  std::vector<int16_t> angle;
  std::vector<SensorStatus> status;
  for (const auto& joint : f.table()) {
    angle.push_back(static_cast<int16_t>(joint[0]));
    status.push_back(static_cast<SensorStatus>(joint[1]));
  }
  const auto count = static_cast<uint8_t>(angle.size());
  Packet packet;
  const uint8_t bytes = put_angles(time_ms, angle.data(), status.data(), count, packet.body());
  PacketReader reader;
  Received last = Received::nothing;
  for (const uint8_t byte :
       f.expect_wire(packet, {Type::angles, false, listens, counter}, bytes, guarded ? &key : nullptr))
    last = reader.push(byte);
  EXPECT_EQ(last, Received::pending);
  EXPECT_EQ(reader.type(), Type::angles);
  EXPECT_EQ(reader.guarded(), guarded);
  EXPECT_EQ(reader.listens(), listens);
  ASSERT_EQ(joints_in(reader.body_bytes()), count);
  std::vector<int16_t> angle_again(angle.size());
  std::vector<SensorStatus> status_again(status.size());
  uint16_t time_again = 0;
  get_angles(reader.body(), count, time_again, angle_again.data(), status_again.data());
  EXPECT_EQ(time_again, time_ms);
  EXPECT_EQ(angle_again, angle);
  EXPECT_EQ(status_again, status);
  EXPECT_EQ(guarded && reader.fits(key, counter), guarded);
  EXPECT_FALSE(guarded && reader.fits(key, counter ^ 0x10000));
}

void check_golden_challenge(Fields& f) {
  const Key key = f.secret<Key>();
  Packet packet;
  std::ranges::copy(f.secret<Nonce>().bytes, packet.body());
  f.expect_wire(packet, {Type::challenge, false, false, 0}, kNonceBytes, &key);
}

void check_golden_readings(Fields& f) {
  auto time_ms = f.number<uint16_t>();
  std::vector<uint16_t> reading;
  for (const auto& row : f.table()) reading.push_back(static_cast<uint16_t>(row[0]));
  const auto sensors = static_cast<uint8_t>(reading.size());
  Packet packet;
  f.expect_wire(packet, {Type::readings, false, false, 0},
                put_readings(time_ms, reading.data(), sensors, packet.body()));
  std::vector<uint16_t> again(reading.size());
  get_readings(packet.body(), sensors, time_ms, again.data());
  EXPECT_EQ(again, reading);
}

void check_golden_telemetry(Fields& f) {
  const auto time_ms = f.number<uint16_t>();
  const auto faults = f.number<uint8_t>();
  std::vector<FingerTelemetry> finger;
  for (const auto& row : f.table())
    finger.push_back(
        {static_cast<int16_t>(row[0]), static_cast<int8_t>(row[1]), static_cast<uint8_t>(row[2])});
  const auto fingers = static_cast<uint8_t>(finger.size());
  Packet packet;
  const uint8_t bytes = put_telemetry(time_ms, faults, finger.data(), fingers, packet.body());
  EXPECT_EQ(bytes, telemetry_bytes(fingers));
  f.expect_wire(packet, {Type::telemetry, false, false, 0}, bytes);
  for (uint8_t i = 0; i < fingers; ++i) {
    const FingerTelemetry again = get_telemetry(packet.body(), i);
    EXPECT_EQ(again.angle, finger[i].angle);
    EXPECT_EQ(again.duty, finger[i].duty);
    EXPECT_EQ(again.fault, finger[i].fault);
  }
}

// Braces are evaluated in order.
void check_golden_state(Fields& f) {
  const State state{f.number<BoardKind>(), f.number<int>() != 0, f.number<int>() != 0, f.number<uint8_t>(),
                    f.number<uint8_t>(),   f.number<int8_t>(),   f.number<uint8_t>(),  f.number<uint16_t>()};
  Packet packet;
  const uint8_t bytes = put_state(state, packet.body());
  uint8_t again[State::kBytes];
  put_state(get_state(packet.body()), again);
  EXPECT_TRUE(std::ranges::equal(again, std::span(packet.body(), bytes)));
  f.expect_wire(packet, {Type::state, false, false, 0}, bytes);
}

void check_golden_request(Fields& f) {
  Packet packet;
  packet.body()[0] = f.number<uint8_t>();
  f.expect_wire(packet, {Type::request, false, false, 0}, 1);
}

void check_golden_piece(Fields& f) {
  const Key pair = f.secret<Key>();
  const Key key = session_of(pair, f.secret<Nonce>()).key();
  const auto counter = f.number<uint32_t>();
  Piece piece{f.number<uint16_t>(), f.number<uint16_t>(), 0, nullptr};
  const std::vector<uint8_t> data = f.bytes();
  piece.count = static_cast<uint8_t>(data.size());
  piece.bytes = data.data();
  Packet packet;
  f.expect_wire(packet, {Type::coefficients, false, false, counter}, put_piece(piece, packet.body()), &key);
}

void check_golden_offer(Fields& f) {
  Offer offer{f.secret<Nonce>(), f.number<uint16_t>(), f.number<uint8_t>(), f.number<uint16_t>(), {}};
  const auto crcs = f.table();
  for (std::size_t i = 0; i < kFingers; ++i) offer.calibration[i] = static_cast<uint16_t>(crcs.at(i).at(0));
  Packet packet;
  f.expect_wire(packet, {Type::coefficients, false, false, 0}, put_offer(offer, packet.body()));
}

void check_golden_receipt(Fields& f) {
  const Receipt receipt{f.number<uint16_t>(), f.number<uint8_t>()};
  Packet packet;
  f.expect_wire(packet, {Type::coefficients, false, false, 0}, put_receipt(receipt, packet.body()));
}

TEST(Link, SpeaksTheGoldenVectors) {
  using Check = void (*)(Fields&);
  const std::map<std::string, Check> checks = {
      {"angles", check_golden_angles},     {"challenge", check_golden_challenge},
      {"readings", check_golden_readings}, {"telemetry", check_golden_telemetry},
      {"state", check_golden_state},       {"request", check_golden_request},
      {"piece", check_golden_piece},       {"offer", check_golden_offer},
      {"receipt", check_golden_receipt}};
  std::ifstream file(std::string(FLEXOR_SOURCE_DIR) + "/runtime/link/golden.txt");
  std::set<std::string> seen;
  for (std::string line; std::getline(file, line);) {
    SCOPED_TRACE(line);
    Fields fields(line);
    const std::string what = fields.text();
    if (what == "#") continue;
    seen.insert(what);
    ASSERT_TRUE(checks.contains(what));
    checks.at(what)(fields);
  }
  EXPECT_EQ(seen.size(), checks.size());
}

TEST(Link, AFrameIsAsLongAsTheProtocolStates) {
  EXPECT_EQ(wire_bytes(angles_bytes(5), true), 24);
  EXPECT_EQ(wire_bytes(angles_bytes(5), false), 18);
  EXPECT_EQ(wire_bytes(kNonceBytes, true), 21);
  for (uint8_t joints = 1; joints <= kMaxJoints; ++joints) EXPECT_EQ(joints_in(angles_bytes(joints)), joints);
  for (const int bytes : {0, 1, 2, 3, 5, 7, 10, 12, 14, 40})
    EXPECT_EQ(joints_in(static_cast<uint8_t>(bytes)), 0);
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

const Nonce kNonce = {{1, 2, 3, 4, 5, 6, 7, 8}};

// What a glove sends that was challenged with kNonce.
std::vector<uint8_t> wire_of(const Frame& frame, const Key* pair, const Nonce& nonce = kNonce) {
  const Key key = pair != nullptr ? session_of(*pair, nonce).key() : Key{};
  std::vector<uint8_t> wire(kMaxWire);
  wire.resize(encode(frame, false, pair != nullptr ? &key : nullptr, wire.data()));
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

TEST(Link, RefusesReplayedReorderedForgedAndForeignFrames) {
  Receiver receiver(&kKey);
  EXPECT_EQ(feed(receiver, wire_of(frame_number(0), &kKey)), Received::not_trusted) << "never challenged";
  receiver.challenge(kNonce);
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
  EXPECT_EQ(receiver.statistics().not_trusted, 5U);
  EXPECT_EQ(receiver.statistics().lost, 1U);
  EXPECT_EQ(receiver.statistics().received, 2U);
}

TEST(Link, BelievesNothingFromBeforeAChallenge) {
  Receiver receiver(&kKey);
  receiver.challenge(kNonce);
  EXPECT_EQ(feed(receiver, wire_of(frame_number(5), &kKey)), Received::frame);
  const Nonce later = {{2, 2, 3, 4, 5, 6, 7, 8}};
  receiver.challenge(later);
  EXPECT_FALSE(receiver.answered());
  for (uint32_t counter = 0; counter < 200; ++counter)
    EXPECT_EQ(feed(receiver, wire_of(frame_number(counter), &kKey)), Received::not_trusted);
  EXPECT_EQ(feed(receiver, wire_of(frame_number(0), &kKey, later)), Received::frame);
}

TEST(Link, CountsOnThroughTheHalfThatTravelsAndNoFurtherThanAChallengeIsGood) {
  Receiver receiver(&kKey);
  receiver.challenge(kNonce);
  for (const uint32_t counter : {0U, 40000U, 65535U, 65536U, 131071U, 140000U, 200000U})
    EXPECT_EQ(feed(receiver, wire_of(frame_number(counter), &kKey)), Received::frame) << counter;
  EXPECT_EQ(receiver.frame().counter, 200000U);
  for (uint32_t counter = 230000; counter < kCounters; counter += 65000)
    ASSERT_EQ(feed(receiver, wire_of(frame_number(counter), &kKey)), Received::frame) << counter;
  EXPECT_EQ(feed(receiver, wire_of(frame_number(kCounters - 1), &kKey)), Received::frame);
  EXPECT_EQ(feed(receiver, wire_of(frame_number(0), &kKey)), Received::not_trusted);
}

TEST(Link, WithoutAKeyNobodyCanShutTheRightSenderOut) {
  Receiver receiver(nullptr);
  EXPECT_EQ(feed(receiver, wire_of(frame_number(60000), nullptr)), Received::frame) << "a wrong sender";
  for (uint32_t counter = 5; counter < 9; ++counter)
    EXPECT_EQ(feed(receiver, wire_of(frame_number(counter), nullptr)), Received::frame);
  EXPECT_EQ(feed(receiver, wire_of(frame_number(9), &kKey)), Received::not_trusted) << "it cannot be checked";
  EXPECT_FALSE(receiver.packet().type() == Type::angles && !receiver.packet().guarded())
      << "a frame shows whether it has a guard";
}

TEST(Link, ComputesAtMostOneTagACall) {
  // Without the session's key: two halves of it and a tag.
  Receiver receiver(&kKey);
  receiver.challenge(kNonce);
  Key other = kKey;
  other.bytes[0] ^= 1;
  const auto calls = [&](const std::vector<uint8_t>& wire) {
    Received result = Received::nothing;
    for (const uint8_t byte : wire) result = receiver.push(byte);
    int count = 0;
    for (; result == Received::pending; ++count) result = receiver.verify();
    EXPECT_EQ(result, Received::not_trusted);
    return count;
  };
  EXPECT_EQ(calls(wire_of(frame_number(9), &other)), 3);
  EXPECT_EQ(calls(wire_of(frame_number(9), &other)), 1);
}

// Twenty million corrupted frames: one to four flipped bits and at times a lost byte; good ones in between.
TEST(LinkRecovery, NoCorruptedFrameIsAcceptedAndTheNextGoodOneIs) {
  std::mt19937 random(5);
  Receiver receiver(&kKey);
  receiver.challenge(kNonce);
  uint32_t counter = 1;
  auto good = wire_of(frame_number(counter), &kKey);
  int accepted = 0;
  constexpr int kFrames = 20'000'000;
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

// A way between two UARTs: begin of a frame in ms, in order. Delays and losses are of frames.
class Way {
 public:
  double bytes_per_ms = 1;
  double delay_ms = 0;
  double jitter_ms = 0;  // 0 to so much more
  double loss = 0;

  void send(int now_ms, const uint8_t* wire, uint8_t bytes) {
    std::uniform_real_distribution<double> share(0, 1);
    const double way_ms = delay_ms + jitter_ms * share(random_);
    if (share(random_) < loss) return;
    const double byte_ms = 1 / bytes_per_ms;
    for (uint8_t i = 0; i < bytes; ++i) {
      last_ms_ = std::max(last_ms_ + byte_ms, now_ms + way_ms + i * byte_ms);
      bytes_.emplace_back(last_ms_, wire[i]);
    }
  }
  template <class Take>
  void pass(int now_ms, Take take) {
    for (; !bytes_.empty() && bytes_.front().first <= now_ms; bytes_.pop_front()) take(bytes_.front().second);
  }

 private:
  std::mt19937 random_{7};
  std::deque<std::pair<double, uint8_t>> bytes_;  // arrival and byte
  double last_ms_ = -1;
};

// Both ends and the air between them, a millisecond at a time: a byte a millisecond, no collisions.
template <int kHz>
class AirAt {
 public:
  explicit AirAt(const Key* hand_key, const Key* glove_key) : hand(hand_key), glove(glove_of(glove_key)) {
    hand.start(1);
  }

  std::function<bool(int frame)> jams;  // the glove's frame of this number
  int period_ms = 1000 / kHz;
  uint16_t noise = 0;  // of the hand's converter

  void restart_hand(uint32_t starts) {
    hand = HandEnd(hand.receiver().pair());
    hand.start(starts);
  }
  void restart_glove() { glove = glove_of(glove.end().pair()); }

  void step() {
    hand.tick();
    hand.stir(noise);
    if (now % period_ms == 0) {
      Frame frame = frame_number(0);
      frame.time_ms = static_cast<uint16_t>(now);
      const uint16_t counts[kFingers] = {};
      glove.send_frame(frame, counts, *this);
    }
    if (const auto message = hand.due(); message != HandEnd::Message::none) {
      uint8_t wire[kMaxWire];
      Packet packet;
      const uint8_t bytes = telemetry_bytes(kFingers);
      to_glove.send(now, wire,
                    message == HandEnd::Message::challenge ? hand.challenge(wire)
                                                           : hand.seal(Type::telemetry, packet, bytes, wire));
    }
    to_hand.pass(now, [&](uint8_t byte) { receive(byte); });
    to_glove.pass(now, [&](uint8_t byte) { push_to_glove(&byte, 1); });
    ++now;
  }
  // Milliseconds until the next frame is believed; -1: not within the limit.
  int until_accepted(int limit_ms) {
    const int before = accepted;
    for (int k = 0; k < limit_ms; ++k) {
      step();
      if (accepted > before) return k;
    }
    return -1;
  }
  void run(int ms) {
    for (int k = 0; k < ms; ++k) step();
  }
  void replay(const std::vector<uint8_t>& wire) {
    for (const uint8_t byte : wire) receive(byte);
  }
  void push_to_glove(const uint8_t* wire, std::size_t bytes) {
    NoModels models;
    for (std::size_t i = 0; i < bytes; ++i) glove.push(wire[i], models);
  }
  // The newest believed frame is not older than a hand follows for.
  bool follows() const { return accepted > 0 && now - last_accepted_ms <= 250; }

  // Of the glove's board.
  static uint8_t reset_cause() { return 0; }
  static uint32_t uptime_s() { return 0; }
  void send(Type type, const uint8_t* wire, uint8_t bytes) {
    if (type == Type::angles) {
      recorded.emplace_back(wire, wire + bytes);
      if (jams && jams(frames++)) return;
    }
    to_hand.send(now, wire, bytes);
  }

  HandEnd hand;
  static GloveSender glove_of(const Key* key) { return {key, {1, 1, 0}, kHz, true}; }

  GloveSender glove;
  Way to_hand;
  Way to_glove;
  std::vector<std::vector<uint8_t>> recorded;  // the glove's frames, jammed ones too
  int accepted = 0;
  int last_accepted_ms = 0;
  int now = 0;
  int frames = 0;

 private:
  void receive(uint8_t byte) {
    Received result = hand.push(byte);
    while (result == Received::pending) result = hand.verify();
    if (result != Received::frame) return;
    ++accepted;
    last_accepted_ms = now;
  }
};
using Air = AirAt<20>;

TEST(Freshness, ComesAboutAfterAnyStart) {
  Air air(&kKey, &kKey);
  EXPECT_LT(air.until_accepted(2000), 400);
  for (int k = 0; k < 300; ++k) {
    air.run(1 + k * 37 % 700);
    if (k % 3 != 0) air.restart_glove();
    if (k % 3 != 1) air.restart_hand(static_cast<uint32_t>(k + 2));
    EXPECT_NE(air.until_accepted(1000), -1) << k;
  }
}

// The glove keeps nothing; the hand has forgotten how often it started, or its count is at its end.
TEST(Freshness, DoesNotDependOnWhatEitherEndRemembers) {
  Air air(&kKey, &kKey);
  EXPECT_NE(air.until_accepted(1000), -1);
  air.restart_glove();
  EXPECT_NE(air.until_accepted(1000), -1);
  air.restart_hand(0xffffff);  // the last count that a nonce holds
  EXPECT_NE(air.until_accepted(31'000), -1)
      << "before this one's by half the circle: the session settles first";
  for (const uint32_t starts : {0x1000000U, 0xfffeU, 0xfffffffeU, 0xffffffffU, 0U}) {
    air.restart_hand(starts);
    EXPECT_NE(air.until_accepted(31'000), -1) << starts;
  }
  air.noise = 77;
  air.restart_hand(1);  // erased
  EXPECT_NE(air.until_accepted(31'000), -1);
}

struct InTouch {
  double stands;   // share of the time in which the session stands
  double follows;  // and in which a frame is new enough to be followed
};
// Two minutes over a radio that delays by one_way_ms, up to half more, and loses a tenth of the frames.
template <int kHz>
InTouch in_touch_at(double one_way_ms, const Key* key) {
  constexpr int kLong_ms = 120'000;
  AirAt<kHz> air(key, key);
  std::mt19937 random(3);
  for (Way* way : {&air.to_hand, &air.to_glove}) {
    way->bytes_per_ms = 2;
    way->delay_ms = one_way_ms;
    way->jitter_ms = one_way_ms / 2;
    way->loss = 0.1;
  }
  InTouch out = {0, 0};
  for (int k = 0; k < kLong_ms; ++k) {
    air.noise = static_cast<uint16_t>(random());
    air.step();
    out.stands += air.hand.in_touch() ? 1. / kLong_ms : 0;
    out.follows += air.follows() ? 1. / kLong_ms : 0;
  }
  return out;
}

template <int kHz>
void check_slow_radios() {
  for (const int one_way_ms : {0, 20, 70, 140, 200, 300, 400, 500}) {
    const InTouch guarded = in_touch_at<kHz>(one_way_ms, &kKey);
    const InTouch plain = in_touch_at<kHz>(one_way_ms, nullptr);
    std::printf("%d Hz, %d ms one way: in touch for %.1f %%, followed for %.1f %%, without a key %.1f %%\n",
                kHz, one_way_ms, 100 * guarded.stands, 100 * guarded.follows, 100 * plain.follows);
    EXPECT_GE(guarded.stands, 0.95) << kHz << " Hz, " << one_way_ms << " ms";
    EXPECT_GE(guarded.follows, 0.95) << kHz << " Hz, " << one_way_ms << " ms";
  }
}

TEST(Freshness, ASlowRadioIsNoOutage) {
  check_slow_radios<10>();
  check_slow_radios<20>();
  check_slow_radios<50>();
}

TEST(Freshness, NothingRecordedIsBelievedAfterAStartOrAnOutage) {
  Air air(&kKey, &kKey);
  air.run(5000);
  EXPECT_GT(air.accepted, 80);
  air.jams = [](int) { return true; };
  air.run(2250);  // the hand receives nothing, somebody else does
  air.period_ms = 1 << 30;
  const auto recorded = air.recorded;
  EXPECT_GT(recorded.size(), 130U);
  const int sound = air.accepted;
  for (const auto& wire : recorded) air.replay(wire);
  EXPECT_LE(air.accepted, sound + 64) << "answers to a challenge of this very second";
  EXPECT_GT(air.accepted, sound) << "that there are any is what the next lines are about";
  air.run(kOutage_ms + 10);
  const int late = air.accepted;
  for (const auto& wire : recorded) air.replay(wire);
  EXPECT_EQ(air.accepted, late);
  air.restart_hand(2);
  for (const auto& wire : recorded) air.replay(wire);
  EXPECT_EQ(air.accepted, late);
}

// Jams them all and hands on one now and then, so that the hand never misses the glove: what is left when the glove is
// switched off is as late as a frame may be.
TEST(Freshness, FramesThatAreHeldBackDoNotPileUp) {
  for (const int every_ms : {60, 200, 450}) {
    Air air(&kKey, &kKey);
    air.period_ms = 25;
    air.run(2000);
    air.jams = [](int) { return true; };
    std::size_t handed_on = air.recorded.size();
    for (int k = 0; k < 60'000; ++k) {
      air.step();
      if (k % every_ms == 0 && handed_on < air.recorded.size()) air.replay(air.recorded[handed_on++]);
    }
    air.period_ms = 1 << 30;
    const int sound = air.accepted;
    for (int k = 0; k < 600'000 && handed_on < air.recorded.size(); ++k) {
      air.step();
      if (k % every_ms == 0) air.replay(air.recorded[handed_on++]);
    }
    EXPECT_LE(air.accepted, sound + 64) << every_ms;
  }
}

// Somebody receives every frame, jams it, and hands each `nth` on `first_ms` later from the session's start on, then slowly up to
// `more_ms` later still. Then the glove is switched off: how many that it has sent before are believed.
int believed_of_the_past(int period_ms, std::size_t nth, int first_ms, int more_ms) {
  constexpr int kMore_ms = 2000;
  constexpr int kOff_ms = 5000;
  Air air(&kKey, &kKey);
  air.period_ms = period_ms;
  air.jams = [](int) { return true; };
  std::vector<int> sent_ms;
  std::size_t handed_on = 0;
  while (air.now < kOff_ms) {
    air.step();
    sent_ms.resize(air.recorded.size(), air.now);
    const int held_ms = first_ms + std::clamp((air.now - kMore_ms) / 2, 0, more_ms);
    for (; handed_on < sent_ms.size() && sent_ms[handed_on] <= air.now - held_ms; ++handed_on) {
      if (handed_on % nth == 0) air.replay(air.recorded[handed_on]);
    }
  }
  const int sound = air.accepted;
  while (handed_on < air.recorded.size()) air.replay(air.recorded[handed_on++]);
  return air.accepted - sound;
}

TEST(Freshness, NoMoreThanThreeSecondsOfThePastAreBelievedNor128Frames) {
  for (const int period_ms : {10, 20, 25, 50, 100}) {
    int most = 0;
    for (const std::size_t nth : {1U, 3U}) {
      for (int first_ms = 0; first_ms <= 2000; first_ms += 80) {
        for (int more_ms = 0; more_ms <= 1100; more_ms += 40)
          most = std::max(most, believed_of_the_past(period_ms, nth, first_ms, more_ms));
      }
    }
    std::printf("a frame each %d ms: %d of the past are believed at most\n", period_ms, most);
    EXPECT_LE(most, std::min(128, (kNonce_ms + kLate_ms) / period_ms + 2)) << period_ms;
    EXPECT_GE(most, std::min(50, 1000 / period_ms)) << "what a radio that is slow may do";
  }
}

// It outlives the answer to its last challenge: else the glove's next turn would be the first that helps. And a channel in
// which the hand never finds a gap does not keep it alive.
TEST(Freshness, ANonceIsGoodForTwoSecondsWhateverIsOnTheAirAndForEachAnswer) {
  HandEnd hand(&kKey);
  hand.start(1);
  Nonce nonce{};
  int drawn_ms = 0;
  int given_ms = -kChallenge_ms;
  uint8_t wire[kMaxWire];
  for (int now = 0; now < 120'000; ++now) {
    hand.tick();
    hand.stir(static_cast<uint16_t>(now * now));
    if (now > 60'000) (void)hand.push(1);
    const bool challenges = hand.due() == HandEnd::Message::challenge;
    if (!(hand.receiver().session().nonce() == nonce)) {
      ASSERT_TRUE(challenges || now >= given_ms + kChallenge_ms) << now;
      nonce = hand.receiver().session().nonce();
      drawn_ms = now;
    }
    ASSERT_LE(now - drawn_ms, kNonce_ms);
    if (!challenges) continue;
    (void)hand.challenge(wire);
    given_ms = now;
  }
  EXPECT_LT(given_ms, 60'002);
}

// What an erased hand gives first is no number that another start gave.
TEST(Freshness, AnErasedHandsFirstNonceHasNoiseInIt) {
  std::set<std::vector<uint8_t>> seen;
  for (uint16_t noise = 1; noise <= 20; ++noise) {
    HandEnd hand(&kKey);
    hand.start(1);
    EXPECT_EQ(hand.due(), HandEnd::Message::none) << "nothing is drawn yet";
    for (int k = 0; k < 100 && hand.due() != HandEnd::Message::challenge; ++k) {
      hand.tick();
      hand.stir(k == 5 ? noise : 0);
    }
    const Nonce nonce = hand.receiver().session().nonce();
    seen.emplace(nonce.bytes, nonce.bytes + kNonceBytes);
  }
  EXPECT_EQ(seen.size(), 20U);
}

using Wire = std::vector<uint8_t>;

std::vector<Wire> taped_challenges(int count) {
  HandEnd old(&kKey);
  old.start(0);
  for (int k = 0; k < kStirred; ++k) old.stir(0);
  std::vector<Wire> out;
  for (int k = 0; k < count; ++k) {
    Wire wire(kMaxWire);
    wire.resize(old.challenge(wire.data()));
    out.push_back(wire);
    for (int ms = 0; ms <= kNonce_ms; ++ms) old.tick();
  }
  return out;
}

// What anybody can make: requests, a challenge of another pair, and the begin of a frame that does not end.
std::vector<Wire> forgeries() {
  std::vector<Wire> out = {{1}};
  for (const Request request : {Request::state, Request::readings, Request::coefficients}) {
    Packet packet;
    packet.body()[0] = static_cast<uint8_t>(request);
    out.push_back(sealed(packet, {Type::request, false, false, 0}, 1, nullptr));
  }
  Key other = kKey;
  other.bytes[3] ^= 8;
  Packet packet;
  std::ranges::fill_n(packet.body(), kNonceBytes, uint8_t{9});
  out.push_back(sealed(packet, {Type::challenge, false, false, 0}, kNonceBytes, &other));
  return out;
}

// Share of 60 s for which the hand follows, while somebody plays these to the glove by turns, a byte each millisecond.
template <int kHz>
double followed_while_played(const std::vector<Wire>& wires, int every_ms) {
  constexpr int kLong_ms = 60'000;
  AirAt<kHz> air(&kKey, &kKey);
  std::mt19937 random(3);
  air.run(1000);
  int out = 0;
  for (int k = 0; k < kLong_ms; ++k) {
    const Wire& wire = wires[static_cast<std::size_t>(k / every_ms) % wires.size()];
    const auto at = static_cast<std::size_t>(k % every_ms);
    if (at < wire.size()) air.push_to_glove(&wire[at], 1);
    air.noise = static_cast<uint16_t>(random());
    air.step();
    out += air.follows();
  }
  return static_cast<double>(out) / kLong_ms;
}

double least_followed(const std::vector<Wire>& wires, int from_ms, int to_ms) {
  double least = 1;
  for (int every_ms = from_ms; every_ms <= to_ms; every_ms += every_ms < 120 ? 1 : 20)
    least = std::min(
        {least, followed_while_played<10>(wires, every_ms), followed_while_played<20>(wires, every_ms)});
  std::printf("%zu by turns every %d to %d ms: followed for %.1f %% at least\n", wires.size(), from_ms, to_ms,
              100 * least);
  return least;
}

// A challenge takes 21 ms on the air: where about as much is left between two of them neither telemetry nor the hand's
// challenge gets through. That is jamming.
TEST(Freshness, TapedChallengesEndNoSessionHoweverManyAndHoweverOften) {
  for (const int count : {1, 2, 3, 8})
    EXPECT_GE(least_followed(taped_challenges(count), 60, 2000), 0.95) << count;
  EXPECT_LT(least_followed(taped_challenges(1), 25, 43), 0.9) << "jamming";
}

// Of somebody on the hand's side, while the glove is silent.
TEST(Freshness, AByteInTheGapSpoilsNoFrame) {
  for (const uint8_t byte : {uint8_t{1}, uint8_t{5}, uint8_t{255}}) {
    Air air(&kKey, &kKey);
    air.run(1000);
    const int before = air.accepted;
    for (int k = 0; k < 400; ++k) {
      air.run(air.period_ms);
      air.replay({byte});
    }
    EXPECT_GE(air.accepted - before, 390) << int{byte};
  }
}

TEST(GloveSender, ReadingsHaveOneSlotInTenWhereTheyDoNotFitBesideAngles) {
  EXPECT_TRUE(has_room(9600, 20));
  EXPECT_FALSE(has_room(9600, 25));
  EXPECT_FALSE(has_room(19200, 50));
  EXPECT_TRUE(has_room(115200, 100));
}

TEST(Freshness, NothingThatAnybodyCanMakeTakesAnglesPlace) {
  std::vector<Wire> all = forgeries();
  for (const Wire& wire : all) EXPECT_GE(least_followed({wire}, 10, 1000), 0.99) << wire.size();
  EXPECT_GE(least_followed(all, 10, 1000), 0.99);
  std::ranges::copy(taped_challenges(3), std::back_inserter(all));
  EXPECT_GE(least_followed(all, 60, 1000), 0.95);
}

// An older count than that of the present session: of a hand whose memory was erased, or of a computer.
TEST(Freshness, AnOlderCountIsAnsweredOnceTheHandIsSilent) {
  Air air(&kKey, &kKey);
  air.run(60'000);
  const Wire other = taped_challenges(1).front();
  air.push_to_glove(other.data(), other.size());
  EXPECT_LT(air.until_accepted(100), 60);
  air.to_glove.loss = 1;
  air.run(31'000);
  air.push_to_glove(other.data(), other.size());
  air.run(100);
  EXPECT_EQ(air.until_accepted(1000), -1) << "the session is the other's";
}

TEST(Freshness, AGloveThatHasUsedUpItsCountersIsChallengedAgain) {
  Air air(&kKey, &kKey);
  air.run(1000);
  Frame frame{};
  uint8_t wire[kMaxWire];
  for (uint32_t k = 0; air.glove.end().in_touch(); ++k) {
    ASSERT_LE(k, kCounters);
    const uint8_t bytes = air.glove.end().angles(frame, false, wire);
    if (k % 60000 != 0) continue;  // at least one in 65536 must come
    air.replay({wire, wire + bytes});
  }
  air.run(1000);
  EXPECT_NE(air.until_accepted(1000), -1);
}

TEST(Freshness, NoncesAreNotGivenTwice) {
  std::set<std::string> seen;
  NonceSource source;
  const auto draw = [&](uint32_t start, int count) {
    source = {};
    source.start(start);
    for (int k = 0; k < count; ++k) {
      const Nonce nonce = source.next();
      EXPECT_TRUE(seen.emplace(reinterpret_cast<const char*>(nonce.bytes), kNonceBytes).second);
    }
  };
  for (uint32_t start = 0; start < 100; ++start) draw(start, 200);
  draw(200, 1000);
  EXPECT_EQ(source.starts(), 203U) << "to be kept again every 256 challenges";
}

TEST(Latency, ReportsHowMuchLaterThanTheQuickestAcrossWrapsAndDrift) {
  Latency latency;
  for (int k = 0; k < 20000; ++k) {
    const auto sent = static_cast<uint16_t>(50 * k);
    // The receiver's clock gains 20 ppm: a millisecond in 1000 frames.
    const auto now = static_cast<uint16_t>(50 * k + 12345 + 30 + k / 1000 + (k % 7 == 3 ? 8 : 0));
    const uint16_t late = latency.add(now, sent);
    if (k < 7) continue;
    EXPECT_NEAR(late, k % 7 == 3 ? 8 : 0, 1) << k;
  }
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

GloveLine parsed(const std::string& text, GloveParse expected) {
  GloveLine line{};
  EXPECT_EQ(parse_gloves(text.data(), static_cast<uint16_t>(text.size()), line), expected) << text;
  return line;
}

std::string text_of(const GloveValues& values, const std::vector<GloveJoint>& joints = {}) {
  char text[kMaxGloveText + 20 * kMaxJointText];
  return {text, encode_gloves(values, joints.data(), static_cast<uint8_t>(joints.size()), text)};
}

TEST(OpenGloves, WritesWhatTheDriverReads) {
  EXPECT_EQ(text_of({{0, 1, 42, 1000, 1023}, {512, 512}, 0, 0}), "A0B1C42D1000E1023F512G512P0\n");
  EXPECT_EQ(text_of({{65535, 0, 0, 0, 0}, {0, 65535}, 65535, 0}), "A1023B0C0D0E0F0G1023P1023\n");
  const uint8_t two = glove_button::kJoystick | glove_button::kCalibrate;
  EXPECT_EQ(text_of({{1, 2, 3, 4, 5}, {6, 7}, 8, two}), "A1B2C3D4E5F6G7P8HO\n");
  EXPECT_EQ(text_of({{0, 0, 0, 0, 0}, {512, 512}, 9, 0x7e}), "A0B0C0D0E0F512G512P9IJKLMN\n");
  EXPECT_EQ(text_of({{1, 2, 3, 4, 5}, {6, 7}, 8, glove_button::kGrab}, {{1, 1, 300}, {4, 3, 1023}}),
            "A1B2C3D4E5F6G7P8L(BAB)300(EAD)1023\n");
}

TEST(OpenGloves, TheLongestLinesFillTheirRoom) {
  const GloveValues most = {{1023, 1023, 1023, 1023, 1023}, {1023, 1023}, 1023, 0xff};
  EXPECT_EQ(text_of(most).size(), kMaxGloveText);
  EXPECT_EQ(text_of(most, std::vector<GloveJoint>(20, {0, 0, 1023})).size(),
            kMaxGloveText + 20U * kMaxJointText);
  char text[kMaxInformationText];
  EXPECT_EQ(encode_glove_information(1023, true, text), kMaxInformationText);
}

TEST(OpenGloves, ReadsAsTheDriverDoes) {
  GloveLine line = parsed("A5B6C7D8E9F512G512P3HJ(AB)300(CAB)44(QQ)7Q8 x\r\n", GloveParse::ok);
  EXPECT_EQ(line.values.flexion[4], 9);
  EXPECT_EQ(line.values.joystick[1], 512);
  EXPECT_EQ(line.values.trigger, 3);
  EXPECT_EQ(line.values.buttons, glove_button::kJoystick | glove_button::kA);
  EXPECT_TRUE(line.has_joint[2][1]);
  EXPECT_EQ(line.joint[2][1], 44);
  EXPECT_FALSE(line.has_joint[0][1]);
  line = parsed("A5F512G512A6\n", GloveParse::ok);
  EXPECT_EQ(line.values.flexion[0], 6) << "the last one counts";
  EXPECT_FALSE(line.has[1]);
  parsed("A0B0C0D0E0\n", GloveParse::no_fingers);
  parsed("A-5F512G512\n", GloveParse::no_digits);
  parsed("A5BF512G512\n", GloveParse::no_digits);
  parsed("A5F512G512(AB)\n", GloveParse::no_digits);
  EXPECT_EQ(parsed("A5F512(AB)G512\n", GloveParse::ok).values.joystick[1], 0) << "G is part of the long key";
  parsed("A99999F512G512\n", GloveParse::too_large);
  parsed("A5F512", GloveParse::no_end);
  parsed("", GloveParse::no_end);
}

TEST(OpenGloves, ReportsWhichHandItIs) {
  char text[kMaxInformationText];
  const std::string left(text, encode_glove_information(1, false, text));
  EXPECT_EQ(left, "Z(ZV)1(ZG)0(ZH)0\n");
  EXPECT_EQ(parsed(left, GloveParse::information).version, 1)
      << "no zeros alone: that is empty to the driver";
  const std::string right(text, encode_glove_information(42, true, text));
  EXPECT_EQ(right, "Z(ZV)42(ZG)0(ZH)1\n");
  EXPECT_EQ(parsed(right, GloveParse::information).hand, 1);
}

uint8_t after(Gestures& gestures, std::array<uint16_t, kGloveFingers> flexion, uint8_t fingers = 0x1f) {
  return gestures.step(flexion.data(), fingers);
}

TEST(Gestures, AreMadeByTheirFingers) {
  const auto made = [](std::array<uint16_t, kGloveFingers> flexion) {
    Gestures gestures;
    return after(gestures, flexion);
  };
  EXPECT_EQ(made({0, 0, 0, 0, 0}), 0);
  EXPECT_EQ(made({1023, 0, 0, 0, 0}), 0);
  EXPECT_EQ(made({1023, 1023, 0, 0, 0}), glove_button::kPinch | glove_button::kTrigger);
  EXPECT_EQ(made({0, 1023, 0, 0, 0}), glove_button::kTrigger) << "the mean of thumb and index is below";
  EXPECT_EQ(made({0, 0, 1023, 1023, 1023}), glove_button::kGrab);
  EXPECT_EQ(made({1023, 1023, 1023, 1023, 1023}),
            glove_button::kGrab | glove_button::kPinch | glove_button::kTrigger);
}

TEST(Gestures, HoldBetweenTheirTwoThresholds) {
  Gestures gestures;
  const auto trigger = [&](uint16_t index) { return after(gestures, {0, index, 0, 0, 0}) != 0; };
  EXPECT_FALSE(trigger(kGestureOn - 1));
  EXPECT_TRUE(trigger(kGestureOn));
  EXPECT_TRUE(trigger(kGestureOff));
  EXPECT_FALSE(trigger(kGestureOff - 1));
  EXPECT_FALSE(trigger(kGestureOn - 1));
}

TEST(Gestures, WithoutTheirFingersAreNeverMade) {
  Gestures no_thumb;
  EXPECT_EQ(after(no_thumb, {1023, 1023, 1023, 1023, 1023}, 0x1e),
            glove_button::kGrab | glove_button::kTrigger);
  Gestures two;  // index and middle: grab is theirs
  EXPECT_EQ(after(two, {0, 1023, 1023, 0, 0}, 0x06), glove_button::kGrab | glove_button::kTrigger);
  Gestures thumb;
  EXPECT_EQ(after(thumb, {1023, 1023, 1023, 1023, 1023}, 0x01), 0);
}

TEST(Gestures, TheTriggersPullGrowsOverTheUpperHalf) {
  EXPECT_EQ(trigger_pull(0), 0);
  EXPECT_EQ(trigger_pull(511), 0);
  EXPECT_EQ(trigger_pull(512), 1);
  EXPECT_EQ(trigger_pull(1023), 1023);
}

// On the firmware and in the Arduino library alike.
TEST(GloveTurns, TheHandGetsItsTurnRarelyWhileItIsReceivedAndOftenWhileNot) {
  const auto turns_in = [](GloveTurns& turns, int slots) {
    int out = 0;
    for (int k = 0; k < slots; ++k) out += turns.take_slot(false) && turns.listens(false) ? 1 : 0;
    return out;
  };
  GloveTurns turns({10, 3, 2});
  EXPECT_TRUE(turns.take_slot(false));
  EXPECT_TRUE(turns.listens(false)) << "the first thing of all";
  EXPECT_FALSE(turns.take_slot(false));
  EXPECT_FALSE(turns.take_slot(false));
  EXPECT_EQ(turns_in(turns, 101), 20) << "each third frame, two slots after it";
  turns.received();
  EXPECT_EQ(turns_in(turns, 12), 1);
  EXPECT_LE(turns_in(turns, 12), 2);
  EXPECT_EQ(turns_in(turns, 100), 20) << "received no more";
  turns.favour(4);
  EXPECT_EQ(turns_in(turns, 12), 4) << "a turn after each frame";
}

TEST(GloveTurns, AFrameThatIsComingIsAwaitedAndRubbishIsNot) {
  GloveTurns turns({10, 3, 2});
  for (int k = 0; k < 9; ++k) {
    turns.byte();
    EXPECT_EQ(turns.take_slot(true), k % 3 == 2) << "two slots are left out at most";
  }
  EXPECT_TRUE(turns.take_slot(true)) << "nothing came since";
}

}  // namespace
}  // namespace flexor::link
