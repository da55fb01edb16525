#include "host/deploy/out_folder.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <functional>
#include <random>

#include "host/deploy/pair_key.hpp"

namespace flexor::deploy {
namespace {

namespace fs = std::filesystem;

class OutFolderTest : public testing::Test {
 protected:
  // What deploy does, without the compiler: every image is its key.
  static void deploy_once(
      const fs::path& folder, const std::function<void()>& before_publishing = [] {}) {
    OutFolder out(folder);
    const link::Key key = new_key();
    for (const char* image : {"glove.hex", "hand.hex", "wiring.md", "results.json", "report.json"})
      io::write_file(out.staging() / image, to_hex(key));
    io::make_folder(out.staging() / "arduino/Flexor/src");
    io::write_file(out.staging() / "arduino/Flexor/src/glove_data.h", to_hex(key));
    write_key(out.staging() / kKeyFile, key);
    before_publishing();
    out.publish();
  }

  // All images that are there have the key that is there. Returns how many there are.
  int expect_matching() const {
    int images = 0;
    for (const auto& entry : fs::recursive_directory_iterator(folder_)) {
      const fs::path relative = fs::relative(entry.path(), folder_);
      if (!entry.is_regular_file() || relative.string().starts_with(".") || relative == kKeyFile ||
          relative == "lock")
        continue;
      ++images;
      EXPECT_EQ(io::read_file(entry.path()), to_hex(load_key(folder_ / kKeyFile))) << relative;
    }
    return images;
  }

  const io::TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path() / "out";
};

TEST_F(OutFolderTest, ImagesHaveTheKeyBesideThemWheneverARunIsKilled) {
  deploy_once(folder_);
  ASSERT_EQ(expect_matching(), 6);
  std::mt19937 random(1);
  int cut = 0;
  for (int round = 0; round < 60 || (cut == 0 && round < 1000); ++round) {
    std::array<int, 2> ready{};
    ASSERT_EQ(pipe(ready.data()), 0);
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      for (;;) deploy_once(folder_, [&] { (void)!write(ready[1], "!", 1); });
    }
    char signal = 0;
    ASSERT_EQ(read(ready[0], &signal, 1), 1);
    // Some before, most within, some after the fraction of a millisecond that it takes.
    usleep(static_cast<useconds_t>(random() % 600));
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    for (const int end : ready) close(end);
    cut += expect_matching() < 6 ? 1 : 0;
    { OutFolder next(folder_); }
    EXPECT_EQ(expect_matching(), 6) << "the next run ends what was cut off";
  }
  EXPECT_GT(cut, 0) << "no run was cut off between the old images and the new";
  deploy_once(folder_);
  EXPECT_EQ(expect_matching(), 6);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 7) << "what was cut off is cleared away";
}

TEST_F(OutFolderTest, WithoutPublishingNothingHasHappened) {
  { OutFolder out(folder_); }
  EXPECT_FALSE(fs::exists(folder_));
  deploy_once(folder_);
  const std::string before = io::read_file(folder_ / "glove.hex");
  {
    OutFolder out(folder_);
    io::write_file(out.staging() / "glove.hex", "new");
  }
  EXPECT_EQ(io::read_file(folder_ / "glove.hex"), before);
  EXPECT_EQ(expect_matching(), 6);
}

TEST_F(OutFolderTest, APublishThatFailsLosesNothing) {
  deploy_once(folder_);
  const std::string before = io::read_file(folder_ / "glove.hex");
  const auto in_the_way = [&] {
    for (const auto& entry : fs::directory_iterator(folder_)) {
      const fs::path path = entry.path();
      if (path.filename().string().starts_with(".")) fs::create_directories(path / "old/hand.hex/full");
    }
  };
  EXPECT_THROW(deploy_once(folder_, in_the_way), io::InputError);
  EXPECT_EQ(io::read_file(folder_ / "glove.hex"), before);
  EXPECT_EQ(expect_matching(), 6);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 7) << "and nothing is left over";
}

TEST_F(OutFolderTest, APublishThatFailsBetweenOldAndNewIsEndedByTheNext) {
  EXPECT_THROW(deploy_once(folder_, [&] { io::write_file(folder_ / "arduino", "in the way"); }),
               io::InputError);
  fs::remove(folder_ / "arduino");
  { OutFolder next(folder_); }
  EXPECT_EQ(expect_matching(), 6);
}

TEST_F(OutFolderTest, TwoRunsInOneFolderAreRefused) {
  OutFolder one(folder_);
  EXPECT_THROW(OutFolder{folder_}, io::InputError);
}

TEST_F(OutFolderTest, LeavesOtherFilesAloneAndRefusesAFolderInAnImagesPlace) {
  deploy_once(folder_);
  io::write_file(folder_ / "notes.txt", "mine");
  io::write_file(folder_ / "arduino/mine.ino", "mine");
  deploy_once(folder_);
  EXPECT_EQ(io::read_file(folder_ / "notes.txt"), "mine");
  EXPECT_EQ(io::read_file(folder_ / "arduino/mine.ino"), "mine");
  fs::remove(folder_ / "hand.hex");
  fs::create_directory(folder_ / "hand.hex");
  EXPECT_THROW(OutFolder{folder_}, io::InputError);
}

}  // namespace
}  // namespace flexor::deploy
