#include "host/study/twin_ensemble.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "host/io/refusal_test.hpp"
#include "host/twin/random.hpp"

namespace flexor::study {
namespace {

// One gesture is enough for what is tested, and quick.
EnsembleRequest request(int laboratories, int evaluations) {
  EnsembleRequest r;
  r.laboratories = laboratories;
  r.evaluations = evaluations;
  r.trials = 4;
  r.table = published_table(1, 1);
  return r;
}

TEST(Prior, MedianAndQuantilesAreWhatTheySay) {
  for (const FreeParameter& p : free_parameters()) {
    EXPECT_LT(p.min, p.median) << p.name;
    EXPECT_GT(p.max, p.median) << p.name;
    EXPECT_FALSE(p.reason.empty());
    if (p.deviation) {
      EXPECT_NEAR(p.quantile(0.5), p.median, 1e-6 * std::abs(p.median));
    }
    EXPECT_NEAR(p.value(p.coordinate(p.median)), p.median, 1e-9 * std::abs(p.median));
    EXPECT_TRUE(std::isinf(p.log_prior(p.max + 1)));
  }
  const FreeParameter normal{"", 10, 2, false, -100, 100, ""};
  EXPECT_NEAR(normal.quantile(0.95), 10 + 1.644854 * 2, 1e-5);
  EXPECT_NEAR(normal.log_prior(14), -2, 1e-12);
}

TEST(Prior, ValuesGoIntoATwinAndComeBack) {
  std::vector<double> values;
  for (const FreeParameter& p : free_parameters()) values.push_back(p.quantile(0.7));
  const twin::Parameters p = with_values(twin::Parameters(), values);
  const std::vector<double> back = values_of(p);
  for (std::size_t i = 0; i < values.size(); ++i) {
    EXPECT_NEAR(back[i], values[i], 5e-4 * std::abs(values[i])) << free_parameters()[i].name;
  }
  EXPECT_EQ(values_of(with_values(twin::Parameters(), back)), back);
}

TEST(TwinEnsemble, ThreadsDoNotChangeAByteAndAnotherSeedDoes) {
  EnsembleRequest r = request(10, 2 * 32);
  r.chains = 2;
  r.threads = 1;
  const std::string one = to_json(draw_ensemble(r, {}));
  r.threads = 3;
  EXPECT_EQ(to_json(draw_ensemble(r, {})), one);
  r.seed = 8;
  EXPECT_NE(to_json(draw_ensemble(r, {})), one);
}

TEST(TwinEnsemble, ComesBackFromItsFile) {
  EnsembleRequest few = request(10, 2 * 32);
  few.chains = 2;
  const std::string text = to_json(draw_ensemble(few, {}));
  EXPECT_EQ(nlohmann::json::parse(to_json(ensemble_from_json(text, "e.json"))), nlohmann::json::parse(text));
  EXPECT_NE(io::refusal_of([] { (void)ensemble_from_json("{}", "e.json"); }).find("flexor-ensemble"),
            std::string::npos);
  auto broken = nlohmann::ordered_json::parse(text);
  broken["laboratories"][3][2] = "x";
  EXPECT_NE(
      io::refusal_of([&] { (void)ensemble_from_json(broken.dump(), "e.json"); }).find("one number for each"),
      std::string::npos);
  EXPECT_NE(io::refusal_of([] { (void)draw_ensemble(request(1000, 8 * 32), {}); }).find("ask for more"),
            std::string::npos);
}

Point of_prior(twin::Random& random) {
  Point out;
  do {
    out.clear();
    for (const FreeParameter& p : free_parameters()) {
      out.push_back(p.deviation ? p.value(p.coordinate(p.median) + *p.deviation * random.normal())
                                : p.quantile(random.uniform()));
    }
  } while (!std::isfinite(log_prior(out)));
  return out;
}

// Truths drawn from the prior, tables as noisy as the published one: the 90 % intervals of 16 parameters hold
// the truth nine times of ten, as far as so few can tell; that they are not too wide is
// MarkovChain.IntervalsCoverTheTruthAtTheirRate's to say.
TEST(TwinFiguresEnsemble, TheIntervalsCoverTheTruthAtTheirRate) {
  EnsembleRequest r = request(100, 4 * 500);
  r.chains = 4;
  twin::Random random(100);
  const Point truth = of_prior(random);
  const TwinTable table(1, 1, r.trials, r.seed);
  r.table = table.errors(with_values(r.base, truth));
  const auto deviation = published_standard_errors();
  for (std::size_t c = 0; c < deviation.size(); ++c) {
    r.table[0][c] *= std::exp(deviation[c] * random.normal());
  }
  const Ensemble e = draw_ensemble(r, {});
  int covered = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    covered += truth[i] >= e.posterior[i].low && truth[i] <= e.posterior[i].high ? 1 : 0;
  }
  EXPECT_GE(covered, 11);  // 14.4 of 16, less 2.8 standard deviations of the binomial
  // The table has been heard: what is drawn comes nearer to it than what the prior alone would draw.
  double ours = 0;
  double without = 0;
  for (std::size_t l = 0; l < e.values.size(); l += 10) {
    ours += log_likelihood(table.errors(with_values(r.base, e.values[l])), r.table);
    without += log_likelihood(table.errors(with_values(r.base, of_prior(random))), r.table);
  }
  EXPECT_GT(ours, without + 10);  // of ten laboratories
}

}  // namespace
}  // namespace flexor::study
