#include "host/study/markov_chain.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "host/io/io.hpp"
#include "host/io/run_in_order.hpp"
#include "host/twin/random.hpp"

namespace flexor::study {
namespace {

constexpr double kTargetAcceptance = 0.25;
constexpr double kLeap = 1.1;  // wider than what was learnt: tails that no leap reaches would be left out
constexpr double kAssumedPoints = 10;  // for each dimension
constexpr int kFirstLearning = 25;     // steps; then each time half as many again

double mean_of(const std::vector<double>& x) {
  return std::accumulate(x.begin(), x.end(), 0.0) / static_cast<double>(x.size());
}

double variance_of(const std::vector<double>& x) {
  const double mean = mean_of(x);
  double sum = 0;
  for (const double v : x) sum += (v - mean) * (v - mean);
  return sum / static_cast<double>(x.size() - 1);
}

class Walk {
 public:
  Walk(const std::vector<Point>& starts, const Point& scale, const LogDensity& log_density,
       const ChainPlan& plan)
      : density_(log_density),
        plan_(plan),
        factor_(Eigen::Map<const Eigen::VectorXd>(scale.data(), dimensions(scale)).asDiagonal()),
        first_covariance_(factor_ * factor_.transpose()),
        log_scale_(std::log(2.38 / std::sqrt(static_cast<double>(scale.size())))) {
    for (std::size_t c = 0; c < starts.size(); ++c) {
      chains_.push_back({starts[c], 0, twin::Random(twin::seed_of(plan.seed, c))});
    }
    in_parallel([&](Chain& chain) {
      chain.log_density = density_(chain.at, -std::numeric_limits<double>::infinity());
      return 0.0;
    });
    for (const Chain& chain : chains_) {
      if (!std::isfinite(chain.log_density))
        throw io::InputError("a Markov chain starts where its density is zero");
    }
  }

  Chains run(const ChainProgress& progress) {
    const int of = plan_.warm_up + plan_.kept;
    int learn_at = kFirstLearning;
    twin::Random kind(twin::seed_of(plan_.seed, chains_.size()));
    for (int step = 0; step < of; ++step) {
      if (plan_.stop != nullptr && plan_.stop->load()) throw io::Cancelled("stopped");
      if (progress) progress(step + 1, of);
      const bool is_leap = mean_.size() > 0 && kind.uniform() < 0.5;
      const double accepted = move(is_leap);
      for (Chain& chain : chains_) (step < plan_.warm_up ? chain.warm : chain.kept).push_back(chain.at);
      if (step >= plan_.warm_up) {
        accepted_ += accepted;
        continue;
      }
      if (!is_leap) log_scale_ += (accepted - kTargetAcceptance) / std::sqrt(1.0 + step / 10.0);
      if (step + 1 == learn_at) {
        learn();
        learn_at = std::max(learn_at + 1, learn_at * 3 / 2);
      }
    }
    return result();
  }

 private:
  struct Chain {
    Point at;
    double log_density = 0;
    twin::Random random;
    std::vector<Point> warm{};
    std::vector<Point> kept{};
  };

  static Eigen::Index dimensions(const Point& x) { return static_cast<Eigen::Index>(x.size()); }

  // The mean of what `what` says of each chain.
  template <class What>
  double in_parallel(const What& what) {
    double sum = 0;
    io::run_in_order<double>(
        0, chains_.size(), io::threads_of(plan_.threads), [&](std::size_t c) { return what(chains_[c]); },
        [&](std::size_t, double value) { sum += value; });
    return sum / static_cast<double>(chains_.size());
  }

  // One step of every chain; the share of them that moved.
  double move(bool is_leap) {
    return in_parallel([&](Chain& chain) {
      Eigen::VectorXd z(factor_.cols());
      for (double& v : z) v = chain.random.normal();
      const Eigen::VectorXd at = Eigen::Map<const Eigen::VectorXd>(chain.at.data(), z.size());
      const Eigen::VectorXd to = is_leap ? Eigen::VectorXd(mean_ + kLeap * factor_ * z)
                                         : Eigen::VectorXd(at + std::exp(log_scale_) * factor_ * z);
      const double proposals = is_leap ? leap_log_density(to) - leap_log_density(at) : 0;
      const double floor = chain.log_density + proposals + std::log(1 - chain.random.uniform());
      const Point point(to.begin(), to.end());
      const double log_density = density_(point, floor);
      if (log_density < floor) return 0.0;
      chain.at = point;
      chain.log_density = log_density;
      return 1.0;
    });
  }

  double leap_log_density(const Eigen::VectorXd& x) const {
    const Eigen::VectorXd z = factor_.triangularView<Eigen::Lower>().solve(x - mean_) / kLeap;
    return -z.squaredNorm() / 2;
  }

