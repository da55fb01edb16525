#include "host/posture/complete.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <sstream>

#include "host/io/expect_test.hpp"
#include "host/posture/complete_file.hpp"
#include "host/posture/people_test.hpp"

namespace flexor::posture {
namespace {

using Eigen::Index;
using test::Recorded;
using test::table_of;

const Posture& known() {
  static const Posture posture = test::posture(5, 1);
  return posture;
}

const std::vector<Input>& bends() {
  static const std::vector<Input> inputs = {
      {"thumb", {1, 2}}, {"index", {4, 5}}, {"middle", {8, 9}}, {"ring", {12, 13}}, {"pinky", {16, 17}}};
  return inputs;
}

Completer new_stranger() { return Completer(known(), bends(), false); }

Eigen::VectorXd readings_of(const Recorded& r, Index row) {
  return input_matrix(bends()) * r.hands_deg.row(row).transpose();
}

TEST(Completing, ClaimsErrorsThatStrangersHave) {
  Completer stranger = new_stranger();
  double inside_68 = 0;
  double inside_95 = 0;
  double square = 0;
  double rows = 0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    const Recorded r = test::person(900 + seed, 10);
    for (Index row = 5; row < r.hands_deg.rows(); row += 12, ++rows) {
      const Estimate e = stranger.complete(readings_of(r, row));
      const Hand error = (e.angle_deg - r.hands_deg.row(row).transpose().array()).abs();
      inside_68 += (error <= e.se_deg).cast<double>().mean();
      inside_95 += (error <= 1.96 * e.se_deg).cast<double>().mean();
      square += error.square().mean();
    }
  }
  EXPECT_GT(inside_68 / rows, 0.62);
  EXPECT_LT(inside_68 / rows, 0.76);
  EXPECT_GT(inside_95 / rows, 0.92);
  EXPECT_LT(inside_95 / rows, 0.98);
  EXPECT_LT(std::sqrt(square / rows), 10.5);  // offsets of 6 degrees and splits cannot be known
  EXPECT_GT(std::sqrt(square / rows), 6);
}

TEST(Completing, KeepsTheSensedSum) {
  Completer stranger = new_stranger();
  for (const std::uint64_t seed : {76U, 77U, 78U, 79U}) {
    const Recorded r = test::person(seed);
    for (Index row = 0; row < r.hands_deg.rows(); row += 11) {
      const Eigen::VectorXd readings = readings_of(r, row);
      const Estimate e = stranger.complete(readings);
      const Eigen::VectorXd off = input_matrix(bends()) * e.angle_deg.matrix() - readings;
      for (Index i = 0; i < off.size(); ++i) {
        if (e.quality[static_cast<std::size_t>(i)] != Quality::used) continue;
        EXPECT_LT(std::abs(off[i]), 1e-6) << "row " << row << ", bend " << i;
      }
    }
  }
}

TEST(Completing, AJointAtItsLimitLeavesTheRestToTheOther) {
  const Limits& limits = known().limits;
  const double low_deg = limits.low_deg[4] + limits.low_deg[5];
  const double high_deg = limits.high_deg[4] + limits.high_deg[5];
  Completer index(known(), {bends()[1]}, false);
  int at_one = 0;
  for (double bend_deg = low_deg; bend_deg <= high_deg; bend_deg += 1) {
    const Estimate e = index.complete(Eigen::VectorXd::Constant(1, bend_deg));
    EXPECT_EQ(e.quality[0], Quality::used);
    EXPECT_NEAR(e.angle_deg[4] + e.angle_deg[5], bend_deg, 1e-6);
    const bool mcp = e.angle_deg[4] <= limits.low_deg[4] || e.angle_deg[4] >= limits.high_deg[4];
    const bool pip = e.angle_deg[5] <= limits.low_deg[5] || e.angle_deg[5] >= limits.high_deg[5];
    at_one += mcp != pip ? 1 : 0;
  }
  EXPECT_GT(at_one, 10);
  const Estimate beyond = index.complete(Eigen::VectorXd::Constant(1, high_deg + 5));
  EXPECT_EQ(beyond.quality[0], Quality::beyond);
  EXPECT_NEAR(beyond.angle_deg[4], limits.high_deg[4], 1e-9);
  EXPECT_NEAR(beyond.angle_deg[5], limits.high_deg[5], 1e-9);
}

TEST(Completing, LeavesOutAStuckFingerUntilItMoves) {
  Completer stranger = new_stranger();
  const Recorded r = test::person(85);
  const double rest_deg = readings_of(r, 0)[2];
  double stuck = 0;
  double noticed = 0;
  double rows = 0;
  for (Index row = 0; row < 300; ++row) {
    Eigen::VectorXd readings = readings_of(r, row);
    if (row >= 60) readings[2] = rest_deg;
    const Estimate e = stranger.complete(readings);
    for (const std::size_t moving : {0U, 1U, 3U, 4U}) EXPECT_EQ(e.quality[moving], Quality::used) << row;
    if (row < 60) {
      EXPECT_EQ(e.quality[2], Quality::used) << row;
    }
    if (row < 240) continue;
    stuck += e.quality[2] == Quality::stuck ? 1 : 0;
    noticed += e.quality[2] != Quality::used ? 1 : 0;
    ++rows;
  }
  EXPECT_GT(stuck / rows, 0.3);  // or what it reads is implausible by then
  EXPECT_GT(noticed / rows, 0.95);
  EXPECT_EQ(stranger.complete(readings_of(r, 20)).quality[2], Quality::used);
  for (Index row = 0; row < 100; ++row) {  // a whole hand that rests is not stuck
    EXPECT_EQ(stranger.complete(readings_of(r, 20)).quality[2], Quality::used) << row;
  }
}

TEST(Completing, LearnsThePersonFromARestingPose) {
  Completer stranger = new_stranger();
  const Recorded r = test::person(78);
  Completer shown(known(), bends(), true);
  for (Index row = 0; row < 5; ++row) shown.show(r.hands_deg.row(row).transpose(), 0.1);
  double before = 0;
  double after = 0;
  for (Index row = 30; row < r.hands_deg.rows(); row += 7) {
    const Hand hand = r.hands_deg.row(row).transpose();
    before += (stranger.complete(readings_of(r, row)).angle_deg - hand).square().mean();
    after += (shown.complete(readings_of(r, row)).angle_deg - hand).square().mean();
  }
  EXPECT_LT(after, 0.8 * before);
  EXPECT_GT(after, 0.05 * before);
}

TEST(Completing, EstimatesALostFingerFromTheOthers) {
  Completer stranger = new_stranger();
  const Recorded r = test::person(79);
  Eigen::VectorXd readings = readings_of(r, 20);
  const Estimate whole = stranger.complete(readings);
  readings[2] = std::nan("");
  const Estimate lost = stranger.complete(readings);
  EXPECT_EQ(lost.quality[2], Quality::missing);
  EXPECT_EQ(lost.quality[1], Quality::used);
  EXPECT_GT(lost.se_deg[8], whole.se_deg[8]);
  EXPECT_LT(std::abs(lost.angle_deg[8] - r.hands_deg(20, 8)), 4 * lost.se_deg[8]);
  const Estimate none = stranger.complete(Eigen::VectorXd::Constant(5, std::nan("")));
  EXPECT_TRUE(none.angle_deg.isFinite().all());
  EXPECT_GT(none.se_deg[8], lost.se_deg[8]);
}

TEST(Completing, LeavesOutWhatCannotBe) {
  Completer stranger = new_stranger();
  const Recorded r = test::person(80);
  Eigen::VectorXd readings = readings_of(r, 20);
  const Estimate sound = stranger.complete(readings);
  for (const double wrong_deg : {-1000.0, 500.0}) {
    readings[1] = wrong_deg;
    const Estimate e = stranger.complete(readings);
    EXPECT_EQ(e.quality[1], Quality::implausible);
    EXPECT_EQ(e.quality[0], Quality::used);
    EXPECT_NEAR(e.angle_deg[4], sound.angle_deg[4], 60);
    EXPECT_TRUE((e.angle_deg >= known().limits.low_deg).all());
    EXPECT_TRUE((e.angle_deg <= known().limits.high_deg).all());
  }
}

TEST(Completing, WeighsANoisyFingerAgainstItsNeighbours) {
  const Recorded r = test::person(81);
  Completer completer(known(), bends(), false);
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise(0, 40);
  double taken = 0;
  double weighed = 0;
  double noisy = 0;
  double rows = 0;
  for (Index row = 5; row < 30; ++row) {
    for (int again = 0; again < 8; ++again, ++rows) {
      Eigen::VectorXd readings = readings_of(r, row);
      const double truth = readings[3];
      readings[3] += noise(random);
      const Estimate e = completer.complete(readings);
      taken += std::pow(readings[3] - truth, 2);
      weighed += std::pow(e.angle_deg[12] + e.angle_deg[13] - truth, 2);
      noisy += e.quality[3] == Quality::noisy ? 1 : 0;
      EXPECT_EQ(e.quality[1], Quality::used);
    }
  }
  EXPECT_GT(noisy / rows, 0.8);
  EXPECT_LT(weighed, 0.5 * taken);
}

const CompleteOptions kFive = {
    {"index_mcp_deg", "index_pip_deg", "thumb", "middle"},
    {"thumb=thumb_mcp+thumb_ip", "index=index_mcp+index_pip", "middle=middle_mcp+middle_pip"},
    0.5};

Completion completion_of(
    const std::string& content, const CompleteOptions& options,
    const std::function<void(const std::string&)>& sink = [](const auto&) {}) {
  std::istringstream stream(content);
  recording::CsvReader table(stream, "x.csv", {{}, {}, recording::Holes::all});
  return complete_table(known(), table, options, sink, [](auto) {});
}

std::vector<std::string> lines_of(const std::string& content, const CompleteOptions& options) {
  std::vector<std::string> lines;
  completion_of(content, options, [&](const std::string& line) { lines.push_back(line); });
  return lines;
}

std::vector<double> cells_of(const std::string& line) {
  std::vector<double> out;
  std::istringstream stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) out.push_back(std::stod(cell));
  return out;
}

