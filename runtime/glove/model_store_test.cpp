// The model in EEPROM: power that is lost in any byte of a swap leaves the old or the new one.
#include "runtime/glove/model_store.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <vector>

#include "runtime/compensator/part_test.hpp"
#include "runtime/glove/glove_model.hpp"
#include "runtime/glove/model_receiver.hpp"
#include "runtime/glove/signal_chain.hpp"

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

Stored finish(ModelStore<Eeprom>& store, Eeprom& eeprom) {
  Stored stored = Stored::writing;
  for (int i = 0; i < 100 && stored == Stored::writing; ++i) stored = store.work(eeprom);
  return stored;
}

void send_whole(ModelStore<Eeprom>& store, Eeprom& eeprom, const Bytes& bytes) {
  ASSERT_TRUE(store.begin(eeprom, static_cast<std::uint16_t>(bytes.size())));
  ASSERT_EQ(finish(store, eeprom), Stored::ready);
  while (store.received() < bytes.size()) {
    const std::uint16_t at = store.received();
    const auto count = std::min<std::size_t>(kChunk, bytes.size() - at);
    ASSERT_TRUE(store.write(at, bytes.data() + at, static_cast<std::uint8_t>(count)));
    ASSERT_EQ(finish(store, eeprom), Stored::ready);
  }
  ASSERT_TRUE(store.commit());
  ASSERT_EQ(finish(store, eeprom), Stored::whole);
}

void send(ModelStore<Eeprom>& store, Eeprom& eeprom, const Bytes& bytes) {
  send_whole(store, eeprom, bytes);
  store.keep();
  ASSERT_EQ(finish(store, eeprom), Stored::committed);
}

Bytes found(const ModelStore<Eeprom>& store, Eeprom& eeprom) {
  const Place place = store.find(eeprom);
  return {eeprom.bytes.begin() + place.address, eeprom.bytes.begin() + place.address + place.size};
}
Bytes stored(Eeprom& eeprom, std::uint16_t base = 7) { return found(ModelStore<Eeprom>(base), eeprom); }

// Every write of a swap, each with what was there, what was to come, and anything.
void cut_everywhere(std::size_t old_size, std::size_t new_size) {
  std::mt19937 random(1);
  const Bytes before = random_bytes(old_size, 1);
  const Bytes after = random_bytes(new_size, 2);
  Eeprom full;
  ModelStore<Eeprom> store(7);
  for (unsigned k = 0; k < 3; ++k) send(store, full, random_bytes(old_size, 50 + k));
  send(store, full, before);
  full.writes = 0;
  Eeprom whole = full;
  store = ModelStore<Eeprom>(7);
  send(store, whole, after);
  ASSERT_EQ(stored(whole), after);
  const int writes = whole.writes;
  EXPECT_EQ(writes, static_cast<int>(new_size) + 7) << "an invalid mark, the bytes, the head, the mark";
  for (int cut = 0; cut < writes; ++cut) {
    for (const auto garbage :
         std::vector<std::mt19937::result_type>{0, 0xff, 1, random(), random(), random()}) {
      Eeprom eeprom = full;
      eeprom.lost_at = cut;
      eeprom.garbage = static_cast<std::uint8_t>(garbage);
      store = ModelStore<Eeprom>(7);
      EXPECT_THROW(send(store, eeprom, after), NoPower);
      const Bytes now = stored(eeprom);
      ASSERT_TRUE(now == before || (now == after && cut + 1 == writes)) << "cut in write " << cut;
      // And the next one is taken.
      eeprom.lost_at = -1;
      store = ModelStore<Eeprom>(7);
      send(store, eeprom, after);
      ASSERT_EQ(stored(eeprom), after);
    }
  }
}

TEST(ModelStore, PowerLostInAnyByteLeavesTheOldOrTheNewModel) {
  cut_everywhere(kSlotRoom, kSlotRoom);
  cut_everywhere(300, 20);
  cut_everywhere(20, 300);
}