  // From the last half of what all chains have seen, and so many points as `scale` says: few correlated points
  // would leave directions in which nothing moves any more.
  void learn() {
    std::vector<const Point*> seen;
    for (const Chain& chain : chains_) {
      for (std::size_t k = chain.warm.size() / 2; k < chain.warm.size(); ++k) seen.push_back(&chain.warm[k]);
    }
    const Eigen::Index n = factor_.rows();
    Eigen::VectorXd mean = Eigen::VectorXd::Zero(n);
    for (const Point* p : seen) mean += Eigen::Map<const Eigen::VectorXd>(p->data(), n);
    mean /= static_cast<double>(seen.size());
    const double assumed = kAssumedPoints * static_cast<double>(n);
    Eigen::MatrixXd sum = assumed * first_covariance_;
    for (const Point* p : seen) {
      const Eigen::VectorXd d = Eigen::Map<const Eigen::VectorXd>(p->data(), n) - mean;
      sum += d * d.transpose();
    }
    factor_ = (sum / (static_cast<double>(seen.size()) + assumed)).llt().matrixL();
    mean_ = mean;
  }

  Chains result() {
    Chains out;
    out.acceptance = accepted_ / plan_.kept;
    for (Chain& chain : chains_) out.kept.push_back(std::move(chain.kept));
    for (Eigen::Index i = 0; i < factor_.rows(); ++i) {
      std::vector<std::vector<double>> one;
      for (const auto& chain : out.kept) {
        one.emplace_back();
        for (const Point& p : chain) one.back().push_back(p[static_cast<std::size_t>(i)]);
      }
      out.r_hat.push_back(split_r_hat(one));
      out.effective.push_back(effective_size(one));
    }
    return out;
  }

  const LogDensity& density_;
  const ChainPlan& plan_;
  Eigen::MatrixXd factor_;
  Eigen::MatrixXd first_covariance_;
  Eigen::VectorXd mean_;  // empty until something is learnt
  double log_scale_;
  std::vector<Chain> chains_;
  double accepted_ = 0;
};

std::vector<std::vector<double>> halves(const std::vector<std::vector<double>>& chains) {
  std::vector<std::vector<double>> out;
  for (const auto& chain : chains) {
    const auto half = static_cast<std::ptrdiff_t>(chain.size() / 2);
    out.emplace_back(chain.begin(), chain.begin() + half);
    out.emplace_back(chain.end() - half, chain.end());
  }
  return out;
}

struct Variances {
  double within = 0;
  double pooled = 0;
};

Variances variances(const std::vector<std::vector<double>>& chains) {
  std::vector<double> means;
  Variances out;
  for (const auto& chain : chains) {
    means.push_back(mean_of(chain));
    out.within += variance_of(chain) / static_cast<double>(chains.size());
  }
  const auto n = static_cast<double>(chains.front().size());
  out.pooled = (n - 1) / n * out.within + variance_of(means);
  return out;
}

}  // namespace

double split_r_hat(const std::vector<std::vector<double>>& chains) {
  const Variances v = variances(halves(chains));
  return v.within > 0 ? std::sqrt(v.pooled / v.within) : 1;
}

double effective_size(const std::vector<std::vector<double>>& chains) {
  const auto split = halves(chains);
  const Variances v = variances(split);
  const std::size_t n = split.front().size();
  const double all = static_cast<double>(n * split.size());
  if (!(v.pooled > 0)) return all;
  const auto correlation = [&](std::size_t lag) {
    double sum = 0;
    for (const auto& chain : split) {
      double squares = 0;
      for (std::size_t k = lag; k < n; ++k)
        squares += (chain[k] - chain[k - lag]) * (chain[k] - chain[k - lag]);
      sum += squares / static_cast<double>(n - lag) / static_cast<double>(split.size());
    }
    return 1 - sum / (2 * v.pooled);
  };
  double time = -1;
  double last = 2;
  for (std::size_t lag = 0; lag + 1 < n; lag += 2) {
    const double pair = std::min(last, (lag == 0 ? 1 : correlation(lag)) + correlation(lag + 1));
    if (pair < 0) break;
    time += 2 * pair;
    last = pair;
  }
  return std::min(all, all / std::max(time, 1e-9));
}

Chains run_chains(const std::vector<Point>& starts, const Point& scale, const LogDensity& log_density,
                  const ChainPlan& plan, const ChainProgress& progress) {
  if (starts.size() < 2) throw io::InputError("one Markov chain has none to be compared with: start two");
  if (plan.kept < 20) throw io::InputError("a Markov chain needs at least 20 steps that are kept");
  return Walk(starts, scale, log_density, plan).run(progress);
}

}  // namespace flexor::study
