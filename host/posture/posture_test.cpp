#include "host/posture/posture.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "host/io/refusal_test.hpp"
#include "host/posture/learn.hpp"
#include "host/posture/regression.hpp"
#include "host/posture/test_people.hpp"
#include "host/recording/csv.hpp"

namespace flexor::posture {
namespace {

Posture learnt() {
  return learn(test::people(3, 1), 7, [](const auto&, auto, auto) {});
}

TEST(PostureDocument, RoundTripsExactly) {
  const std::string text = to_json(learnt());
  const Posture read = parse(text, "p.json");
  EXPECT_EQ(to_json(read), text);
  EXPECT_EQ(read.seed, 7U);
  ASSERT_EQ(read.people.size(), 3U);
  EXPECT_EQ(read.people[1].source, "person2.csv");
  EXPECT_GT(read.people[1].book.seconds.size(), 20);
}

TEST(PostureDocument, IsRefusedByNameWhereItIsWrong) {
  const std::string text = to_json(learnt());
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string other = text;
    other.replace(other.find(from), from.size(), to);
    return io::refusal_of([&] { parse(other, "p.json"); });
  };
  EXPECT_NE(changed("\"schema\":1", "\"schema\":2").find("newer than this version's 1"), std::string::npos);
  for (const std::string schema : {"0", "-1", "1e-300"})
    EXPECT_NE(changed("\"schema\":1", "\"schema\":" + schema).find("there is no schema"), std::string::npos);
  EXPECT_NE(changed("palm_arch", "palm").find("\"joints\" are not the 23"), std::string::npos);
  EXPECT_NE(changed("\"kind\":\"posture\"", "\"kind\":\"model\"").find("posture learn"), std::string::npos);
  EXPECT_NE(changed("\"cells\":[[", "\"cells\":[[1,").find("person 1, cell 1"), std::string::npos);
}

TEST(Learning, NeedsThreePeople) {
  auto people = test::people(3, 1);
  const auto none = [](const auto&, auto, auto) {};
  people.pop_back();
  EXPECT_NE(io::refusal_of([&] { learn(people, 1, none); }).find("three people"), std::string::npos);
  people.push_back(people[0]);
  EXPECT_NE(io::refusal_of([&] { learn(people, 1, none); }).find("twice"), std::string::npos);
}

TEST(Learning, FindsHowDipFollowsPip) {
  const Posture posture = learnt();
  for (const CoupledCurve& curve : posture.curves) {
    EXPECT_NEAR(curve.at(-50), test::coupled_deg(-50), 1.5);
    EXPECT_NEAR(curve.at(-20), test::coupled_deg(-20), 1.5);
    EXPECT_GT(curve.sd_deg, 0.9);  // the noise of DIP, and of PIP through the slope
    EXPECT_LT(curve.sd_deg, 2);
  }
}

TEST(Learning, RestIsTheStartOfEachTrial) {
  auto people = test::people(3, 1);
  const Posture posture = learn(people, 1, [](const auto&, auto, auto) {});
  Hand sum = Hand::Zero();
  int count = 0;
  for (std::size_t i = 0; i < people[0].t_s.size(); ++i) {
    if (people[0].t_s[i] > kRest_s) continue;  // trials start at 0
    sum += people[0].hands_deg.row(static_cast<Eigen::Index>(i)).transpose().array();
    ++count;
  }
  EXPECT_LT((posture.people[0].rest_deg - sum / count).abs().maxCoeff(), 1e-9);
}

// Ten seconds of one person do not outvote one second of two others: what is common is not what one does most.
TEST(RegressionOfPeople, CountsPeopleNotSeconds) {
  std::vector<Person> people(3);
  for (int i = 0; i < 3; ++i) {
    Person& person = people[static_cast<std::size_t>(i)];
    const int cells = i == 0 ? 40 : 4;
    person.rest_deg = Hand::Zero();
    person.book = {Hands::Constant(cells, kJoints, i == 0 ? 30.0 : 0.0), Eigen::VectorXd::Ones(cells),
                   Hand::Zero()};
  }
  const Regression regression({&people[0], &people[1], &people[2]}, InputMatrix(0, kJoints), {0.001, 0});
  const Hand mean = regression.mean_deg(regression.with_cells(Eigen::VectorXd(0)), Hand::Zero());
  EXPECT_NEAR(mean[5], 10, 0.1);
}

TEST(StandardErrors, CoverWhatTheyClaim) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal(0, 2);
  std::vector<Weighted> errors(20000);
  for (Weighted& error : errors) error = {std::abs(normal(random)), 0.5};
  EXPECT_NEAR(standard_error(errors), 2, 0.05);
  EXPECT_EQ(standard_error({}), 0);
  for (std::size_t i = 0; i < 400; ++i) errors[i].size = 1e6;  // a few wild ones draw it little
  EXPECT_NEAR(standard_error(errors), 2.08, 0.06);
}

TEST(CodebookOfHands, HasTheCentresOfWhatIsThere) {
  Hands hands(60, kJoints);
  for (Eigen::Index i = 0; i < 60; ++i)
    hands.row(i).setConstant(i < 20 ? -50.0 : 30.0 + 0.1 * static_cast<double>(i % 2));
  const Codebook book = make_codebook(hands, 30, 4, 3);
  EXPECT_NEAR(book.seconds.sum(), 30, 1e-9);
  EXPECT_NEAR((book.centre_deg.transpose() * book.seconds)[0] / 30, hands.col(0).mean(), 1e-9);
  EXPECT_LT(book.within_deg2.maxCoeff(), 0.003);
  EXPECT_EQ(book.centre_deg, make_codebook(hands, 30, 4, 3).centre_deg);
}

TEST(TablesOfAngles, KeepEveryRow) {
  std::istringstream text("object;t_s;a_deg;b_deg\ncup;1;2;\ncup;1;nan;4\ncup;0.5;5;6\n");
  recording::CsvReader table(text, "x.csv", {{"b_deg", "a_deg"}, {}, recording::Holes::all});
  recording::Row row;
  ASSERT_TRUE(table.next(row));
  EXPECT_TRUE(std::isnan(row.value[0]));
  EXPECT_EQ(row.value[1], 2);
  ASSERT_TRUE(table.next(row));
  EXPECT_TRUE(std::isnan(row.value[1]));
  ASSERT_TRUE(table.next(row));
  EXPECT_EQ(row.t_s, 0.5);
  EXPECT_FALSE(table.next(row));
  EXPECT_EQ(step_s(1, 0.5), 0);
  EXPECT_EQ(step_s(1, 1.25), 0.25);
}

}  // namespace
}  // namespace flexor::posture
