#include "host/deploy/pair.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "host/deploy/key_patch.hpp"
#include "host/deploy/out_folder.hpp"
#include "host/deploy/pair_key.hpp"
#include "host/io/io.hpp"

namespace flexor::deploy {
namespace {

namespace fs = std::filesystem;

link::Key numbered(std::uint8_t number) {
  link::Key key{};
  key.bytes[0] = number;
  return key;
}

// A deployment of boards that hold nothing but a key.
class PairFolder : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* image : {"glove.hex", "hand.hex"})
      io::write_file(path(image), to_intel_hex(page_with_key(numbered(1))));
    write_key(path(kKeyFile), numbered(1));
    io::make_folder(path("arduino/Flexor/src"));
    io::write_file(path("arduino/Flexor/src/glove_data.h"),
                   "alignas(2) const uint8_t kFlexorKey[] PROGMEM = {1};\n");
  }
  fs::path path(const std::string& name) const { return folder_.path() / name; }
  std::string key_of(const std::string& name) const { return to_hex(load_key(path(name))); }

  io::TemporaryFolder folder_;
};

TEST_F(PairFolder, NoKeyIsEverLost) {
  EXPECT_EQ(pair_folder(folder_.path(), numbered(2)), path("pair.key.old"));
  EXPECT_EQ(key_of("pair.key"), to_hex(numbered(2)));
  EXPECT_NE(io::read_file(path("arduino/Flexor/src/glove_data.h")).find("48,49,2,0,"), std::string::npos);
  EXPECT_EQ(key_of("pair.key.old"), to_hex(numbered(1)));
  EXPECT_EQ(fs::status(path("pair.key.old")).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_EQ(pair_folder(folder_.path(), numbered(3)), path("pair.key.old-2"));
  EXPECT_EQ(key_of("pair.key.old"), to_hex(numbered(1)));
  EXPECT_EQ(key_of("pair.key.old-2"), to_hex(numbered(2)));
  EXPECT_EQ(pair_folder(folder_.path(), numbered(3)), fs::path()) << "it has it already";
  EXPECT_EQ(pair_folder(folder_.path(), numbered(1)), path("pair.key.old-3"));
  EXPECT_EQ(pair_folder(folder_.path(), numbered(3)), path("pair.key.old")) << "which has that key";
}

TEST_F(PairFolder, WhatMightHaveBeenAKeyIsNotReplaced) {
  io::write_file(path(kKeyFile), "half a ke");
  EXPECT_THROW(pair_folder(folder_.path(), numbered(2)), io::InputError);
  EXPECT_EQ(io::read_file(path(kKeyFile)), "half a ke");
}

}  // namespace
}  // namespace flexor::deploy
