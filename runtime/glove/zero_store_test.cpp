#include "runtime/glove/zero_store.hpp"

#include <gtest/gtest.h>

#include <array>
#include <vector>

namespace flexor::glove {
namespace {

struct FakeEeprom {
  std::vector<uint8_t> bytes = std::vector<uint8_t>(64, 0xff);
  uint8_t read(uint16_t address) const { return bytes.at(address); }
  bool ready() const { return true; }
  void write(uint16_t address, uint8_t byte) { bytes.at(address) = byte; }
};

using Store = ZeroStore<FakeEeprom, 5>;
using Corrections = std::array<sensor::Correction, 5>;

Corrections corrections(int16_t number) {
  Corrections out{};
  for (auto& c : out) c = {static_cast<int16_t>(16384 - number), static_cast<int16_t>(10 * number)};
  return out;
}

void write(FakeEeprom& eeprom, Store& store, int16_t number, int bytes) {
  store.save(corrections(number).data());
  for (int k = 0; k < bytes && !store.work(eeprom); ++k) {
  }
}

int16_t loaded(FakeEeprom& eeprom, uint16_t made_for = 7) {
  Corrections found{};
  if (!Store().load(eeprom, made_for, found.data()))
    return found[0].gain == sensor::kUncorrected.gain ? -1 : -2;
  return static_cast<int16_t>(found[4].offset / 10);
}

TEST(ZeroStore, PowerLostAtAnyByteLeavesTheOldOrTheNew) {
  for (int cut = 0; cut <= Store::kRecordBytes; ++cut) {
    for (int before = 0; before < 4; ++before) {
      FakeEeprom eeprom;
      EXPECT_EQ(loaded(eeprom), -1) << "erased";
      Store store;
      Corrections none{};
      (void)store.load(eeprom, 7, none.data());
      for (int k = 1; k <= before; ++k) write(eeprom, store, static_cast<int16_t>(k), 100);
      Store later;
      (void)later.load(eeprom, 7, none.data());
      write(eeprom, later, 50, cut);
      const int16_t old = before == 0 ? static_cast<int16_t>(-1) : static_cast<int16_t>(before);
      EXPECT_EQ(loaded(eeprom), cut == Store::kRecordBytes ? 50 : old) << cut << " " << before;
    }
  }
}

// As a model does whose last part arrives meanwhile.
TEST(ZeroStore, LoadedWhileItIsWrittenGivesWhatIsWritten) {
  for (int written = 0; written <= Store::kRecordBytes; ++written) {
    FakeEeprom eeprom;
    Store store;
    Corrections found{};
    (void)store.load(eeprom, 7, found.data());
    write(eeprom, store, 1, 100);
    write(eeprom, store, 2, written);
    EXPECT_TRUE(store.load(eeprom, 7, found.data()));
    EXPECT_EQ(found[4].offset, corrections(2)[4].offset) << written;
    while (!store.work(eeprom)) {
    }
    EXPECT_EQ(loaded(eeprom), 2) << written;
    write(eeprom, store, 3, 100);
    EXPECT_EQ(loaded(eeprom), 3) << written;
  }
}

TEST(ZeroStore, LoadedForAnotherModelWhileItIsWrittenItIsGivenUp) {
  FakeEeprom eeprom;
  Store store;
  Corrections found{};
  (void)store.load(eeprom, 7, found.data());
  write(eeprom, store, 1, 100);
  write(eeprom, store, 2, 5);
  EXPECT_FALSE(store.load(eeprom, 8, found.data()));
  EXPECT_TRUE(store.work(eeprom)) << "nothing is left to write";
  EXPECT_EQ(loaded(eeprom), 1);
}

TEST(ZeroStore, KeepsTheNewestOfMoreThanItsNumbersAndNoneOfAnotherModel) {
  FakeEeprom eeprom;
  Store store;
  Corrections none{};
  (void)store.load(eeprom, 7, none.data());
  for (int k = 1; k <= 1000; ++k) {
    write(eeprom, store, static_cast<int16_t>(k), 100);
    ASSERT_EQ(loaded(eeprom), k);
  }
  EXPECT_EQ(loaded(eeprom, 8), -1);
}

}  // namespace
}  // namespace flexor::glove
