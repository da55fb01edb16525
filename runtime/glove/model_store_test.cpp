// The model in EEPROM: power that is lost in any byte of a swap leaves the old or the new one.
#include "runtime/glove/model_store.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <vector>

#include "runtime/glove/data_model.hpp"
#include "runtime/glove/model_receiver.hpp"

namespace flexor::glove {
namespace {

using Bytes = std::vector<std::uint8_t>;

struct NoPower {};

// Loses power in its n-th write, which leaves any byte there.
class Eeprom {
 public:
  std::array<std::uint8_t, kStoreEnd> bytes;
  int writes = 0;
  int lost_at = -1;
  std::uint8_t garbage = 0;

  Eeprom() { bytes.fill(0xff); }
  std::uint8_t read(std::uint16_t address) const { return bytes.at(address); }
  bool ready() const { return true; }
  void write(std::uint16_t address, std::uint8_t byte) {
    EXPECT_GE(address, kStoreBegin);
    if (writes++ == lost_at) {
      bytes.at(address) = garbage;
      throw NoPower();
    }
    bytes.at(address) = byte;
  }
};

Bytes random_bytes(std::size_t size, unsigned seed) {
  std::mt19937 random(seed);
  Bytes out(size);
  for (std::uint8_t& byte : out) byte = static_cast<std::uint8_t>(random());
  return out;
}

template <std::uint8_t kParts>
Stored finish(ModelStore<Eeprom, kParts>& store, Eeprom& eeprom) {
  Stored stored = Stored::writing;
  for (int i = 0; i < 100 && stored == Stored::writing; ++i) stored = store.work(eeprom);
  return stored;
}

template <std::uint8_t kParts>
void send(ModelStore<Eeprom, kParts>& store, Eeprom& eeprom, std::uint8_t part, const Bytes& bytes) {
  ASSERT_TRUE(store.begin(eeprom, part, static_cast<std::uint16_t>(bytes.size())));
  ASSERT_EQ(finish(store, eeprom), Stored::ready);
  while (store.received() < bytes.size()) {
    const std::uint16_t at = store.received();
    const auto count = std::min<std::size_t>(kChunk, bytes.size() - at);
    ASSERT_TRUE(store.write(at, bytes.data() + at, static_cast<std::uint8_t>(count)));
    ASSERT_EQ(finish(store, eeprom), Stored::ready);
  }
  ASSERT_TRUE(store.commit());
  ASSERT_EQ(finish(store, eeprom), Stored::whole);
  store.keep();
  ASSERT_EQ(finish(store, eeprom), Stored::committed);
}

template <std::uint8_t kParts>
Bytes stored(Eeprom& eeprom, std::uint8_t part, std::uint16_t image = 7) {
  const Place place = ModelStore<Eeprom, kParts>(image).find(eeprom, part);
  return {eeprom.bytes.begin() + place.address, eeprom.bytes.begin() + place.address + place.size};
}

// Every write of a swap, each with what was there, what was to come, and anything.
template <std::uint8_t kParts>
void cut_everywhere(std::size_t old_size, std::size_t new_size) {
  std::mt19937 random(1);
  const std::uint8_t part = kParts - 1;
  const Bytes before = random_bytes(old_size, 1);
  const Bytes after = random_bytes(new_size, 2);
  Eeprom full;
  {
    ModelStore<Eeprom, kParts> store(7);
    for (std::uint8_t p = 0; p < kParts; ++p) send(store, full, p, random_bytes(old_size, 100U + p));
    for (unsigned k = 0; k < 3; ++k) send(store, full, part, random_bytes(old_size, 50 + k));
    send(store, full, part, before);
  }
  full.writes = 0;
  Eeprom whole = full;
  ModelStore<Eeprom, kParts> store(7);
  send(store, whole, part, after);
  ASSERT_EQ(stored<kParts>(whole, part), after);
  const int writes = whole.writes;
  EXPECT_EQ(writes, static_cast<int>(new_size) + 7) << "an invalid part, the bytes, the head, the part";
  int old_ones = 0;
  for (int cut = 0; cut < writes; ++cut) {
    for (int kind = 0; kind < 6; ++kind) {
      Eeprom eeprom = full;
      eeprom.lost_at = cut;
      constexpr std::array<std::uint8_t, 4> kKinds = {0x00, 0xff, kParts - 1, 0};
      eeprom.garbage =
          kind < 3 ? kKinds.at(static_cast<std::size_t>(kind)) : static_cast<std::uint8_t>(random());
      ModelStore<Eeprom, kParts> glove(7);
      EXPECT_THROW(send(glove, eeprom, part, after), NoPower);
      const Bytes now = stored<kParts>(eeprom, part);
      ASSERT_TRUE(now == before || now == after) << "cut in write " << cut;
      if (cut + 1 < writes) {
        ASSERT_EQ(now, before) << "cut in write " << cut;
      }
      old_ones += now == before ? 1 : 0;
      for (std::uint8_t p = 0; p + 1 < kParts; ++p)
        ASSERT_EQ(stored<kParts>(eeprom, p), stored<kParts>(full, p));
      // And the next one is taken.
      eeprom.lost_at = -1;
      ModelStore<Eeprom, kParts> again(7);
      send(again, eeprom, part, after);
      ASSERT_EQ(stored<kParts>(eeprom, part), after);
    }
  }
  EXPECT_GE(old_ones, 6 * (writes - 1));
}

TEST(ModelStore, PowerLostInAnyByteLeavesTheOldOrTheNewModel) {
  cut_everywhere<1>(slot_room(1), slot_room(1));
  cut_everywhere<1>(300, 20);
  cut_everywhere<1>(20, 300);
}

TEST(ModelStore, PowerLostInAnyByteLeavesEachFingerOldOrNew) {
  cut_everywhere<5>(slot_room(5), slot_room(5));
  cut_everywhere<5>(100, 40);
}

TEST(ModelStore, AnErasedStoreHasNothing) {
  Eeprom eeprom;
  for (const int fill : {0xff, 0x00}) {
    eeprom.bytes.fill(static_cast<std::uint8_t>(fill));
    for (std::uint8_t part = 0; part < 5; ++part) {
      EXPECT_TRUE(stored<5>(eeprom, part, 0).empty());
      EXPECT_TRUE(stored<5>(eeprom, part).empty());
    }
  }
}

TEST(ModelStore, AModelSentToAnotherImageCountsNoMore) {
  Eeprom eeprom;
  ModelStore<Eeprom, 1> store(7);
  send(store, eeprom, 0, random_bytes(100, 1));
  EXPECT_FALSE(stored<1>(eeprom, 0).empty());
  EXPECT_TRUE((stored<1>(eeprom, 0, 8).empty()));
}

TEST(ModelStore, GenerationsMayWrapAround) {
  Eeprom eeprom;
  ModelStore<Eeprom, 1> store(7);
  for (unsigned k = 0; k < 600; ++k) {
    const Bytes bytes = random_bytes(5, k);
    send(store, eeprom, 0, bytes);
    ASSERT_EQ(stored<1>(eeprom, 0), bytes) << k;
  }
}

TEST(ModelStore, OrdersThatDoNotBelongAreRefused) {
  Eeprom eeprom;
  ModelStore<Eeprom, 5> store(7);
  const Bytes bytes = random_bytes(40, 1);
  EXPECT_FALSE(store.write(0, bytes.data(), 1));
  EXPECT_FALSE(store.commit());
  EXPECT_FALSE(store.begin(eeprom, 5, 10));
  EXPECT_FALSE(store.begin(eeprom, 0, 0));
  EXPECT_FALSE(store.begin(eeprom, 0, slot_room(5) + 1));
  EXPECT_TRUE(store.begin(eeprom, 0, 40));
  EXPECT_FALSE(store.write(0, bytes.data(), kChunk)) << "busy";
  EXPECT_EQ(finish(store, eeprom), Stored::ready);
  EXPECT_FALSE(store.commit()) << "nothing has come";
  EXPECT_FALSE(store.write(kChunk, bytes.data(), kChunk));
  EXPECT_FALSE(store.write(0, bytes.data(), kChunk + 1));
  EXPECT_TRUE(store.write(0, bytes.data(), kChunk));
  EXPECT_EQ(finish(store, eeprom), Stored::ready);
  EXPECT_FALSE(store.write(0, bytes.data(), kChunk)) << "again";
  EXPECT_FALSE(store.write(kChunk, bytes.data(), 40 - kChunk + 1)) << "more than was announced";
  EXPECT_TRUE(store.write(kChunk, bytes.data(), 40 - kChunk));
}

TEST(ModelStore, WhatIsWholeIsFoundAndCountsOnlyOnceItIsKept) {
  Eeprom eeprom;
  ModelStore<Eeprom, 1> store(7);
  const Bytes before = random_bytes(20, 1);
  const Bytes after = random_bytes(20, 2);
  send(store, eeprom, 0, before);
  ASSERT_TRUE(store.begin(eeprom, 0, 20));
  ASSERT_EQ(finish(store, eeprom), Stored::ready);
  ASSERT_TRUE(store.write(0, after.data(), 20));
  ASSERT_EQ(finish(store, eeprom), Stored::ready);
  ASSERT_TRUE(store.commit());
  ASSERT_EQ(finish(store, eeprom), Stored::whole);
  const Place tried = store.find(eeprom, 0);
  EXPECT_EQ(Bytes(eeprom.bytes.begin() + tried.address, eeprom.bytes.begin() + tried.address + tried.size),
            after);
  EXPECT_EQ(stored<1>(eeprom, 0), before) << "after a start";
  store.drop();
  const Place kept = store.find(eeprom, 0);
  EXPECT_EQ(Bytes(eeprom.bytes.begin() + kept.address, eeprom.bytes.begin() + kept.address + kept.size),
            before);
}

// A part of one finger, whose angle is always `angle`; `padding` makes it larger: so many signals more.
Bytes part_of(std::uint8_t finger, int angle, int padding) {
  Bytes part = {compensator::kGraphVersion, 0, 0, 50, 1, 1, 0, 1, static_cast<std::uint8_t>(padding + 2)};
  Bytes code;
  const auto add = [](Bytes& to, int value) {
    to.push_back(static_cast<std::uint8_t>(value));
    to.push_back(static_cast<std::uint8_t>(value >> 8));
  };
  part.push_back(finger);  // its strip
  for (const int value : {0, 0, 1023, -30000, 30000, 0, 0}) add(part, value);
  part.insert(part.end(), {finger, static_cast<std::uint8_t>(finger << 5 | 1 << finger)});
  for (const int value : {0, 0, 1440}) add(part, value);
  constexpr auto kSaturation = static_cast<std::uint8_t>(compensator::Operation::saturation);
  for (int i = 0; i < padding; ++i) {
    code.insert(code.end(), {kSaturation, 0});
    add(code, -100);
    add(code, 100);
  }
  code.insert(code.end(), {kSaturation, compensator::kLeaves});
  for (const int value : {-100, 100, angle, angle}) add(code, value);
  code.insert(code.end(), {finger, 0, static_cast<std::uint8_t>(compensator::Operation::end)});
  part.push_back(static_cast<std::uint8_t>(1 << finger));
  add(part, static_cast<int>(code.size()));
  part.insert(part.end(), code.begin(), code.end());
  const auto size = static_cast<std::uint16_t>(part.size() + 2);
  part[1] = static_cast<std::uint8_t>(size);
  part[2] = static_cast<std::uint8_t>(size >> 8);
  std::uint16_t crc = 0;
  for (const std::uint8_t byte : part) crc = core::crc16_add(crc, byte);
  add(part, crc);
  return part;
}

// A glove of five parts whose RAM holds any four large ones and a small one.
class Glove {
 public:
  static constexpr std::uint8_t kParts = 5;

