#include "host/study/published.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace flexor::study {
namespace {

struct Published {
  const char* compensator;
  double error_deg_s[6];
  double trials_deg_s[kPublishedTrials][6];
};
// Tables 1 and 2: averages of three trials, and the trials.
constexpr Published kPublished[] = {{"raw",
                                     {681.04, 956.0, 1346.2, 860.0, 1086.5, 515.4},
                                     {{1036.21, 701.5, 2014.2, 1201.2, 1479, 418.5},
                                      {545.7, 1654.14, 1023.1, 721.78, 1080.25, 525.3},
                                      {461.21, 512.23, 1001.2, 657.12, 700.23, 602.3}}},
                                    {"published-w",
                                     {186.25, 221.91, 208.93, 206.90, 347.0, 368.7},
                                     {{354.2, 412.21, 401.28, 70.254, 299.5, 315.9},
                                      {144.25, 152.25, 101.25, 98.321, 441.2, 401},
                                      {60.214, 101.27, 124.27, 452.12, 300.2, 389.3}}},
                                    {"published-hw",
                                     {64.21, 47.66, 101.90, 39.02, 77.69, 78.2},
                                     {{136.7, 97.75, 254.3, 76.76, 39.47, 48.4},
                                      {49.8, 39.1, 39.34, 37.03, 108.3, 81.3},
                                      {6.131, 6.137, 12.08, 3.283, 85.3, 104.9}}}};

// None: not in the article.
const Published* row_of(int gesture, const std::string& compensator) {
  const auto it = std::ranges::find(kPublished, compensator, &Published::compensator);
  return it != std::end(kPublished) && gesture >= 1 && gesture <= kLastGesture ? it : nullptr;
}

}  // namespace

const std::vector<std::string>& published_compensators() {
  static const std::vector<std::string> names = {kPublished[0].compensator, kPublished[1].compensator,
                                                 kPublished[2].compensator};
  return names;
}

std::optional<double> published_error_deg_s(int gesture, const std::string& compensator) {
  const Published* row = row_of(gesture, compensator);
  return row != nullptr ? std::optional(row->error_deg_s[gesture - 1]) : std::nullopt;
}

std::array<double, kPublishedTrials> published_trials_deg_s(int gesture, const std::string& compensator) {
  const Published* row = row_of(gesture, compensator);
  if (row == nullptr) throw io::InputError("gesture {} with {} is not in the article", gesture, compensator);
  std::array<double, kPublishedTrials> out{};
  for (std::size_t t = 0; t < kPublishedTrials; ++t) out[t] = row->trials_deg_s[t][gesture - 1];
  return out;
}

Json null_model() {
  Json constants = Json::object();
  LogRms fitted;
  LogRms other;
  for (const std::string& c : published_compensators()) {
    double sum = 0;
    for (int g = 1; g <= kLastFittedGesture; ++g) sum += std::log(*published_error_deg_s(g, c));
    const double constant = std::exp(sum / kLastFittedGesture);
    constants[c] = constant;
    for (int g = 1; g <= kLastGesture; ++g)
      (g <= kLastFittedGesture ? fitted : other).add(constant, *published_error_deg_s(g, c));
  }
  return {{"what", "one constant for each compensator, fitted to gestures 1 to 4"},
          {"error_deg_s", std::move(constants)},
          {"log_rms_gestures_1_to_4", fitted.value()},
          {"log_rms_gestures_5_and_6", other.value()}};
}

}  // namespace flexor::study
