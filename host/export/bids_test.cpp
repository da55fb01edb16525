#include "host/export/bids.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "host/export/test_recording.hpp"
#include "host/io/refusal_test.hpp"

namespace flexor::exports {
namespace {

namespace fs = std::filesystem;

constexpr const char* kEven = "t_s,index_deg,index_quality\n0,1.5,0\n0.01,2,3\n0.02,3,0\n0.03,4,0\n";

std::string name(const std::string& subject, const std::string& end) {
  return "sub-" + subject + "/motion/sub-" + subject + "_task-motion_tracksys-glove" + end;
}

TEST(Bids, IsADatasetOfItsOwn) {
  const TestRecording log(kEven);
  const fs::path set = log.beside("set");
  const Written done = write_bids({log.path()}, {}, {}, set.string() + "/");
  EXPECT_EQ(io::read_file(set / name("01", "_motion.tsv")),
            "1.5\t0.000000\nn/a\t0.010000\n3\t0.020000\n4\t0.030000\n");
  EXPECT_EQ(io::read_file(set / name("01", "_channels.tsv")),
            "name\tcomponent\ttype\ttracked_point\tunits\nindex\tn/a\tJNTANG\tindex\tdeg\n"
            "latency\tn/a\tLATENCY\tn/a\ts\n");
  EXPECT_EQ(io::read_file(set / "participants.tsv"), "participant_id\nsub-01\n");
  const auto json = nlohmann::json::parse(io::read_file(set / name("01", "_motion.json")));
  EXPECT_NEAR(json.at("SamplingFrequency").get<double>(), 100, 1e-9);
  EXPECT_EQ(json.at("JNTANGChannelCount"), 1);
  EXPECT_EQ(json.at("LATENCYChannelCount"), 1);
  EXPECT_EQ(json.at("MotionChannelCount"), 2) << "as many as motion.tsv has columns";
  EXPECT_EQ(json.at("TrackedPointsCount"), 1) << "time is no point";
  EXPECT_EQ(done.files.size(), 3u);
  EXPECT_EQ(log.files(), 10u) << "the recording, three folders and six files, and nothing of the staging";
}

TEST(Bids, TakesSubjectsAndRunsOneByOneAndChangesNothingThatIsThere) {
  const TestRecording log(kEven);
  const fs::path set = log.beside("set");
  (void)write_bids({log.path()}, {}, {}, set);
  io::write_file(set / "participants.tsv", "participant_id\tage\nsub-01\t30\n");
  io::write_file(set / "README.md", "mine");
  (void)write_bids({log.path(), log.path()}, {}, {"02", "motion", 0}, set);
  (void)write_bids({log.path()}, {}, {"02", "motion", 3}, set);
  EXPECT_EQ(io::read_file(set / "participants.tsv"), "participant_id\tage\nsub-01\t30\nsub-02\tn/a\n");
  EXPECT_EQ(io::read_file(set / "README.md"), "mine");
  for (const char* run : {"1", "2", "3"})
    EXPECT_TRUE(fs::exists(set / name("02", std::string("_run-") + run + "_motion.tsv"))) << run;
  const std::size_t before = log.files();
  EXPECT_THROW((void)write_bids({log.path()}, {}, {}, set), io::InputError);
  EXPECT_THROW((void)write_bids({log.path()}, {}, {"02", "motion", 2}, set), io::InputError);
  EXPECT_EQ(log.files(), before);
}

TEST(Bids, PutsUnevenLogsOntoAGridWhenToldARate) {
  const TestRecording log("t_s,a_deg\n0,1\n0.01,2\n0.04,3\n0.05,4\n0.06,5\n");
  EXPECT_THROW((void)write_bids({log.path()}, {}, {}, log.beside("set")), io::InputError);
  EXPECT_EQ(log.files(), 1u) << "nothing is left of it";
  AngleOptions options;
  options.rate_hz = 50;
  (void)write_bids({log.path()}, options, {}, log.beside("set"));
  EXPECT_EQ(io::read_file(log.beside("set") / name("01", "_motion.tsv")),
            "1\t0.000000\n2\t0.020000\n3\t0.040000\n4.5\t0.060000\n");
  const auto json = nlohmann::json::parse(io::read_file(log.beside("set") / name("01", "_motion.json")));
  EXPECT_EQ(json.at("SamplingFrequency"), 50);
}

TEST(Bids, TakesAClockInWholeMillisecondsForEven) {
  const TestRecording log("time_ms,a_deg\n0,1\n17,2\n33,3\n50,4\n67,5\n83,6\n100,7\n");
  EXPECT_NEAR(write_bids({log.path()}, {}, {}, log.beside("set")).rate_hz, 60, 1e-9);
}

// Rows whose steps are `first_ms` in the first half, `second_ms` in the second.
std::string of_two_rates(int rows, double first_ms, double second_ms) {
  std::string text = "time_ms,a_deg\n";
  double t_ms = 2000;
  for (int k = 0; k < rows; ++k) {
    text += fmt::format("{:.3f},{}\n", t_ms, k);
    t_ms += 2 * k < rows ? first_ms : second_ms;
  }
  return text;
}

TEST(Bids, RefusesStepsThatAreEvenEnoughAndAddUpToSeconds) {
  const TestRecording log(of_two_rates(6000, 11.2, 8.8));
  const std::string what = io::refusal_of([&] { (void)write_bids({log.path()}, {}, {}, log.beside("set")); });
  EXPECT_NE(what.find("3.6 s from its place"), std::string::npos) << what;
  EXPECT_NE(what.find("--rate 100"), std::string::npos) << what;
  EXPECT_EQ(log.files(), 1u) << "nothing is left of it";
}

TEST(Bids, KeepsTheTimesOfARecordingWhoseRateDriftsALittle) {
  const TestRecording log(of_two_rates(6, 10.5, 9.5));
  (void)write_bids({log.path()}, {}, {}, log.beside("set"));
  EXPECT_EQ(io::read_file(log.beside("set") / name("01", "_motion.tsv")),
            "0\t0.000000\n1\t0.010500\n2\t0.021000\n3\t0.031500\n4\t0.041000\n5\t0.050500\n");
}

TEST(Bids, RefusesInOneLine) {
  const TestRecording log(kEven);
  const auto refused = [&](const AngleOptions& angles, const BidsOptions& options, const fs::path& folder,
                           const std::string& part) {
    const std::string what = io::refusal_of([&] { (void)write_bids({log.path()}, angles, options, folder); });
    EXPECT_NE(what.find(part), std::string::npos) << what;
  };
  refused({}, {"a_b", "motion", 0}, log.beside("set"), "--subject a_b");
  refused({}, {"01", "", 0}, log.beside("set"), "--task");
  refused({}, {"../x", "motion", 0}, log.beside("set"), "letters and digits");
  refused({}, {}, log.path(), "needs a folder");
  refused({}, {}, log.beside("no") / "set", "cannot be written");
  fs::create_directory(log.beside("other"));
  io::write_file(log.beside("other") / "mine.txt", "x");
  refused({}, {}, log.beside("other"), "no BIDS dataset");
  AngleOptions latency;
  latency.names = {"index=latency"};
  refused(latency, {}, log.beside("set"), "a joint is called latency");
  EXPECT_EQ(log.files(), 3u);
}

TEST(Bids, OneRowNeedsARate) {
  const TestRecording log("t_s,a_deg\n0,1\n");
  EXPECT_THROW((void)write_bids({log.path()}, {}, {}, log.beside("set")), io::InputError);
  AngleOptions options;
  options.rate_hz = 50;
  EXPECT_EQ(write_bids({log.path()}, options, {}, log.beside("set")).rows, 1u);
}

}  // namespace
}  // namespace flexor::exports