TEST(CompletingTables, KnowsOnlyThePast) {
  const Recorded r = test::person(82);
  const auto whole = lines_of(table_of(r, 90, true), kFive);
  const auto part = lines_of(table_of(r, 50, true), kFive);
  ASSERT_EQ(whole.size(), 91U);
  ASSERT_EQ(part.size(), 51U);
  for (std::size_t i = 0; i < part.size(); ++i) EXPECT_EQ(part[i], whole[i]) << i;
  EXPECT_TRUE(whole[41].ends_with(",0,1,0\n")) << "the row with a hole reports it: " << whole[41];
  EXPECT_TRUE(whole[42].ends_with(",0,0,0\n")) << whole[42];
}

TEST(CompletingTables, WithoutAnyAngleOfTheHandIsRefused) {
  for (const char* cell : {"", "-4000"})
    EXPECT_THROW(
        completion_of(fmt::format("t_s,index_mcp_deg\n0,{0}\n0.1,{0}\n", cell), {{"index_mcp_deg"}, {}, 0}),
        io::InputError);
}

TEST(CompletingTables, TakesABendFromItsColumnOrItsJoints) {
  const Recorded r = test::person(83);
  std::string text = "t_s,index_deg\n";
  for (Index row = 0; row < 40; ++row)
    text += fmt::format(
        "{:.1f},{:.2f}\n", r.t_s[static_cast<std::size_t>(row)],
        std::round(100 * r.hands_deg(row, 4)) / 100 + std::round(100 * r.hands_deg(row, 5)) / 100);
  const auto column = lines_of(text, {{"index_deg"}, {"index=index_mcp+index_pip"}, 0});
  const auto joints =
      lines_of(table_of(r, 40), {{"index_mcp_deg", "index_pip_deg"}, {"index=index_mcp+index_pip"}, 0});
  EXPECT_EQ(column, joints);
}

