#include "apps/cli/ensemble_text.hpp"

#include <fmt/format.h>

#include "host/study/null_model.hpp"

namespace flexor::cli {
namespace {

// "65 (50 to 80)".
std::string interval(const std::vector<double>& values, int digits) {
  if (values.empty()) return "-";
  const study::Interval v = study::interval90(values);
  return fmt::format("{:.{}f} ({:.{}f} to {:.{}f})", v.median, digits, v.low, digits, v.high, digits);
}

std::string errors(const study::EnsembleResult& r) {
  constexpr const char* kRow = "{:<22}{:<24}{:>26}{:>11}{:>26}\n";
  std::string out =
      fmt::format(fmt::runtime(kRow), "gesture", "compensator", "E_T", "published", "to published-hw");
  const std::size_t hw = r.index("published-hw");
  for (std::size_t m = 0; m < r.motions.size(); ++m) {
    for (std::size_t c = 0; c < r.compensators.size(); ++c) {
      const std::string name =
          r.gestures[m] > 0 ? fmt::format("{} {}", r.gestures[m], r.motions[m]) : r.motions[m];
      const auto published = study::published_error_deg_s(r.gestures[m], r.compensators[c]);
      out += fmt::format(fmt::runtime(kRow), c > 0 ? "" : io::start_of(name, 21), r.compensators[c],
                         interval(r.errors(m, c), 0), published ? fmt::format("{:.0f}", *published) : "-",
                         hw < r.compensators.size() ? interval(r.ratios(m, c, hw), 2) : "-");
    }
  }
  return out;
}

// How many laboratories have a smaller mean error with the one than with the other.
std::string headlines(const study::EnsembleResult& r) {
  std::string out =
      "\nratio of errors, geometric mean over the gestures; in brackets the 90 % interval, then the share "
      "of laboratories where it is below 1\n";
  out += fmt::format("{:<24}", "");
  const std::vector<std::string> to = {"published-hw", "line", "line-lead", "published-hw-refitted"};
  for (const std::string& name : to) out += fmt::format("{:>32}", "to " + name);
  out += "\n";
  for (std::size_t c = 0; c < r.compensators.size(); ++c) {
    out += fmt::format("{:<24}", r.compensators[c]);
    for (const std::string& name : to) {
      const std::size_t other = r.index(name);
      if (other == c || other == r.compensators.size()) {
        out += fmt::format("{:>32}", "-");
        continue;
      }
      const std::vector<double> ratios = r.mean_ratios(c, other);
      const auto below = std::ranges::count_if(ratios, [](double v) { return v < 1; });
      out += fmt::format(
          "{:>32}", fmt::format("{}, {:.0f} %", interval(ratios, 2),
                                100.0 * static_cast<double>(below) / static_cast<double>(ratios.size())));
    }
    out += "\n";
  }
  return out;
}

// What changes after calibration, row by row.
std::string scenarios(const study::EnsembleResult& r) {
  if (r.scenarios.empty()) return "";
  constexpr const char* kRow = "{:<34}{:>28}{:>28}{:>28}\n";
  std::string out =
      "\n" + fmt::format(fmt::runtime(kRow), "changed after calibration", "identified to published-hw",
                         "line-lead to published-hw", "identified to line-lead");
  const auto ratio = [&](const char* compensator, const char* to, std::size_t use) {
    const std::size_t other = r.index(to);
    return other < r.compensators.size() ? interval(r.mean_ratios(r.index(compensator), other, use), 2) : "-";
  };
  for (std::size_t s = 0; s < r.scenarios.size(); ++s) {
    out += fmt::format(fmt::runtime(kRow), r.scenarios[s].name, ratio("identified", "published-hw", s + 1),
                       ratio("line-lead", "published-hw", s + 1), ratio("identified", "line-lead", s + 1));
  }
  return out;
}

std::string shapes(const study::EnsembleResult& r) {
  std::string out;
  for (std::size_t s = 0; s < r.shapes.size(); ++s) {
    study::ShapeCheck check = r.shapes[s];
    std::vector<double> values;
    int agree = 0;
    for (const study::LaboratoryRow& row : r.rows) {
      check.value_deg = row.shape_deg[s];
      values.push_back(check.value_deg);
      agree += check.agrees() ? 1 : 0;
    }
    out += fmt::format("gesture {}, {}: {} deg; {} {:g} in {} of {} laboratories\n", check.gesture,
                       check.what, interval(values, 1), check.is_least ? "at least" : "at most",
                       check.threshold_deg, agree, r.rows.size());
  }
  return out;
}

}  // namespace

std::string ensemble_text(const study::Ensemble& e) {
  constexpr const char* kRow = "{:<32}{:>28}{:>28}{:>8}{:>11}\n";
  std::string out = fmt::format(fmt::runtime(kRow), "parameter, median (5 to 95 %)", "prior", "posterior",
                                "R-hat", "effective");
  for (std::size_t i = 0; i < e.posterior.size(); ++i) {
    const study::FreeParameter& p = study::free_parameters()[i];
    const study::Posterior& q = e.posterior[i];
    out += fmt::format(
        fmt::runtime(kRow), q.name,
        fmt::format("{:.3g} ({:.3g} to {:.3g})", p.quantile(0.5), p.quantile(0.05), p.quantile(0.95)),
        fmt::format("{:.3g} ({:.3g} to {:.3g})", q.median, q.low, q.high), fmt::format("{:.3f}", q.r_hat),
        fmt::format("{:.0f}", q.effective));
  }
  out += fmt::format(
      "\n{} laboratories from {} chains of {} kept steps after {}; acceptance {:.2f}, largest R-hat {:.3f}, "
      "smallest effective sample {:.0f}, seed {}\n",
      e.values.size(), e.chains, e.kept, e.warm_up, e.acceptance, e.worst_r_hat(), e.least_effective(),
      e.seed);
  return out;
}

std::string ensemble_text(const study::EnsembleResult& r, const study::EnsemblePlan& plan) {
  std::string out = fmt::format(
      "total error E_T in deg s: median and 90 % interval over {} laboratories, mean of {} trial(s) in each, "
      "{:g} "
      "Hz, seed {}; glove recorded once in each\n\n",
      r.rows.size(), plan.plan.trials, plan.rate_hz, plan.plan.seed);
  out += errors(r) + headlines(r) + scenarios(r);
  const study::NullModel null = study::null_model();
  out += fmt::format(
      "\ndistance from the published table, rms of ln(ours/published): {} on gestures 1-4 (one constant for "
      "each compensator: {:.3f}), {} on gestures 5-6 ({:.3f})\n",
      interval(r.log_rms(1, 4), 3), null.fitted_log_rms, interval(r.log_rms(5, 6), 3), null.other_log_rms);
  out += shapes(r);
  if (r.wall_s > 0) out += fmt::format("{:.1f} s on {} thread(s)\n", r.wall_s, r.threads);
  return out;
}

}  // namespace flexor::cli
