#include "host/export/mot.hpp"

#include <gtest/gtest.h>

#include "host/export/test_recording.hpp"

namespace flexor::exports {
namespace {

TEST(Mot, IsWhatOpenSimReads) {
  const TestRecording log(
      "t_s,index_mcp_deg,odd name_deg,odd name_quality\n1.5,10.25,0.1,0\n1.505,7,7,3\n1.51,-3,0.2,2\n");
  const Written done = write_mot(log.path(), {}, log.beside("hand.mot"));
  EXPECT_EQ(io::read_file(log.beside("hand.mot")),
            "hand\nversion=1\nnRows=2\nnColumns=3\ninDegrees=yes\nendheader\n"
            "time\tindex_mcp\todd_name\n"
            "1.5\t10.25\t0.1\n"
            "1.51\t-3\t0.2\n");
  EXPECT_EQ(done.rows, 2u);
  EXPECT_NE(done.notes.back().find("1 row(s)"), std::string::npos) << done.notes.back();
  EXPECT_NEAR(done.seconds, 0.01, 1e-12);
}

TEST(Mot, AnglesBecomeFlexionByTheEndsOfTheirJoints) {
  const TestRecording log("t_s,index_deg,thumb_deg\n0,170,0\n1,90,30\n");
  AngleOptions options;
  options.ends_deg = {{"index", {170, 80}}, {"thumb", {-10, 45}}};
  (void)write_mot(log.path(), options, log.beside("a.mot"));
  EXPECT_TRUE(io::read_file(log.beside("a.mot")).ends_with("\n0\t0\t10\n1\t80\t40\n"));
  options.ends_deg.erase("thumb");
  EXPECT_THROW((void)write_mot(log.path(), options, log.beside("a.mot")), io::InputError);
}

TEST(Mot, OneRowIsAMotion) {
  const TestRecording log("t_s,a_deg\n0,1\n");
  EXPECT_EQ(write_mot(log.path(), {}, log.beside("a.mot")).rows, 1u);
  EXPECT_TRUE(io::read_file(log.beside("a.mot")).ends_with("time\ta\n0\t1\n"));
}

TEST(Mot, NothingKnownIsRefused) {
  const TestRecording log("t_s,a_deg,a_quality\n0,1,3\n1,2,3\n");
  EXPECT_THROW((void)write_mot(log.path(), {}, log.beside("a.mot")), io::InputError);
}

TEST(Mot, RefusesAndLeavesWhatWasThere) {
  const TestRecording log("t_s,a b_deg,a_b_deg\n0,1,2\n1,2,3\n");
  io::write_file(log.beside("a.mot"), "old");
  EXPECT_THROW((void)write_mot(log.path(), {}, log.beside("a.mot")), io::InputError);
  EXPECT_THROW((void)write_mot("-", {}, log.beside("a.mot")), io::InputError);
  AngleOptions time;
  time.columns = {"a b_deg"};
  time.names = {"a b=time"};
  EXPECT_THROW((void)write_mot(log.path(), time, log.beside("a.mot")), io::InputError);
  EXPECT_EQ(io::read_file(log.beside("a.mot")), "old");
  EXPECT_EQ(log.files(), 2u);
}

}  // namespace
}  // namespace flexor::exports