// The first rows of a slow table: what comes later does not show the person.
TEST(CompletingTables, ARestEndsInASlowTableToo) {
  Recorded r = test::person(86);
  for (std::size_t i = 0; i < r.t_s.size(); ++i) r.t_s[i] = static_cast<double>(i);
  const CompleteOptions options = {{"index_mcp_deg", "index_pip_deg"}, {}, 2};
  const auto before = lines_of(table_of(r, 60), options);
  r.hands_deg.col(0).segment(20, 20).array() -= 40;  // thumb_rot, which is not sensed
  const auto after = lines_of(table_of(r, 60), options);
  EXPECT_EQ(before, after);
  const Completion c = completion_of(table_of(r, 60), options);
  EXPECT_TRUE(c.rest_ended);
  EXPECT_NEAR(c.shown_s, 1, 1e-9);
}

// The middle finger is shown at rest alone; what it did wrong in one row moves it no more than the row less does.
TEST(CompletingTables, OneWrongAngleAtRestMovesNothing) {
  const auto shown = [](double first_s, double wrong_deg) {
    Recorded r = test::person(5, 2);
    for (std::size_t i = 0; i < r.t_s.size(); ++i) r.t_s[i] = 0.1 * static_cast<double>(i);
    r.t_s[0] = first_s;
    if (wrong_deg != 0) r.hands_deg(5, 9) = wrong_deg;
    return cells_of(lines_of(table_of(r, 60), {{"index_mcp_deg"}, {}, 1.7}).back())[19];
  };
  const double sound = shown(0, 0);
  EXPECT_NEAR(shown(0, 9999), sound, 1.5);
  EXPECT_NEAR(shown(-1.7e9, 0), sound, 1.5) << "a clock that was set after the first row";
}

