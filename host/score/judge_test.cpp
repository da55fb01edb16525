#include "host/score/judge.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

namespace flexor::score {
namespace {

std::vector<double> errors(double sd_deg, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, sd_deg);
  std::vector<double> out(1200);
  for (double& e : out) e = normal(random);
  return out;
}

TEST(Judge, TheBestBaselineDecidesAndTheIntervalSaysHowSure) {
  const Verdict better = judge(errors(1, 1), {{"line", errors(3, 2)}, {"static_curve", errors(2, 3)}}, 0.05);
  EXPECT_EQ(better.baseline, "static_curve");
  EXPECT_EQ(better.word, Verdict::Word::better);
  EXPECT_LT(better.low_deg, better.rmse_deg - better.baseline_deg);
  EXPECT_GT(better.high_deg, better.rmse_deg - better.baseline_deg);
  EXPECT_EQ(judge(errors(2, 1), {{"line", errors(1, 2)}}, 0.05).word, Verdict::Word::worse);
  EXPECT_EQ(judge(errors(1, 1), {{"line", errors(1, 2)}}, 0.05).word, Verdict::Word::as_good);
  EXPECT_EQ(to_json(better).at("word"), "better");
}

// What both have in common cancels: one is better by a tenth of a degree of errors that are ten times as large.
TEST(Judge, IsPaired) {
  const std::vector<double> one = errors(1, 1);
  std::vector<double> other = one;
  for (double& e : other) e *= 1.1;
  EXPECT_EQ(judge(one, {{"line", other}}, 0.05).word, Verdict::Word::better);
}

// Of two that are equally good one is called better in about one case of forty.
TEST(Judge, ItsIntervalCovers) {
  int sure = 0;
  for (unsigned seed = 0; seed < 200; ++seed)
    sure +=
        judge(errors(1, 2 * seed), {{"line", errors(1, 2 * seed + 1)}}, 0.05).word != Verdict::Word::as_good;
  EXPECT_LE(sure, 24);
  EXPECT_GE(sure, 2);
}

TEST(Judge, RecommendsOnlyWhatAStructureGives) {
  EXPECT_NE(in_words(judge(errors(2, 1), {{"line_lead", errors(1, 2)}}, 0.05)).find("--structure line-lead"),
            std::string::npos);
  EXPECT_EQ(in_words(judge(errors(2, 1), {{"static_curve", errors(1, 2)}}, 0.05)).find("--structure"),
            std::string::npos);
  EXPECT_EQ(judge(errors(1, 1), {}, 0.05).baseline, "");
}

}  // namespace
}  // namespace flexor::score