TEST(ModelStore, AnErasedStoreHasNothing) {
  Eeprom eeprom;
  for (const int fill : {0xff, 0x00}) {
    eeprom.bytes.fill(static_cast<std::uint8_t>(fill));
    EXPECT_TRUE(stored(eeprom, 0).empty());
    EXPECT_TRUE(stored(eeprom).empty());
  }
}

TEST(ModelStore, AModelSentBesideAnotherCountsNoMore) {
  Eeprom eeprom;
  ModelStore<Eeprom> store(7);
  send(store, eeprom, random_bytes(100, 1));
  EXPECT_FALSE(stored(eeprom).empty());
  EXPECT_TRUE(stored(eeprom, 8).empty());
}

TEST(ModelStore, GenerationsMayWrapAround) {
  Eeprom eeprom;
  ModelStore<Eeprom> store(7);
  for (unsigned k = 0; k < 600; ++k) {
    const Bytes bytes = random_bytes(5, k);
    send(store, eeprom, bytes);
    ASSERT_EQ(stored(eeprom), bytes) << k;
  }
}

TEST(ModelStore, OrdersThatDoNotBelongAreRefused) {
  Eeprom eeprom;
  ModelStore<Eeprom> store(7);
  const Bytes bytes = random_bytes(40, 1);
  EXPECT_FALSE(store.write(0, bytes.data(), 1));
  EXPECT_FALSE(store.commit());
  EXPECT_FALSE(store.begin(eeprom, kSlotRoom + 1));
  EXPECT_FALSE(store.begin(eeprom, 0));
  EXPECT_TRUE(store.begin(eeprom, 40));
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
  ModelStore<Eeprom> store(7);
  const Bytes before = random_bytes(20, 1);
  const Bytes after = random_bytes(20, 2);
  send(store, eeprom, before);
  send_whole(store, eeprom, after);
  EXPECT_EQ(found(store, eeprom), after);
  EXPECT_EQ(stored(eeprom), before) << "after a start";
  store.drop();
  EXPECT_EQ(found(store, eeprom), before);
}

// Of one finger, whose angle is always `angle`; `padding` makes it larger: so many signals more.
Bytes part_of(std::uint8_t finger, int angle, std::uint8_t padding) {
  constexpr auto kSaturation = static_cast<std::uint8_t>(compensator::Operation::saturation);
  Bytes code;
  for (int i = 0; i < padding; ++i) {
    code.insert(code.end(), {kSaturation, 0});
    for (const int value : {-100, 100}) compensator::put16(code, value);
  }
  code.insert(code.end(), {kSaturation, compensator::kLeaves});
  for (const int value : {-100, 100, angle, angle}) compensator::put16(code, value);
  code.insert(code.end(), {finger, 0, static_cast<std::uint8_t>(compensator::Operation::end)});
  return compensator::part_of(finger, static_cast<std::uint8_t>(padding + 2), code);
}

