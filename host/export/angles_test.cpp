#include "host/export/angles.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "host/export/test_recording.hpp"
#include "host/io/refusal_test.hpp"

namespace flexor::exports {
namespace {

std::vector<AngleRow> all_of(Angles& angles) {
  std::vector<AngleRow> rows;
  for (AngleRow row; angles.next(row);) rows.push_back(row);
  return rows;
}

TEST(Angles, AreTheColumnsWithAnAnglesUnitInDegrees) {
  const TestRecording log(
      "t_s,index_mcp_deg,index_mcp_status,index_mcp_se_deg,Thumb (rad),host_s,flex_count\n"
      "0,10,0,1,1,5,512\n0.1,11,0,1,2,5.1,513\n");
  Angles angles(log.path(), {});
  EXPECT_EQ(angles.joints(), (std::vector<std::string>{"index_mcp", "Thumb"}));
  const auto rows = all_of(angles);
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[1].t_s, 0.1);
  EXPECT_EQ(rows[1].angle_deg[0], 11);
  EXPECT_NEAR(rows[1].angle_deg[1], 114.59155902616465, 1e-12);
}

TEST(Angles, CanBeNamedAndCalledOtherwise) {
  const TestRecording log("t_s,bend,index_deg\n0,10,1\n0.1,11,2\n");
  AngleOptions options;
  options.columns = {"bend"};
  options.names = {"bend=finger flexion"};
  Angles angles(log.path(), options);
  EXPECT_EQ(angles.joints(), std::vector<std::string>{"finger flexion"});
  EXPECT_EQ(all_of(angles)[0].angle_deg, std::vector<double>{10});
  EXPECT_NE(angles.notes().at(0).find("taken as degrees"), std::string::npos);
}

TEST(Angles, ThatACameraLostAreNotKnown) {
  const TestRecording log("t_s,a_deg,a_quality\n0,10,0\n0.1,11,3\n0.2,12,2\n");
  Angles angles(log.path(), {});
  const auto rows = all_of(angles);
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows[0].angle_deg[0], 10);
  EXPECT_TRUE(std::isnan(rows[1].angle_deg[0]));
  EXPECT_EQ(rows[2].angle_deg[0], 12);
}

TEST(Angles, TimesRiseStrictly) {
  const TestRecording log("t_s,a_deg\n0,1\n0.1,2\n0.1,3\n0.2,4\n0.3,5\n");
  Angles angles(log.path(), {});
  const auto rows = all_of(angles);
  ASSERT_EQ(rows.size(), 4u);
  for (std::size_t i = 1; i < rows.size(); ++i) EXPECT_GT(rows[i].t_s, rows[i - 1].t_s);
  EXPECT_NE(angles.notes().at(0).find("time of the row before"), std::string::npos);
}

TEST(Angles, WithARateStandOnItsGridAndPausesAreNotKnown) {
  std::string text = "t_s,a_deg\n";
  for (int i = 0; i < 20; ++i) text += std::to_string(0.05 * i) + "," + std::to_string(i) + "\n";
  for (int i = 0; i < 20; ++i)
    text += std::to_string(21.02 + 0.05 * i) + ",7\n";  // the resampler begins anew
  const TestRecording log(text);
  AngleOptions options;
  options.rate_hz = 10;
  Angles angles(log.path(), options);
  const auto rows = all_of(angles);
  ASSERT_GT(rows.size(), 210u);
  ASSERT_LT(rows.size(), 222u);
  for (std::size_t i = 0; i < rows.size(); ++i) EXPECT_NEAR(rows[i].t_s, 0.1 * static_cast<double>(i), 1e-9);
  EXPECT_EQ(rows[0].angle_deg[0], 0);
  EXPECT_EQ(rows[1].angle_deg[0], 1.5);
  EXPECT_TRUE(std::isnan(rows[100].angle_deg[0]));
  EXPECT_EQ(rows[212].angle_deg[0], 7);
}

TEST(Angles, DatesAreToldFromSeconds) {
  for (const std::string date : {"", "2026-05-01T12:00:0"}) {
    const TestRecording log((date.empty() ? "t_s" : "time") + fmt::format(",a_deg\n{0}0,1\n{0}1,2\n", date));
    Angles angles(log.path(), {});
    all_of(angles);
    EXPECT_EQ(angles.is_dated(), !date.empty());
  }
}

void expect_refused(const std::string& text, const AngleOptions& options, const std::string& part) {
  const TestRecording log(text);
  const std::string what = io::refusal_of([&] {
    Angles angles(log.path(), options);
    all_of(angles);
  });
  EXPECT_NE(what.find(part), std::string::npos) << what;
  EXPECT_EQ(what.find('\n'), std::string::npos);
}

TEST(Angles, ThatStateNoUnitAreLeftOutAloud) {
  const TestRecording log("t_s,a_deg,bend,a_status,host_s,flex_count\n0,1,2,0,0,5\n1,2,3,0,1,5\n");
  Angles angles(log.path(), {});
  EXPECT_EQ(angles.joints(), std::vector<std::string>{"a"});
  ASSERT_EQ(angles.notes().size(), 1U);
  EXPECT_EQ(angles.notes()[0],
            log.path().string() + ": left out, as no unit is stated: bend; --columns names them");
}

TEST(Angles, RefuseInOneLineWhatIsNoAngle) {
  expect_refused("t_s,flex\n0,1\n1,2\n", {}, "--columns; there are flex");
  expect_refused("t_s,flex_V\n0,1\n1,2\n", {{"flex_V"}, {}, {}, 0}, "is in V");
  expect_refused("t_s,a_deg\n0,1\n1,2\n", {{"b_deg"}, {}, {}, 0}, "b_deg");
  expect_refused("t_s,a_deg,a_rad\n0,1,1\n1,2,1\n", {}, "two columns are the joint a");
  expect_refused("t_s,a_deg\n0,1\n1,2\n", {{}, {"b=c"}, {}, 0}, "no joint b; there are a");
  expect_refused("t_s,a_deg\n0,1\n1,2\n", {{}, {"a="}, {}, 0}, "OLD=NEW");
  expect_refused("t_s,a_deg\n0,1\n1,inf\n", {}, "inf");
  std::string pause = "t_s,a_deg\n";
  for (int i = 0; i < 9; ++i) pause += std::to_string(i) + ",1\n";
  for (int i = 0; i < 9; ++i) pause += std::to_string(8000 + i) + ",1\n";
  expect_refused(pause, {{}, {}, {}, 100}, "export the parts one by one");
}

}  // namespace
}  // namespace flexor::exports
