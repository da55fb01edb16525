#include "host/score/judge.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

namespace flexor::score {
namespace {

std::vector<double> errors(double sd_deg, unsigned seed, std::size_t samples = 1200, double last_s = 0) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, sd_deg);
  std::vector<double> out(samples);
  const double alike = std::exp(-0.05 / last_s);
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
}

// What both have in common cancels: one is better by a tenth of a degree of errors that are ten times as large.
TEST(Judge, IsPaired) {
  const std::vector<double> one = errors(1, 1);
  std::vector<double> other = one;
  for (double& e : other) e *= 1.1;
  EXPECT_EQ(judge(one, {{"line", other}}, 0.05).word, Verdict::Word::better);
}

// Errors of 1 and 1.3 degrees that last 0.3 to 3 s, in 10 to 200 s: of 400 intervals 88 to 99 % hold the true RMSE, and the true difference.
TEST(Judge, ItsIntervalCovers) {
  for (const auto& [samples, last_s] :
       {std::pair{200, 3.0}, {600, 0.3}, {600, 3.0}, {4000, 1.0}, {4000, 3.0}}) {
    int own = 0, difference = 0, better = 0;
    for (unsigned seed = 0; seed < 800; seed += 2) {
      const Verdict v =
          judge(errors(1, seed, samples, last_s), {{"line", errors(1.3, seed + 1, samples, last_s)}}, 0.05);
      own += v.rmse_low_deg < 1 && 1 < v.rmse_high_deg;
      difference += v.low_deg < -0.3 && -0.3 < v.high_deg;
      better += v.word == Verdict::Word::better;
    }
    EXPECT_TRUE(352 <= own && own <= 396) << own << ": " << samples << " samples, " << last_s << " s";
    EXPECT_TRUE(352 <= difference && difference <= 396) << difference << ": " << samples << ", " << last_s;
    EXPECT_TRUE(samples < 4000 || better > (last_s > 1 ? 200 : 360)) << better << " of 200 s";
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
