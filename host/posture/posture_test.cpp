#include "host/posture/posture.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "host/io/expect_test.hpp"
#include "host/io/io.hpp"
#include "host/posture/regression.hpp"

namespace flexor::posture {
namespace {

TEST(PostureDocument, IsReadAsItIsWritten) {
  const Posture read = load(FLEXOR_SOURCE_DIR "/models/posture.json");
  ASSERT_EQ(read.people.size(), 5U);
  EXPECT_EQ(read.seed, 1U);
  EXPECT_EQ(read.people[1].source, "subject2.csv");
  EXPECT_EQ(read.people[1].rows, 7497);
  EXPECT_NEAR(read.people[1].seconds(), 218.5, 0.5);
  ASSERT_EQ(read.curves.size(), 4U);
  EXPECT_EQ(read.curves[0].coupling.joint, 6);
  EXPECT_NEAR(read.curves[0].at(-50), -5.4, 0.1);
}

TEST(PostureDocument, IsRefusedByNameWhereItIsWrong) {
  const std::string text = io::read_file(FLEXOR_SOURCE_DIR "/models/posture.json");
  for (const auto& [from, to, words] : std::vector<std::array<std::string, 3>>{
           {R"("schema":1)", R"("schema":2)", "newer than this version's 1"},
           {R"("schema":1)", R"("schema":0)", "there is no schema"},
           {R"("schema":1)", R"("schema":-1)", "there is no schema"},
           {R"("schema":1)", R"("schema":1e-300)", "there is no schema"},
           {"palm_arch", "palm", R"("joints" are not the 23)"},
           {R"("kind":"posture")", R"("kind":"model")", "posture_learning"},
           {R"("cells":[[)", R"("cells":[[1,)", "person 1, cell 1"}}) {
    std::string other = text;
    other.replace(other.find(from), from.size(), to);
    io::expect_refused([&] { parse(other, "p.json"); }, words);
  }
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

TEST(Steps, OfAClockThatGoesBackAreNothing) {
  EXPECT_EQ(step_s(1, 0.5), 0);
  EXPECT_EQ(step_s(1, 1.25), 0.25);
}

}  // namespace
}  // namespace flexor::posture
