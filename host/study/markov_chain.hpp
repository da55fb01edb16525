// Draws from a density that is known up to a constant: several Metropolis chains side by side. Every other step,
// by chance, is of one of two kinds:
//   walk    x' = x + s L z,         accepted with probability min(1, p(x') / p(x))
//   leap    x' = m + 1.1 L z,       accepted with probability min(1, p(x') q(x) / (p(x) q(x'))), q its density
// z standard normal, m and L L' mean and covariance of the last half of all chains' warm-up. A leap forgets where
// it came from, a walk gets where the normal shape does not fit. s, m and L are learnt while the chains warm up
// (Haario, Saksman, Tamminen, Bernoulli 7 (2001) 223; s aims at an acceptance of 0.25) and stay as they are from
// then on: what is kept comes from Markov chains proper.
//   R-hat      of split chains, and effective sample size by Geyer's initial monotone sequence, both as in
//              Gelman et al., Bayesian Data Analysis, 3rd ed., sections 11.4 and 11.5. R-hat near 1: the chains
//              cannot be told apart.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace flexor::study {

using Point = std::vector<double>;

struct ChainPlan {
  int warm_up = 1000;  // steps of each chain that are not kept
  int kept = 2000;
  std::uint64_t seed = 1;
  int threads = 0;                          // 0: as many as the machine has; the draws are the same
  const std::atomic<bool>* stop = nullptr;  // becomes true: io::Cancelled
};

struct Chains {
  std::vector<std::vector<Point>> kept;  // [chain][step]
  double acceptance = 0;                 // share of the kept steps
  std::vector<double> r_hat;             // of each dimension
  std::vector<double> effective;         // sample size, of each dimension
};

// From any thread. What is surely below `floor` may come out as minus infinity: it is rejected anyway, and a
// density that is a product needs only its first factors for that.
using LogDensity = std::function<double(std::span<const double>, double floor)>;
using ChainProgress = std::function<void(int step, int of)>;

// One chain for each start, where the density must not be zero; `scale` is about each dimension's deviation.
// Throws io::InputError: fewer than 20 kept steps, less than two starts.
Chains run_chains(const std::vector<Point>& starts, const Point& scale, const LogDensity& log_density,
                  const ChainPlan& plan, const ChainProgress& progress);

// Of one dimension, [chain][step].
double split_r_hat(const std::vector<std::vector<double>>& chains);
double effective_size(const std::vector<std::vector<double>>& chains);

}  // namespace flexor::study
