#include "host/io/io.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

namespace flexor::io {
namespace {
namespace fs = std::filesystem;

class Io : public testing::Test {
 protected:
  Io() : folder_(fs::path(testing::TempDir()) / ("flexor_io_test_" + std::to_string(::getpid()))) {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~Io() override { fs::remove_all(folder_); }

  std::string message_of_reading(const fs::path& path) const {
    try {
      (void)read_file(path);
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  }

  fs::path folder_;
};

TEST_F(Io, WhatIsWrittenIsReadBack) {
  const std::string content("a\0b\n", 4);
  write_file(folder_ / "x", content);
  EXPECT_EQ(read_file(folder_ / "x"), content);
}

TEST_F(Io, ReadingNamesTheFileAndTheReason) {
  EXPECT_NE(message_of_reading(folder_ / "none").find("none: no such file"), std::string::npos);
  EXPECT_NE(message_of_reading(folder_).find("is a directory"), std::string::npos);
  EXPECT_NE(message_of_reading("/dev/zero").find("is a device, which may never end"), std::string::npos);
  std::ofstream(folder_ / "empty").close();
  EXPECT_NE(message_of_reading(folder_ / "empty").find("is empty"), std::string::npos);
}

TEST_F(Io, AFailedWriteLeavesNothingBehind) {
  fs::create_directories(folder_ / "taken");
  EXPECT_THROW(write_file(folder_ / "taken", "x"), InputError);  // the target is a folder
  EXPECT_THROW(write_file(folder_ / "none" / "x", "x"), InputError);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1);
}

TEST_F(Io, OutputsAreCheckedBeforeTheWork) {
  EXPECT_NO_THROW(require_writable(folder_ / "new"));
  EXPECT_THROW(require_writable(folder_), InputError);
  EXPECT_THROW(require_writable(folder_ / "none" / "x"), InputError);
  EXPECT_NO_THROW(require_folder(folder_));
  EXPECT_NO_THROW(require_folder(folder_ / "a" / "b"));
  write_file(folder_ / "file", "x");
  EXPECT_THROW(require_folder(folder_ / "file"), InputError);
}

TEST(ShellWord, IsQuotedOnlyWhereItMustBe) {
  EXPECT_EQ(shell_word("runs/a-1_b.csv"), "runs/a-1_b.csv");
  EXPECT_EQ(shell_word(""), "''");
  EXPECT_EQ(shell_word("~x"), "'~x'");
  EXPECT_EQ(shell_word("a b; $(c)"), "'a b; $(c)'");
  EXPECT_EQ(shell_word("it's"), R"('it'\''s')");
}

TEST(Digest, IsTheKnownFnv1a) { EXPECT_EQ(digest("a"), "fnv1a64:af63dc4c8601ec8c"); }

}  // namespace
}  // namespace flexor::io
