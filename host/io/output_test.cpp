#include "host/io/output.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <thread>

#include "host/io/refusal_test.hpp"

namespace flexor::io {
namespace {
namespace fs = std::filesystem;

class Outputs : public testing::Test {
 protected:
  fs::path old_file(const std::string& name = "file") const {
    write_file(folder_ / name, "old");
    return folder_ / name;
  }

  static mode_t mode_of(const fs::path& path) {
    struct stat status {};
    EXPECT_EQ(stat(path.c_str(), &status), 0);
    return status.st_mode & 07777;
  }

  std::ptrdiff_t entries() const { return std::distance(fs::directory_iterator(folder_), {}); }

  // Both ways to write, since both keep the same promises.
  static void write_both_ways(const fs::path& path, const std::string& content) {
    write_file(path, content);
    Output by_name(path);
    std::ofstream(by_name.name()) << content;
    by_name.commit();
  }

  static void expect_refused(const fs::path& path) {
    EXPECT_THROW(require_writable(path), InputError) << path;
    EXPECT_THROW(write_file(path, "x"), InputError) << path;
  }

  const TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path();
};

TEST_F(Outputs, NothingIsThereBeforeCommitAndTheOldContentStaysWithoutIt) {
  const fs::path file = old_file();
  {
    Output output(file);
    output.write(std::string(1 << 20, 'x'));
    EXPECT_EQ(read_file(file), "old");
  }
  {
    const Output by_name(file);
    std::ofstream(by_name.name()) << "new";
  }
  EXPECT_EQ(read_file(file), "old");
  EXPECT_EQ(entries(), 1);
}

TEST_F(Outputs, ALinkIsFollowedAndItsTargetReplaced) {
  const fs::path file = old_file();
  fs::create_directories(folder_ / "links");
  fs::create_symlink("../file", folder_ / "links/relative");
  fs::create_symlink(folder_ / "links/relative", folder_ / "links/twice");
  fs::create_symlink(folder_ / "fresh", folder_ / "links/dangling");
  write_both_ways(folder_ / "links/twice", "new");
  write_both_ways(folder_ / "links/dangling", "made");
  EXPECT_TRUE(fs::is_symlink(folder_ / "links/twice"));
  EXPECT_TRUE(fs::is_symlink(folder_ / "links/dangling"));
  EXPECT_EQ(read_file(file), "new");
  EXPECT_EQ(read_file(folder_ / "fresh"), "made");
  fs::create_symlink(folder_ / "fresh", folder_ / "links/film.mp4");
  EXPECT_EQ(Output(folder_ / "links/film.mp4").name().extension(), ".mp4");
}

TEST_F(Outputs, ALoopOfLinksIsRefused) {
  fs::create_symlink("b", folder_ / "a");
  fs::create_symlink("a", folder_ / "b");
  expect_refused(folder_ / "a");
}

TEST_F(Outputs, AFileKeepsItsPermissionsAndANewOneFollowsTheUmask) {
  const fs::path file = old_file();
  ::chmod(file.c_str(), 0664);
  const mode_t before = ::umask(027);
  write_both_ways(file, "new");
  write_both_ways(folder_ / "new", "new");
  ::umask(before);
  EXPECT_EQ(mode_of(file), 0664u);
  EXPECT_EQ(mode_of(folder_ / "new"), 0640u);
}

TEST_F(Outputs, ASecretIsTheOwnersAloneFromItsFirstByte) {
  const fs::path file = old_file();
  ::chmod(file.c_str(), 0644);
  write_file(file, "key", Access::owner);
  EXPECT_EQ(mode_of(file), 0600u);
}

TEST_F(Outputs, ADeviceIsWrittenIntoAndNeverReplaced) {
  write_file("/dev/null", "x");
  EXPECT_THROW(Output("/dev/null").name(), InputError);
  struct stat status {};
  ASSERT_EQ(stat("/dev/null", &status), 0);
  EXPECT_TRUE(S_ISCHR(status.st_mode));
  fs::create_symlink("/dev/full", folder_ / "link");
  for (const fs::path& full : {fs::path("/dev/full"), folder_ / "link"}) {
    const std::string expected = full.string() + ": cannot be written: No space left on device";
    EXPECT_EQ(refusal_of<JobError>([&] { write_file(full, "x"); }), expected);
  }
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
}

TEST_F(Outputs, AFifoCarriesTheBytesAndStays) {
  const fs::path fifo = folder_ / "fifo";
  ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
  std::string received;
  std::jthread reader([&] { received = read_file(fifo); });
  write_file(fifo, "bytes");
  reader.join();
  EXPECT_EQ(received, "bytes");
  EXPECT_TRUE(fs::is_fifo(fifo));
}

// `flexor ... --out /dev/stdout > file`: the shell's file must not be replaced by another of that name, and
// what was written to it before stays.
TEST_F(Outputs, StandardOutputIsWrittenWhereItStands) {
  const fs::path file = folder_ / "redirected";
  const int descriptor = ::open(file.c_str(), O_CREAT | O_WRONLY, 0600);
  ASSERT_EQ(::write(descriptor, "first ", 6), 6);
  const fs::path name = "/dev/fd/" + std::to_string(descriptor);
  require_writable(name);
  write_file(name, "then ");
  ASSERT_EQ(::write(descriptor, "last", 4), 4);
  ::close(descriptor);
  EXPECT_EQ(read_file(file), "first then last");
  EXPECT_THROW(require_writable(name), InputError);  // closed by now
}

TEST_F(Outputs, StandardOutputIsKnownByAnyName) {
  for (const char* name : {"/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"})
    EXPECT_TRUE(is_standard_output(name)) << name;
  for (const fs::path& other : {fs::path("/dev/null"), fs::path("/dev/stderr"), folder_ / "none"})
    EXPECT_FALSE(is_standard_output(other)) << other;
}

TEST_F(Outputs, FoldersAndMissingFoldersAreRefusedBeforeAndDuringTheWork) {
  for (const fs::path& path :
       {folder_, folder_ / "none/x", folder_ / "none/", folder_ / "file/x", fs::path("")}) {
    (void)old_file();
    expect_refused(path);
    EXPECT_EQ(entries(), 1) << path;
  }
}

TEST_F(Outputs, AReadOnlyFileIsRefused) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may write everything";
  const fs::path file = old_file();
  ::chmod(file.c_str(), 0444);
  expect_refused(file);
}

TEST_F(Outputs, AnInputIsNeverReplacedUnderAnyOfItsNames) {
  write_file(folder_ / "log", "readings");
  fs::create_symlink(folder_ / "log", folder_ / "link");
  fs::create_hard_link(folder_ / "log", folder_ / "other");
  note_input(folder_ / "log");
  note_input(folder_ / "missing");
  for (const char* name : {"log", "link", "other"}) {
    expect_refused(folder_ / name);
    EXPECT_EQ(read_file(folder_ / name), "readings");
  }
  EXPECT_NO_THROW(write_file(folder_ / "missing", "new"));
}

TEST_F(Outputs, ANameOfTheGreatestLengthIsWritten) {
  const fs::path file = folder_ / (std::string(251, 'n') + ".csv");
  write_both_ways(file, "x");
  EXPECT_EQ(read_file(file), "x");
}

TEST_F(Outputs, WhatAKilledProcessLeftIsNotInTheWayAndGoesWithTheNextWriteToThatName) {
  const fs::path file = old_file("table.csv");
  const pid_t child = fork();
  if (child == 0) {
    new Output(file);  // NOLINT: the process is killed before it could be freed
    raise(SIGKILL);
  }
  waitpid(child, nullptr, 0);
  EXPECT_GT(entries(), 1);
  const auto left = [&](const std::string& name) { std::ofstream(folder_ / name) << "left"; };
  left("table.csv.part-" + std::to_string(::getppid()));          // of a process that may still write
  left("table.csv.part-" + std::to_string(::getpid()) + ".csv");  // of one that had our number
  left("table.csv.part-99x");
  left("another.csv.part-4194999");
  write_both_ways(file, "new");
  EXPECT_EQ(read_file(file), "new");
  EXPECT_EQ(entries(), 5) << "nobody else's";
}

// A limit on the size of files stands for a disk that is full in the middle of a write.
TEST_F(Outputs, AWriteThatStopsHalfwayLeavesTheOldFileAndNothingElse) {
  const fs::path file = old_file();
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{1000, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  const std::string message = refusal_of<JobError>([&] { write_file(file, std::string(100000, 'x')); });
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(message, file.string() + ": cannot be written: File too large");
  EXPECT_EQ(read_file(file), "old");
  EXPECT_EQ(entries(), 1);
}

}  // namespace
}  // namespace flexor::io
