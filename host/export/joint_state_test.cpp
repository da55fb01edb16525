#include "host/export/joint_state.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include <cmath>
#include <numbers>

#include "host/io/expect_test.hpp"
#include "host/io/io.hpp"

namespace flexor::exports {
namespace {

// A CSV file for the time being, and a place beside it.
class TestRecording {
 public:
  explicit TestRecording(const std::string& text) { io::write_file(path(), text); }
  std::filesystem::path path() const { return beside("log.csv"); }
  std::filesystem::path beside(const std::string& name) const { return folder_.path() / name; }

 private:
  io::TemporaryFolder folder_;
};

std::string hex(const std::string& bytes) {
  std::string out;
  for (const char c : bytes) out += fmt::format("{:02x}", static_cast<unsigned char>(c));
  return out;
}

// Other names: python/tests/test_export.py, byte for byte beside ROS's own writer.
TEST(JointStates, AMessageHasTheBytesOfFastCdr) {
  std::string bytes;
  JointStates states([&](std::string_view more) { bytes += more; }, {"a", "bcd"}, 1);
  const double angles[] = {180 / std::numbers::pi, 0};
  states.add(0, angles);
  states.add(2e-9, angles);
  states.flush();
  EXPECT_NE(hex(bytes).find("00010000"                          // little endian
                            "01000000020000000100000000000000"  // stamp, frame_id, up to a multiple of 4
                            "02000000020000006100000004000000"  // two names
                            "6263640002000000"  // two positions, which begin at a multiple of 8
                            "000000000000f03f00000000000000000000000000000000"),  // no velocity, no effort
            std::string::npos);
}

TEST(JointStates, AStampEndsIn2038) {
  JointStates states([](std::string_view) {}, {"a"}, 2147483647.5);
  const double angle = 1;
  EXPECT_NO_THROW(states.add(0, {&angle, 1}));
  EXPECT_THROW(states.add(0.5, {&angle, 1}), io::JobError);
}

// What is kept for each chunk is little, and chunks are few.
TEST(JointStates, AreGivenOutAChunkAtATime) {
  std::size_t given = 0;
  std::size_t most = 0;
  JointStates states(
      [&](std::string_view bytes) {
        ++given;
        most = std::max(most, bytes.size());
      },
      std::vector<std::string>(20, "joint"), 0);
  constexpr std::size_t kMessage = 31 + 12 + 8 + 4 + 20 * 12 + 4 + 20 * 8 + 8;  // bytes, about
  for (int i = 0; i < 20'000; ++i) states.add(i, std::vector<double>(20, 1));
  EXPECT_GE(given, 1 + 20'000 * kMessage * 9 / 10 / JointStates::kChunk);
  EXPECT_LE(given, 1 + 20'000 * kMessage * 11 / 10 / JointStates::kChunk);
  EXPECT_LT(most, JointStates::kChunk * 12 / 10);
  states.close();
}

TEST(JointStateFile, GrowsByAChunkEachSecond) {
  const TestRecording place("x");
  const auto size = [&] { return std::filesystem::file_size(place.beside("live.mcap")); };
  std::uintmax_t one = 0;
  {
    JointStateFile file(place.beside("live.mcap"), {"a", "b"});
    const double angles[] = {1, NAN};
    const auto head = size();
    for (int i = 0; i < 100; ++i) file.add(5 + 0.01 * i, angles);
    EXPECT_EQ(size(), head) << "not yet a second";
    file.add(6.001, angles);
    one = size();
    EXPECT_GT(one, head + 101 * (16 + 31));
    for (int i = 1; i < 100; ++i) file.add(6.001 + 0.01 * i, angles);
    EXPECT_EQ(size(), one);
  }
  EXPECT_GT(size(), one);
  EXPECT_THROW(JointStateFile(place.beside("live.mcap"), {"a"}), io::InputError);
  EXPECT_THROW(JointStateFile(place.beside("no") / "live.mcap", {"a"}), io::InputError);
}

// A limit on the size of files stands for a disk that is full.
TEST(JointStateFile, AFullDiskLeavesWholeChunks) {
  const TestRecording place("x");
  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = ::signal(SIGXFSZ, SIG_IGN);
  JointStateFile file(place.beside("live.mcap"), {"a", "b"});
  const double angles[] = {1, 2};
  std::uintmax_t whole = 0;
  const rlimit limit{20'000, before.rlim_max};
  ::setrlimit(RLIMIT_FSIZE, &limit);
  const std::string refused = io::refusal_of<io::JobError>([&] {
    for (int i = 0; i < 10'000; ++i) {
      file.add(0.01 * i, angles);
      if (i % 100 == 1) whole = std::filesystem::file_size(place.beside("live.mcap"));
    }
  });
  ::setrlimit(RLIMIT_FSIZE, &before);
  ::signal(SIGXFSZ, handler);
  EXPECT_NE(refused.find("what came before is whole"), std::string::npos) << refused;
  EXPECT_THROW(file.add(1000, angles), io::JobError) << "nothing goes behind what is missing";
  EXPECT_GT(whole, 0u);
  EXPECT_EQ(std::filesystem::file_size(place.beside("live.mcap")), whole);
}

TEST(JointStates, OfARecordingAreWrittenWholeOrNotAtAll) {
  const TestRecording log("t_s,a_deg\n0,1\n0.5,2\n0.5,3\n");
  const Written done = write_joint_states(log.path(), {}, log.beside("a.mcap"));
  EXPECT_EQ(done.rows, 2u);
  EXPECT_EQ(done.joints, std::vector<std::string>{"a"});
  EXPECT_NE(done.notes.back().find("1 row(s) have the time of the row before"), std::string::npos);
  const std::string before = io::read_file(log.beside("a.mcap"));
  const TestRecording bad("t_s,a_deg\n0,1\n0.5,x\n1,2\n");
  EXPECT_THROW((void)write_joint_states(bad.path(), {}, log.beside("a.mcap")), io::InputError);
  EXPECT_EQ(io::read_file(log.beside("a.mcap")), before);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(log.path().parent_path()), {}), 2);
}

// As radians: 10 of flexion from a camera's 170 at the open hand and 80 at the fist.
TEST(JointStates, AreFlexionByTheEndsOfTheirJointsUnlessTheyAreHeld) {
  const TestRecording log("t_s,index_deg,index_status,index_se_deg\n0,160,0,1\n");
  const TestRecording held("t_s,index_deg,index_status,index_se_deg\n0,160,2,1\n");
  RecordedOptions options;
  options.ends_deg = {{"index", {170, 80}}};
  options.names = {"index=finger"};
  EXPECT_EQ(write_joint_states(log.path(), options, log.beside("a.mcap")).joints,
            std::vector<std::string>{"finger"});
  const double angle_rad = 10 * (std::numbers::pi / 180);
  const std::string bytes(reinterpret_cast<const char*>(&angle_rad), sizeof angle_rad);
  EXPECT_NE(io::read_file(log.beside("a.mcap")).find(bytes), std::string::npos);
  (void)write_joint_states(held.path(), options, held.beside("a.mcap"));
  EXPECT_EQ(io::read_file(held.beside("a.mcap")).find(bytes), std::string::npos);
}

TEST(JointStates, RefuseInOneLineWhatIsNoAngle) {
  const auto expect = [](const std::string& text, const RecordedOptions& options, const std::string& part) {
    const TestRecording log(text);
    io::expect_refused([&] { (void)write_joint_states(log.path(), options, log.beside("a.mcap")); }, part);
  };
  expect("t_s,flex\n0,1\n1,2\n", {}, "NAME_deg or NAME_rad; there are flex");
  expect("t_s,a_deg,a_rad\n0,1,1\n1,2,1\n", {}, "two columns are the joint a");
  expect("t_s,a_deg\n0,1\n", {{"b=c"}, {}}, "no joint b; there are a");
  expect("t_s,a_deg\n0,1\n", {{"a="}, {}}, "OLD=NEW");
  expect("t_s,a_deg\n0,1\n", {{}, {}, {{"b", {0, 90}}}}, "--model has no joint a");
}

}  // namespace
}  // namespace flexor::exports