  explicit Glove(Eeprom& eeprom) : eeprom_(eeprom) {
    for (std::uint8_t k = 0; k < kParts; ++k) own_.at(k) = part_of(k, 3000 + k, 0);
    (void)load();
    receiver_.challenge({});
  }
  std::array<std::int16_t, kParts> angles() {
    std::array<std::int16_t, kParts> out{};
    model_.step();
    std::copy_n(model_.angle, kParts, out.begin());
    return out;
  }
  // As the sender does it, one piece after the other; what became of it.
  std::uint8_t take(std::uint8_t part, const Bytes& bytes) {
    link::Receipt receipt{};
    for (std::size_t at = 0; at < bytes.size() && receipt.stage == 0; at += kChunk) {
      const auto count = static_cast<std::uint8_t>(std::min<std::size_t>(kChunk, bytes.size() - at));
      link::Packet packet;
      const std::uint8_t body = link::put_piece({part, static_cast<std::uint16_t>(bytes.size()),
                                                 static_cast<std::uint16_t>(at), count, bytes.data() + at},
                                                packet.body());
      std::array<std::uint8_t, link::kMaxWire> wire{};
      const std::uint8_t size =
          packet.seal({link::Type::coefficients, false, false, 0}, body, nullptr, wire.data());
      for (std::uint8_t i = 0; i < size; ++i) {
        if (reader_.push(wire.at(i)) != link::Received::pending) continue;
        EXPECT_TRUE(receiver_.take(reader_, eeprom_));
      }
      receipt = work();
    }
    return receipt.stage;
  }