TEST(CompletingTables, FlexionMayBePositiveInBothTables) {
  const Recorded r = test::person(87);
  CompleteOptions options = {{"index", "middle_mcp", "wrist_yaw"}, {"index=index_mcp+index_pip"}, 0.5};
  const auto negative = lines_of(table_of(r, 60), options);
  Recorded turned = r;
  for (const int j : {1, 2, 4, 5, 6, 8, 9, 10, 12, 13, 14, 16, 17, 18}) turned.hands_deg.col(j) *= -1;
  options.flexion_is_positive = true;
  const auto positive = lines_of(table_of(turned, 60), options);
  ASSERT_EQ(positive.size(), negative.size());
  for (std::size_t row = 1; row < positive.size(); ++row) {
    const std::vector<double> one = cells_of(positive[row]);
    const std::vector<double> other = cells_of(negative[row]);
    for (std::size_t j = 0; j < kJoints; ++j) {
      const bool flexes =
          std::ranges::count(std::array<std::size_t, 9>{0, 3, 7, 11, 15, 19, 20, 21, 22}, j) == 0;
      EXPECT_EQ(one[1 + 2 * j], (flexes ? -1 : 1) * other[1 + 2 * j]);
      EXPECT_EQ(one[2 + 2 * j], other[2 + 2 * j]);
    }
  }
}

// A camera's 170 degrees at the open hand and 80 at the fist are 0 and 90 of flexion.
TEST(CompletingTables, AnglesBecomeFlexionByTheEndsOfTheirJoints) {
  const auto table = [](std::string_view rows) {
    return fmt::format("t_s,index_deg,thumb_ip_deg\n{}", rows);
  };
  CompleteOptions options = {{"index", "thumb_ip"}, {"index=index_mcp+index_pip"}, 0, true};
  const auto flexion = lines_of(table("0,0,5\n1,30,10\n2,90,40\n"), options);
  options.ends_deg = {{"index", {170, 80}}, {"thumb_ip", {-5, 60}}};
  EXPECT_EQ(lines_of(table("0,170,0\n1,140,5\n2,80,35\n"), options), flexion);
  options.ends_deg.erase("thumb_ip");
  io::expect_refused([&] { lines_of(table("0,170,0\n"), options); }, "no joint thumb_ip");
}

TEST(CompletingTables, ATableOfTheOtherSignIsNoticed) {
  Recorded r = test::person(88);
  const CompleteOptions options = {
      {"index_mcp", "index_pip", "middle_pip"}, {"index=index_mcp+index_pip"}, 0};
  EXPECT_TRUE(completion_of(table_of(r, 300), options).extended.empty());
  r.hands_deg *= -1;
  EXPECT_EQ(completion_of(table_of(r, 300), options).extended,
            (std::vector<std::string>{"index", "middle_pip"}));
}

TEST(CompletingTables, ReportsWhatIsWrong) {
  const std::string text = table_of(test::person(84), 3);
  const std::vector<std::string> index = {"index=index_mcp+index_pip"};
  for (const auto& [options, words] : std::vector<std::pair<CompleteOptions, const char*>>{
           {{{"toe_deg"}, {}, 0}, "--from: \"toe\" is no joint; joints are: thumb_rot"},
           {{{"index_mcp"}, {"index"}, 0}, "write NAME=JOINT+JOINT"},
           {{{"index_mcp"}, {"i=index_mcp+index_mcp"}, 0}, "a joint twice"},
           {{{"index_mcp_deg"}, index, 0}, "neither index_deg nor index_pip_deg"},
           {{{"i"}, {"i=index_mcp+wrist_yaw"}, 0, true}, "only joints that flex"},
           {{{"index_mcp", "index_mcp_deg"}, {}, 0}, "is there twice"}})
    io::expect_refused([&, &given = options] { completion_of(text, given); }, words);
}

}  // namespace
}  // namespace flexor::posture
