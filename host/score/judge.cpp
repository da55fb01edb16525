#include "host/score/judge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/io/io.hpp"

namespace flexor::score {
namespace {

constexpr double kBlock_s = 10;
constexpr std::size_t kLeastBlocks = 5;
constexpr double kLasting_s = 3;        // correlation time of errors that a slow glove makes
constexpr std::size_t kLeastParts = 4;  // with three the quantile alone is 4.3 standard errors

const char* word_of(const Verdict& v) {
  constexpr std::array kWords = {"better", "as good", "worse"};
  return kWords.at(static_cast<std::size_t>(v.word));
}

// Variance of the mean over length_s of squares whose correlation is exp(-2 t / kLasting_s); that of one is 1.
double mean_variance(double length_s) {
  const double q = kLasting_s / 2 / length_s;
  return 2 * q * (1 - q * (1 - std::exp(-1 / q)));
}

void add_intervals(const std::vector<double>& a, const std::vector<double>& b, double length_s,
                   std::vector<std::size_t> ends, Verdict& v) {
  double seen = 1;  // share of the variance that the parts show
  if (const std::size_t n = a.size(); ends.empty()) {
    const std::size_t blocks =
        std::min(n, std::max(kLeastBlocks, static_cast<std::size_t>(length_s / kBlock_s)));
    for (std::size_t k = 1; k <= blocks; ++k) ends.push_back((k * n + blocks - 1) / blocks);
    const double of_one = mean_variance(length_s / static_cast<double>(blocks));
    seen = (of_one / mean_variance(length_s) - 1) / (static_cast<double>(blocks) - 1);
  }
  // What a part adds to the RMSE's deviation, to first order.
  const auto part_deg = [](const std::vector<double>& error, double rmse_deg, std::size_t k,
                           std::size_t end) {
    double excess = 0;
    for (; k < end; ++k) excess += error[k] * error[k] - rmse_deg * rmse_deg;
    return rmse_deg > 0 ? excess / (2 * rmse_deg * static_cast<double>(error.size())) : 0;
  };
  double own = 0;
  double both = 0;
  std::size_t begin = 0;
  for (const std::size_t end : ends) {
    const double part = part_deg(a, v.rmse_deg, begin, end);
    own += part * part;
    both += std::pow(part - part_deg(b, v.baseline_deg, begin, end), 2);
    begin = end;
  }
  const double few = static_cast<double>(ends.size()) - 1;
  const double wide = student_t(static_cast<int>(few)) * std::sqrt((1 + 1 / few) / seen);
  const double factor = v.rmse_deg > 0 ? std::exp(wide * std::sqrt(own) / v.rmse_deg) : 1;
  v.rmse_low_deg = v.rmse_deg / factor;
  v.rmse_high_deg = v.rmse_deg * factor;
  v.low_deg = v.rmse_deg - v.baseline_deg - wide * std::sqrt(both);
  v.high_deg = v.rmse_deg - v.baseline_deg + wide * std::sqrt(both);
}

}  // namespace

double rms(std::span<const double> error) {
  double squares = 0;
  for (const double e : error) squares += e * e;
  return std::sqrt(squares / static_cast<double>(error.size()));
}

double student_t(int degrees) {
  constexpr double kTable[] = {12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228};
  if (degrees <= 10) return kTable[degrees - 1];
  constexpr double z = kNormal95;
  return z + (z * z * z + z) / (4. * degrees) +
         (5 * std::pow(z, 5) + 16 * z * z * z + 3 * z) / (96. * degrees * degrees);
}

Verdict judge(const std::vector<double>& error_deg,
              const std::map<std::string, std::vector<double>>& baseline_error_deg, double period_s,
              const std::vector<std::size_t>& part_ends) {
  Verdict v;
  v.rmse_deg = rms(error_deg);
  for (const auto& [name, error] : baseline_error_deg) {
    const double rmse_deg = rms(error);
    if (!v.baseline.empty() && !(rmse_deg < v.baseline_deg)) continue;
    v.baseline = name;
    v.baseline_deg = rmse_deg;
  }
  const double length_s = static_cast<double>(error_deg.size()) * period_s;
  v.has_interval = part_ends.empty() || part_ends.size() >= kLeastParts;
  if (!v.has_interval) return v;
  add_intervals(error_deg, v.baseline.empty() ? error_deg : baseline_error_deg.at(v.baseline), length_s,
                part_ends, v);
  if (v.baseline.empty()) return v;
  if (v.high_deg < 0) v.word = Verdict::Word::better;
  if (v.low_deg > 0) v.word = Verdict::Word::worse;
  return v;
}

std::string in_words(const Verdict& v) {
  std::string out = fmt::format("{:.2f} deg", v.rmse_deg);
  if (v.has_interval) out += fmt::format(" (95 %: {:.2f} to {:.2f})", v.rmse_low_deg, v.rmse_high_deg);
  out += " on data it never saw";
  const auto itself = std::ranges::find(kBaselines, v.itself, &Baseline::name);
  if (itself != kBaselines.end()) out += fmt::format("; it is {} itself", itself->words);
  const auto baseline = std::ranges::find(kBaselines, v.baseline, &Baseline::name);
  if (baseline == kBaselines.end()) return out + "; no baseline could be fitted";
  out += fmt::format("; the best baseline, {}, {:.2f}: ", baseline->words, v.baseline_deg);
  if (!v.has_interval)
    return out + fmt::format("no verdict on fewer than {} parts left out; record more", kLeastParts);
  out += fmt::format("{} (difference {:+.2f}, 95 %: {:+.2f} to {:+.2f})", word_of(v),
                     v.rmse_deg - v.baseline_deg, v.low_deg, v.high_deg);
  if (v.word == Verdict::Word::better) return out;
  out += v.word == Verdict::Word::worse ? "; record more" : "; the data do not distinguish them: record more";
  if (!v.advises || v.rmse_deg <= v.baseline_deg) return out;
  return out + ", or take that: --structure " + io::shell_word(baseline->structure);
}

nlohmann::ordered_json to_json(const Verdict& v) {
  using Json = nlohmann::ordered_json;
  const auto interval = [&](double low, double high) { return v.has_interval ? Json({low, high}) : Json(); };
  const Json own = interval(v.rmse_low_deg, v.rmse_high_deg);
  if (v.baseline.empty()) return {{"word", nullptr}, {"rmse_interval95_deg", own}, {"words", in_words(v)}};
  return {{"word", v.has_interval ? Json(word_of(v)) : Json()},
          {"rmse_interval95_deg", own},
          {"baseline", v.baseline},
          {"itself", v.itself.empty() ? Json() : Json(v.itself)},
          {"difference_deg", v.rmse_deg - v.baseline_deg},
          {"interval95_deg", interval(v.low_deg, v.high_deg)},
          {"words", in_words(v)}};
}

}  // namespace flexor::score
