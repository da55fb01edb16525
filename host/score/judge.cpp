#include "host/score/judge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>
#include <tuple>
#include <utility>

#include "host/io/io.hpp"

namespace flexor::score {
namespace {

constexpr double kBlock_s = 5;
constexpr std::size_t kLeastBlocks = 6;
constexpr std::size_t kLeastParts = 4;  // fewer can be drawn in less than the forty ways that 2.5 % need
constexpr std::size_t kDraws = 1000;
constexpr unsigned kSeed = 2019;
constexpr double kNoError = 1e-12;  // squared, whose logarithm is still a number

const char* word_of(const Verdict& v) {
  constexpr std::array kWords = {"better", "as good", "worse"};
  return kWords.at(static_cast<std::size_t>(v.word));
}

std::vector<std::size_t> block_ends(std::size_t n, double period_s) {
  const auto long_enough = static_cast<std::size_t>(static_cast<double>(n) * period_s / kBlock_s);
  const std::size_t blocks = std::min(n, std::max(kLeastBlocks, long_enough));
  std::vector<std::size_t> out;
  for (std::size_t b = 1; b <= blocks; ++b) out.push_back((b * n + blocks - 1) / blocks);
  return out;
}

// 95 % intervals of the RMSE and of the difference of both.
void add_intervals(const std::vector<double>& a, const std::vector<double>& b,
                   const std::vector<std::size_t>& ends, Verdict& v) {
  const std::size_t n = a.size();
  const std::size_t blocks = ends.size();
  struct Sums {
    double a = 0;
    double b = 0;
    double count = 0;
  };
  std::vector<Sums> sums(blocks);
  std::size_t block = 0;
  for (std::size_t k = 0; k < n; ++k) {
    while (k >= ends[block]) ++block;
    Sums& of = sums[block];
    of.a += a[k] * a[k];
    of.b += b[k] * b[k];
    of.count += 1;
  }
  std::mt19937 random(kSeed);
  std::vector<double> own(kDraws);
  std::vector<double> drawn(kDraws);
  for (std::size_t k = 0; k < kDraws; ++k) {
    Sums all;
    for (std::size_t i = 0; i < blocks; ++i) {
      const Sums& one = sums[random() % blocks];
      all.a += one.a;
      all.b += one.b;
      all.count += one.count;
    }
    own[k] = std::log(std::max(all.a / all.count, kNoError)) / 2;
    drawn[k] = std::sqrt(all.a / all.count) - std::sqrt(all.b / all.count);
  }
  // Few blocks vary less than their population, by (n - 1) / n, and tell how much only roughly.
  const double few = static_cast<double>(blocks) - 1;
  const double wider = blocks < 2 ? 1 : std::sqrt(1 + 1 / few) * student_t(static_cast<int>(few)) / kNormal95;
  const auto about = [&](double value, std::vector<double>& draws) {
    std::ranges::sort(draws);
    return std::pair(value + wider * (draws[kDraws / 40] - value),
                     value + wider * (draws[kDraws - 1 - kDraws / 40] - value));
  };
  const auto own_ends =
      about(std::log(std::max(v.rmse_deg, std::sqrt(kNoError))), own);  // never below zero, and less skewed
  v.rmse_low_deg = std::exp(own_ends.first);
  v.rmse_high_deg = std::exp(own_ends.second);
  std::tie(v.low_deg, v.high_deg) = about(v.rmse_deg - v.baseline_deg, drawn);
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
  v.has_interval = part_ends.empty() || part_ends.size() >= kLeastParts;
  if (!v.has_interval) return v;
  add_intervals(error_deg, v.baseline.empty() ? error_deg : baseline_error_deg.at(v.baseline),
                part_ends.empty() ? block_ends(error_deg.size(), period_s) : part_ends, v);
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
    return out + fmt::format("no verdict on fewer than {} parts that were left out", kLeastParts);
  out += fmt::format("{} (difference {:+.2f}, 95 %: {:+.2f} to {:+.2f})", word_of(v),
                     v.rmse_deg - v.baseline_deg, v.low_deg, v.high_deg);
  if (v.word == Verdict::Word::better) return out;
  out += v.word == Verdict::Word::worse ? "; record more" : "; the data do not tell them apart: record more";
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
