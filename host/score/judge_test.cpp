#include "host/score/judge.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

namespace flexor::score {
namespace {

std::vector<double> errors(double sd_deg, unsigned seed, std::size_t samples = 1200, double alike = 0) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, sd_deg);
  std::vector<double> out(samples);
  double last = normal(random);
  for (double& e : out) e = last = alike * last + std::sqrt(1 - alike * alike) * normal(random);
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

// Of two equally good ones: in one case of twenty either is called better, also over ten seconds of errors that last half a second.
TEST(Judge, ItsIntervalCovers) {
  for (const auto& [samples, alike] : {std::pair{1200, 0.0}, {200, 0.9}}) {
    const auto drawn = [&](unsigned seed) { return errors(1, seed, samples, alike); };
    int sure = 0;
    int covered = 0;
    for (unsigned seed = 0; seed < 400; seed += 2) {
      const Verdict v = judge(drawn(seed), {{"line", drawn(seed + 1)}}, 0.05);
      sure += v.word != Verdict::Word::as_good;
      covered += v.rmse_low_deg < 1 && 1 < v.rmse_high_deg;
    }
    EXPECT_GE(covered, 175) << samples << ": of 200 intervals of an error of one degree";
    EXPECT_LE(covered, 198) << samples;
    EXPECT_LE(sure, 20) << samples;
    EXPECT_GE(sure, 2) << samples;
  }
}

// Four persons of errors that differ: drawn whole they tell far less than their samples do; fewer tell nothing.
TEST(Judge, PartsAreDrawnWhole) {
  std::vector<double> error;
  for (const unsigned person : {1, 2, 3, 4})
    for (const double e : errors(person, person)) error.push_back(e);
  const Verdict blocks = judge(error, {}, 0.05);
  const Verdict persons = judge(error, {}, 0.05, {1200, 2400, 3600, 4800});
  EXPECT_EQ(persons.rmse_deg, blocks.rmse_deg);
  EXPECT_GT(persons.rmse_high_deg - persons.rmse_low_deg, 3 * (blocks.rmse_high_deg - blocks.rmse_low_deg));
  const Verdict two = judge(error, {{"line", errors(9, 9, 4800)}}, 0.05, {2400, 4800});
  EXPECT_TRUE(to_json(two).at("word").is_null() && to_json(two).at("rmse_interval95_deg").is_null());
  EXPECT_NE(in_words(two).find("no verdict"), std::string::npos);
  EXPECT_EQ(in_words(two).find("95 %"), std::string::npos);
}

TEST(Judge, RecommendsTheBaselineThatErrsLess) {
  const auto words = [](const char* name, double size = 1) {
    return in_words(judge(errors(2, 1), {{name, errors(size, 2)}}, 0.05));
  };
  EXPECT_EQ(words("line_lead", 2.01).find("--structure"), std::string::npos) << "it errs more";
  EXPECT_NE(words("line_lead").find("--structure line-lead"), std::string::npos);
  EXPECT_NE(words("static_curve").find("--structure curve"), std::string::npos);
  EXPECT_NE(words("published_form").find("--structure \"dead-zone > gain"), std::string::npos);
  EXPECT_EQ(judge(errors(1, 1), {}, 0.05).baseline, "");
}

}  // namespace
}  // namespace flexor::score
