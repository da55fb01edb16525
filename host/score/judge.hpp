// Whether a compensator is better than what anybody would draw first, on data that neither saw. The only verdict.
//
// Against the baseline of the least RMSE: d = RMSE(compensator) - RMSE(baseline) over the same samples, with a 95 % interval from
// B blocks of 10 s, five at least. To first order block b adds p_b = sum (e^2 - RMSE^2) / (2 n RMSE) to an RMSE's deviation, and the
// difference of both to that of d: what both have in common cancels. d +- t_{B - 1} sqrt(B / (B - 1) sum p_b^2 / w), and of an RMSE
// alone so for its logarithm. w: neighbours are alike, and show that share alone of the variance of errors that last 3 s. Of
// Gaussian errors that last 0.3 to 3 s it covers 88 to 99 %, over 10 to 300 s. Better where all of the interval lies below 0, worse
// where all of it lies above, else as good. Without a baseline the interval is of the RMSE alone.
// Sources: R. Ibragimov, U. Mueller, J. Bus. Econ. Stat. 28 (2010) 453 (t of few blocks); B. Schmeiser, Oper. Res. 30 (1982) 556
// (means of blocks). Deviation: w.
#pragma once

#include <array>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

namespace flexor::score {

struct Verdict {
  enum class Word { better, as_good, worse };
  Word word = Word::as_good;
  std::string baseline;  // its name; empty: there was none
  std::string itself;    // of the baseline that the compensator itself is; empty: of none
  bool advises = true;   // false: the data are at fault, and another structure mends nothing
  double rmse_deg = 0;   // of the compensator
  double baseline_deg = 0;
  bool has_interval = true;  // false: of too few parts; then `word` means nothing either
  double low_deg = 0;        // of d
  double high_deg = 0;
  double rmse_low_deg = 0;  // of the compensator's RMSE, by the same blocks
  double rmse_high_deg = 0;
};

// Two-sided 95 % quantiles of the normal distribution and of Student's t; degrees of freedom, at least one.
inline constexpr double kNormal95 = 1.959964;
double student_t(int degrees);

// Root mean square; of none NaN.
double rms(std::span<const double> error);

struct Baseline {
  const char* name;
  const char* words;
  const char* structure;  // that gives it
};
inline constexpr std::array kBaselines = {
    Baseline{"line", "a straight line", "line"},
    Baseline{"limited_line", "a straight line between limits", "limited-line"},
    Baseline{"line_lead", "a straight line with a lead", "line-lead"},
    Baseline{"static_curve", "a static curve", "curve"},
    Baseline{"published_form", "the published form", "dead-zone > gain > lti(1) > saturation"}};

// Errors at the same samples, degrees, at least two; baselines by their names. `part_ends`: of parts, one after the other, that are drawn whole in place of blocks, as persons are; none: blocks.
// Fewer than four parts have neither interval nor word.
Verdict judge(const std::vector<double>& error_deg,
              const std::map<std::string, std::vector<double>>& baseline_error_deg, double period_s,
              const std::vector<std::size_t>& part_ends = {});

// "2.31 deg (95 %: 2.12 to 2.50) on data it never saw; the best baseline, a straight line, 2.94: better (difference -0.63, 95 %: -0.81 to -0.44)".
// Where it is not better, which baseline to take, if that errs less and a structure gives it.
std::string in_words(const Verdict& verdict);

nlohmann::ordered_json to_json(const Verdict& verdict);

}  // namespace flexor::score
