#include "host/study/markov_chain.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/io/io.hpp"
#include "host/twin/random.hpp"

namespace flexor::study {
namespace {

// Two normal variables with deviations 1 and 10 and a correlation of 0.9; means 3 and -20.
double correlated(std::span<const double> x, double) {
  const double a = x[0] - 3;
  const double b = (x[1] + 20) / 10;
  return -(a * a - 2 * 0.9 * a * b + b * b) / (2 * (1 - 0.81));
}

const std::vector<Point> kStarts = {{0, 0}, {10, -40}, {-5, 20}, {3, -60}};

double mean(const Chains& chains, std::size_t i) {
  double sum = 0;
  std::size_t n = 0;
  for (const auto& chain : chains.kept) {
    for (const Point& x : chain) sum += x[i];
    n += chain.size();
  }
  return sum / static_cast<double>(n);
}

double deviation(const Chains& chains, std::size_t i) {
  const double middle = mean(chains, i);
  double sum = 0;
  std::size_t n = 0;
  for (const auto& chain : chains.kept) {
    for (const Point& x : chain) sum += (x[i] - middle) * (x[i] - middle);
    n += chain.size();
  }
  return std::sqrt(sum / static_cast<double>(n));
}

TEST(MarkovChain, DrawsFromAKnownDensity) {
  const Chains c = run_chains(kStarts, {1, 10}, correlated, {1000, 5000, 1, 2}, {});
  EXPECT_NEAR(mean(c, 0), 3, 0.15);
  EXPECT_NEAR(mean(c, 1), -20, 1.5);
  EXPECT_NEAR(deviation(c, 0), 1, 0.08);
  EXPECT_NEAR(deviation(c, 1), 10, 0.8);
  for (const double r : c.r_hat) EXPECT_LT(r, 1.02);
  EXPECT_GT(c.acceptance, 0.15);
  EXPECT_LT(c.acceptance, 0.75);  // a walk's quarter and a leap's most
  EXPECT_GT(c.effective[0], 500);
  EXPECT_LT(c.effective[0], 10000);  // 20000 steps of a walk are no independent draws
}

TEST(MarkovChain, NeverLeavesWhereTheDensityIsNotZero) {
  const LogDensity half = [](std::span<const double> x, double) {
    return x[0] < 0 ? -std::numeric_limits<double>::infinity() : -x[0] * x[0] / 2;
  };
  const Chains c = run_chains({{1.0}, {2.0}}, {1}, half, {500, 8000, 3, 1}, {});
  for (const auto& chain : c.kept) {
    for (const Point& x : chain) ASSERT_GE(x[0], 0);
  }
  EXPECT_NEAR(mean(c, 0), std::sqrt(2 / M_PI), 0.05);
}

// What may be cut short below the floor changes nothing.
TEST(MarkovChain, ThreadsAndAnEarlyEndChangeNothing) {
  const LogDensity cut = [](std::span<const double> x, double floor) {
    const double value = correlated(x, 0);
    return value < floor ? -std::numeric_limits<double>::infinity() : value;
  };
  const Chains one = run_chains(kStarts, {1, 10}, correlated, {100, 100, 5, 1}, {});
  EXPECT_EQ(one.kept, run_chains(kStarts, {1, 10}, correlated, {100, 100, 5, 3}, {}).kept);
  EXPECT_EQ(one.kept, run_chains(kStarts, {1, 10}, cut, {100, 100, 5, 2}, {}).kept);
  EXPECT_NE(one.kept, run_chains(kStarts, {1, 10}, correlated, {100, 100, 6, 1}, {}).kept);
}

// Six unknowns, three noisy sums of them, truths drawn from the prior: the 90 % intervals hold the truth nine times
// of ten, neither less nor more.
TEST(MarkovChain, IntervalsCoverTheTruthAtTheirRate) {
  constexpr std::size_t kUnknowns = 6;
  constexpr double kNoise = 0.3;
  int covered = 0;
  for (std::uint64_t k = 0; k < 40; ++k) {
    twin::Random random(k + 1);
    const auto normals = [&](std::size_t n) {
      Point out(n);
      for (double& v : out) v = random.normal();
      return out;
    };
    const Point truth = normals(kUnknowns);
    const auto sums = [](std::span<const double> x) {
      return Point{x[0] + x[1] - x[2], x[2] + 0.5 * x[3], x[4] * 2};
    };
    Point measured = sums(truth);
    for (double& v : measured) v += kNoise * random.normal();
    const LogDensity density = [&](std::span<const double> x, double) {
      double sum = 0;
      for (const double v : x) sum -= v * v / 2;
      const Point y = sums(x);
      for (std::size_t i = 0; i < y.size(); ++i) sum -= std::pow((y[i] - measured[i]) / kNoise, 2) / 2;
      return sum;
    };
    const std::vector<Point> starts = {normals(kUnknowns), normals(kUnknowns), normals(kUnknowns)};
    const Chains c = run_chains(starts, Point(kUnknowns, 0.8), density, {400, 1200, k, 1}, {});
    for (std::size_t i = 0; i < kUnknowns; ++i) {
      std::vector<double> values;
      for (const auto& chain : c.kept) {
        for (const Point& x : chain) values.push_back(x[i]);
      }
      std::ranges::sort(values);
      const auto at = [&](double share) {
        return values[static_cast<std::size_t>(share * static_cast<double>(values.size()))];
      };
      covered += truth[i] > at(0.05) && truth[i] < at(0.95) ? 1 : 0;
    }
  }
  EXPECT_GE(covered, 202);  // 216 of 240, and three standard deviations of the binomial to either side
  EXPECT_LE(covered, 230);
}

TEST(MarkovChain, FiguresOfKnownSeries) {
  std::vector<std::vector<double>> ar(4);
  constexpr double kKeep = 0.9;
  for (std::size_t c = 0; c < ar.size(); ++c) {
    twin::Random random(c + 1);
    double x = random.normal();
    for (int k = 0; k < 20000; ++k) {
      x = kKeep * x + std::sqrt(1 - kKeep * kKeep) * random.normal();
      ar[c].push_back(x);
    }
  }
  EXPECT_NEAR(effective_size(ar), 80000 * (1 - kKeep) / (1 + kKeep), 600);
  EXPECT_NEAR(split_r_hat(ar), 1, 0.005);
  for (double& x : ar[0]) x += 5;
  EXPECT_GT(split_r_hat(ar), 1.5);
  EXPECT_LT(effective_size(ar), 30);
}

TEST(MarkovChain, RefusesWhatCannotBeJudged) {
  EXPECT_THROW((void)run_chains({{0.0}}, {1}, correlated, {}, {}), io::InputError);
  EXPECT_THROW((void)run_chains({{0, 0}, {1, 1}}, {1, 1}, correlated, {10, 10, 1, 1}, {}), io::InputError);
  const LogDensity nowhere = [](std::span<const double>, double) {
    return -std::numeric_limits<double>::infinity();
  };
  EXPECT_THROW((void)run_chains({{0.0}, {1.0}}, {1}, nowhere, {}, {}), io::InputError);
}

}  // namespace
}  // namespace flexor::study
