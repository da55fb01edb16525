#include "host/study/twin_fit.hpp"

#include <cmath>
#include <nlopt.hpp>

#include "host/study/log_rms.hpp"

namespace flexor::study {
namespace {

constexpr double kCellDeviation = 0.35;  // of ln(ours / published)

class TwinProblem {
 public:
  TwinProblem(const twin::Parameters& start, int evaluations, int trials, std::uint64_t seed,
              const FitProgress& progress)
      : start_(start),
        evaluations_(evaluations),
        progress_(progress),
        table_(1, kLastFittedGesture, trials, seed),
        published_(published_table(1, kLastFittedGesture)) {}

  TwinFit solve() {
    std::vector<double> x;
    for (const FreeParameter& p : free_parameters()) x.push_back(share(p, p.median));
    nlopt::opt optimizer(nlopt::LN_SBPLX, static_cast<unsigned>(x.size()));
    optimizer.set_lower_bounds(0);
    optimizer.set_upper_bounds(1);
    optimizer.set_maxeval(evaluations_);
    optimizer.set_xtol_abs(1e-4);
    optimizer.set_initial_step(0.2);
    optimizer.set_min_objective([](const std::vector<double>& at, std::vector<double>&,
                                   void* self) { return static_cast<TwinProblem*>(self)->cost(at); },
                                this);
    TwinFit fit;
    optimizer.optimize(x, fit.cost);
    fit.parameters = with_values(start_, values(x));
    fit.evaluations = count_;
    fit.log_rms = log_rms(table_.errors(fit.parameters, kAllThreads), published_);
    return fit;
  }

 private:
  // Between the bounds, 0 to 1.
  static double share(const FreeParameter& p, double value) {
    const double low = p.coordinate(p.min);
    return (p.coordinate(value) - low) / (p.coordinate(p.max) - low);
  }

  static std::vector<double> values(const std::vector<double>& x) {
    std::vector<double> out;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const FreeParameter& p = free_parameters()[i];
      const double low = p.coordinate(p.min);
      out.push_back(p.value(low + (p.coordinate(p.max) - low) * x[i]));
    }
    return out;
  }

  double cost(const std::vector<double>& x) {
    if (progress_) progress_(count_ + 1, evaluations_, best_);
    ++count_;
    const std::vector<double> v = values(x);
    const double prior = log_prior(v);
    if (!std::isfinite(prior)) return kImpossible;
    const TableErrors ours = table_.errors(with_values(start_, v), kAllThreads);
    best_ = std::min(best_, log_rms(ours, published_));
    const double z = log_rms(ours, published_) / kCellDeviation;
    return 3.0 * kLastFittedGesture * z * z - 2 * prior;
  }

  static constexpr double kImpossible = 1e6;
  static constexpr int kAllThreads = 0;

  const twin::Parameters& start_;
  int evaluations_;
  const FitProgress& progress_;
  TwinTable table_;
  TableErrors published_;
  int count_ = 0;
  double best_ = 1e9;
};

}  // namespace

TwinFit calibrate_twin(const twin::Parameters& start, int evaluations, int trials, std::uint64_t seed,
                       const FitProgress& progress) {
  return TwinProblem(start, evaluations, trials, seed, progress).solve();
}

}  // namespace flexor::study