 private:
  static constexpr std::uint16_t kArena = 840;
  struct Settings {
    struct {
      std::uint16_t low, high;
    } monitor;
    struct {
      std::int16_t rest;
    } guard;
    std::uint8_t strips;
    struct {
      std::int16_t open, fist;
    } poses;
  };

  compensator::Loaded load() {
    std::array<BuiltIn, kParts> own{};
    for (std::size_t k = 0; k < kParts; ++k)
      own.at(k) = {own_.at(k).data(), static_cast<std::uint16_t>(own_.at(k).size())};
    std::array<Settings, compensator::kStrips> settings{};
    return model_.load(eeprom_, store_, own.data(), {calibration_.data(), 50}, settings.data());
  }
  link::Receipt work() {
    link::Receipt receipt{};
    for (int k = 0; k < 200; ++k) {
      if (receiver_.work(eeprom_)) receiver_.loaded(static_cast<std::uint8_t>(load()));
      std::array<std::uint8_t, link::kMaxWire> wire{};
      const std::uint8_t size = receiver_.speak({50, calibration_.data()}, 7, wire.data());
      for (std::uint8_t i = 0; i < size; ++i) {
        if (said_.push(wire.at(i)) == link::Received::pending && said_.body()[0] == 1)
          receipt = link::get_receipt(said_.body());
      }
    }
    return receipt;
  }