// A glove whose RAM holds a model of the index finger that is not too large.
class Glove {
 public:
  explicit Glove(Eeprom& eeprom) : eeprom_(eeprom) {
    const Bytes own = part_of(1, 3000, 0);
    flash_[2] = static_cast<std::uint8_t>(own.size());
    std::copy(own.begin(), own.end(), flash_.begin() + core::kCopyHead);
    const std::uint16_t crc = core::crc_of_copy(flash_.data(), static_cast<std::uint16_t>(own.size()));
    flash_[4] = static_cast<std::uint8_t>(crc);
    flash_[5] = static_cast<std::uint8_t>(crc >> 8);
    store_ = ModelStore<Eeprom>(model_.flashed());
    (void)load();
    receiver_.challenge({});
  }
  std::int16_t angle() {
    model_.step();
    return model_.angle[1];
  }
  // As the sender does it, one piece after the other; what became of it.
  std::uint8_t take(const Bytes& bytes) {
    link::Receipt receipt{};
    for (std::size_t at = 0; at < bytes.size() && receipt.stage == 0; at += kChunk) {
      const auto count = static_cast<std::uint8_t>(std::min<std::size_t>(kChunk, bytes.size() - at));
      link::Packet packet;
      const std::uint8_t body = link::put_piece({static_cast<std::uint16_t>(bytes.size()),
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
  static constexpr std::uint16_t kArena = 500;

  compensator::Loaded load() {
    std::array<ChannelSettings, compensator::kSensors> settings{};
    return model_.load(eeprom_, store_, {calibration_.data(), 50}, settings.data());
  }
  link::Receipt work() {
    link::Receipt receipt{};
    for (int k = 0; k < 200; ++k) {
      if (receiver_.work(eeprom_)) receiver_.loaded(static_cast<std::uint8_t>(load()));
      std::array<std::uint8_t, link::kMaxWire> wire{};
      const std::uint8_t size = receiver_.answer({50, calibration_.data()}, 7, wire.data());
      for (std::uint8_t i = 0; i < size; ++i) {
        if (answer_.push(wire.at(i)) == link::Received::pending && answer_.body()[0] == 1)
          receipt = link::get_receipt(answer_.body());
      }
    }
    return receipt;
  }

  Eeprom& eeprom_;
  std::array<std::uint8_t, 2 * core::kModelCopy> flash_{};
  std::array<std::uint16_t, compensator::kSensors> calibration_{};
  GloveModel<Eeprom, kArena> model_{flash_.data()};
  ModelStore<Eeprom> store_{0};
  ModelReceiver<Eeprom> receiver_{nullptr, store_};
  link::PacketReader reader_;
  link::PacketReader answer_;
};

// What does not fit was once written down before it was tried: who lost power then had neither the old model nor the new.
TEST(ModelStore, PowerLostWhileAModelIsTriedLeavesTheOldOrTheNew) {
  Eeprom full;
  ASSERT_EQ(Glove(full).angle(), 3000) << "the one in flash";
  ASSERT_EQ(Glove(full).take(part_of(1, 1000, 4)), kRuns);
  ASSERT_EQ(Glove(full).angle(), 1000);
  for (const bool fits : {false, true}) {
    const int after = fits ? 2000 : 1000;
    const Bytes model = part_of(1, 2000, fits ? 2 : 60);
    Eeprom whole = full;
    whole.writes = 0;
    {
      Glove glove(whole);
      EXPECT_EQ(glove.take(model), fits ? kRuns : 2 + static_cast<int>(compensator::Loaded::no_room));
      EXPECT_EQ(glove.angle(), after) << "while it is worn";
    }
    EXPECT_EQ(Glove(whole).angle(), after);
    const int writes = whole.writes;
    ASSERT_GT(writes, static_cast<int>(model.size()));
    for (int cut = 0; cut < writes; ++cut) {
      for (const int garbage : {0x00, 0x02, 0xff}) {
        Eeprom eeprom = full;
        eeprom.writes = 0;
        eeprom.lost_at = cut;
        eeprom.garbage = static_cast<std::uint8_t>(garbage);
        EXPECT_THROW(Glove(eeprom).take(model), NoPower);
        const int now = Glove(eeprom).angle();
        ASSERT_TRUE(now == 1000 || now == after) << "cut in write " << cut << ": " << now;
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
  ModelStore<Worn> store(7);
  ASSERT_TRUE(store.begin(eeprom, 16));
  while (store.work(eeprom) == Stored::writing) continue;
  const Bytes bytes(16, 0x55);
  ASSERT_TRUE(store.write(0, bytes.data(), 16));
  Stored last = Stored::writing;
  for (int i = 0; i < 100; ++i) last = store.work(eeprom);
  EXPECT_EQ(last, Stored::failed);
}

}  // namespace
}  // namespace flexor::glove
