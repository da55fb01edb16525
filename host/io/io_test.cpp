#include "host/io/io.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>

#include "host/io/beneath.hpp"
#include "host/io/expect_test.hpp"
#include "host/io/folder_lock.hpp"
#include "host/io/numbers.hpp"

namespace flexor::io {
namespace {
namespace fs = std::filesystem;

class Io : public testing::Test {
 protected:
  const TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path();
};

TEST_F(Io, WhatIsWrittenIsReadBack) {
  const std::string content("a\0b\n", 4);
  write_file(folder_ / "x", content);
  EXPECT_EQ(read_file(folder_ / "x"), content);
}

// Whoever can write into the folder lets nobody wait, fills no memory and shows nothing from elsewhere.
TEST_F(Io, OnlyABoundedFileOfTheFolderIsRead) {
  write_file(folder_ / "secret", "content of another");
  fs::create_directories(folder_ / "in");
  write_file(folder_ / "in/file", "content");
  fs::create_symlink("../secret", folder_ / "in/link");
  ASSERT_EQ(mkfifo((folder_ / "in/fifo").c_str(), 0600), 0);
  std::ofstream(folder_ / "in/sparse").close();
  fs::resize_file(folder_ / "in/sparse", std::uintmax_t{11} << 30U);
  EXPECT_EQ(FileBeneath(folder_ / "in", "file", 7).all(), "content");
  EXPECT_EQ(FileBeneath(folder_, "in/file", 7).read(5, 100), "nt");
  EXPECT_EQ(FileBeneath(folder_, "in/file", 7).read(9, 1), "");
  for (const char* name : {"link", "fifo", "sparse", "../secret", "", ".", "none", "file/x"}) {
    const std::string why = refusal_of<InputError>([&] { FileBeneath(folder_ / "in", name, 1000); });
    EXPECT_NE(why, "accepted") << name;
    EXPECT_EQ(why.find("content"), std::string::npos) << why;
  }
}

TEST_F(Io, WhatControlsATerminalIsNotPrinted) {
  EXPECT_EQ(one_line("a\x1b[2J\nb\x7f"), "a?[2J?b?");
  EXPECT_EQ(one_line("a\xc2\x9bJb\xc2\x80\xc2\x9f"), "a?Jb??");
  EXPECT_EQ(one_line("\x9bJ"), "?J") << "as a byte alone";
  const std::string letters = "\xc2\xa0Ä€\xe2\x82\x9b\xf0\x9f\x98\x80";
  EXPECT_EQ(one_line(letters), letters);
  EXPECT_EQ(one_line("\xff\x9bJ\u202ea\u2069"), "\xff?J?a?")
      << "after a byte that is no UTF-8, and what turns a line round";
  EXPECT_EQ(without_controls("a\t\n\x1b", "\n\t"), "a\t\n?");
}

TEST_F(Io, ReadingNamesTheFileAndTheReason) {
  std::ofstream(folder_ / "empty").close();
  for (const auto& [path, reason] : {std::pair{folder_ / "none", "none: no such file"},
                                     {folder_, "is a directory"},
                                     {"/dev/zero", "is a device, which may never end"},
                                     {folder_ / "empty", "is empty"}})
    expect_refused([&path = path] { (void)read_file(path); }, reason);
}

TEST_F(Io, FoldersOfOutputsAreCheckedBeforeTheWork) {
  EXPECT_NO_THROW(require_folder(folder_));
  EXPECT_NO_THROW(require_folder(folder_ / "a" / "b"));
  write_file(folder_ / "file", "x");
  EXPECT_THROW(require_folder(folder_ / "file"), InputError);
}

TEST_F(Io, AFolderOfAnotherJobIsRefusedAlsoWhereThatWasCutOff) {
  const auto has = [&](const char* name, const char* text, const char* kind) {
    const TemporaryFolder folder;
    write_file(folder.path() / name, text);
    EXPECT_NO_THROW(FolderLock(folder.path(), kind)) << name;
    for (const char* other : {"hand", "tracking"})
      EXPECT_EQ(refusal_of<InputError>([&] { require_folder(folder.path(), other); }) == "accepted",
                std::string(other) == kind)
          << name << " " << other;
  };
  has("results.json", R"({"kind": "hand"})", "hand");
  has("run.json", R"({"version": "1.0.0", "engine": "twin"})", "experiment");
  has("run.json", R"({"kind": "cohort"})", "cohort");
  has("cohort.csv", "subject,session\n", "cohort");
}

TEST_F(Io, ALockThatAnotherUserHasLeftIsHeld) {
  fs::permissions(folder_, fs::perms::all);
  write_file(folder_ / "lock", "process 1 on nowhere\n");
  fs::permissions(folder_ / "lock", fs::perms(0444));
  const bool is_root = ::geteuid() == 0;
  ASSERT_TRUE(!is_root || ::seteuid(65534) == 0);
  EXPECT_NO_THROW({
    const FolderLock lock(folder_);
    EXPECT_THROW(FolderLock second(folder_), InputError);
  });
  ASSERT_TRUE(!is_root || ::seteuid(0) == 0);
}

TEST(ShellWord, IsQuotedOnlyWhereItMustBe) {
  EXPECT_EQ(shell_word("runs/a-1_b.csv"), "runs/a-1_b.csv");
  EXPECT_EQ(shell_word(""), "\"\"");
  EXPECT_EQ(shell_word("it's"), "\"it's\"");  // as cmd and PowerShell take it, too
  EXPECT_EQ(shell_word("a b; $(c)"), "'a b; $(c)'");
  EXPECT_EQ(shell_word("\"it's\""), R"('"it'\''s"')");
}

TEST(Interpolate, HoldsItsEnds) {
  const std::vector<double> t = {1, 2, 4};
  const std::vector<double> x = {10, 20, 0};
  EXPECT_EQ(interpolate(t, x, 0), 10);
  EXPECT_EQ(interpolate(t, x, 1.5), 15);
  EXPECT_EQ(interpolate(t, x, 3), 10);
  EXPECT_EQ(interpolate(t, x, 9), 0);
}

TEST(Digest, IsTheKnownFnv1a) { EXPECT_EQ(digest("a"), "fnv1a64:af63dc4c8601ec8c"); }

}  // namespace
}  // namespace flexor::io