  Eeprom& eeprom_;
  std::array<Bytes, kParts> own_;
  std::array<std::uint16_t, compensator::kStrips> calibration_{};
  DataModel<Eeprom, kParts, kArena> model_;
  ModelStore<Eeprom, kParts> store_{7};
  ModelReceiver<Eeprom, kParts> receiver_{nullptr, store_};
  link::PacketReader reader_;
  link::PacketReader said_;
};

using Angles = std::array<std::int16_t, Glove::kParts>;

// What does not fit beside the other parts was once written down before it was tried: who lost power then had what is
// built in, neither old nor new.
TEST(ModelStore, PowerLostWhileAPartIsTriedLeavesTheOldModelOrTheNew) {
  Eeprom full;
  {
    Glove glove(full);
    for (std::uint8_t k = 0; k < Glove::kParts; ++k)
      ASSERT_EQ(glove.take(k, part_of(k, 1000 + k, k == 0 ? 1 : 16)), kRuns);
  }
  const Angles old_ones = {1000, 1001, 1002, 1003, 1004};
  ASSERT_EQ(Glove(full).angles(), old_ones);
  for (const bool fits : {false, true}) {
    const Angles new_ones = fits ? Angles{2000, 1001, 1002, 1003, 1004} : old_ones;
    const Bytes part = part_of(0, 2000, fits ? 2 : 16);
    Eeprom whole = full;
    whole.writes = 0;
    {
      Glove glove(whole);
      EXPECT_EQ(glove.take(0, part), fits ? kRuns : 2 + static_cast<int>(compensator::Loaded::no_room));
      EXPECT_EQ(glove.angles(), new_ones) << "while it is worn";
    }
    EXPECT_EQ(Glove(whole).angles(), new_ones);
    const int writes = whole.writes;
    ASSERT_GT(writes, static_cast<int>(part.size()));
    for (int cut = 0; cut < writes; ++cut) {
      for (const int garbage : {0x00, 0x02, 0xff}) {
        Eeprom eeprom = full;
        eeprom.writes = 0;
        eeprom.lost_at = cut;
        eeprom.garbage = static_cast<std::uint8_t>(garbage);
        EXPECT_THROW(Glove(eeprom).take(0, part), NoPower);
        const Angles now = Glove(eeprom).angles();
        ASSERT_TRUE(now == old_ones || now == new_ones) << "cut in write " << cut << ": " << now[0];
      }
    }
  }
}

TEST(ModelStore, AWornOutCellIsNoticed) {
  class Worn : public Eeprom {
   public:
    void write(std::uint16_t address, std::uint8_t byte) {
      Eeprom::write(address, address == kStoreBegin + kSlotHead + 3 ? 0x00 : byte);
    }
  } eeprom;
  ModelStore<Worn, 1> store(7);
  ASSERT_TRUE(store.begin(eeprom, 0, 16));
  while (store.work(eeprom) == Stored::writing) continue;
  const Bytes bytes(16, 0x55);
  ASSERT_TRUE(store.write(0, bytes.data(), 16));
  Stored last = Stored::writing;
  for (int i = 0; i < 100; ++i) last = store.work(eeprom);
  EXPECT_EQ(last, Stored::failed);
}

}  // namespace
}  // namespace flexor::glove
