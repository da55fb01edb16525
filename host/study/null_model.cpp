#include "host/study/null_model.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "host/study/catalogue.hpp"

namespace flexor::study {
namespace {

constexpr int kFitted = 4;  // gestures 1 to 4

double constant_log_rms(const NullModel& model, int from, int to) {
  double sum = 0;
  int n = 0;
  for (const auto& [compensator, constant] : model.error_deg_s) {
    for (int g = from; g <= to; ++g, ++n) {
      const double l = std::log(constant / *published_error_deg_s(g, compensator));
      sum += l * l;
    }
  }
  return std::sqrt(sum / n);
}

}  // namespace

NullModel null_model() {
  NullModel out;
  for (const std::string& c : published_compensators()) {
    double sum = 0;
    for (int g = 1; g <= kFitted; ++g) sum += std::log(*published_error_deg_s(g, c));
    out.error_deg_s[c] = std::exp(sum / kFitted);
  }
  out.fitted_log_rms = constant_log_rms(out, 1, kFitted);
  out.other_log_rms = constant_log_rms(out, kFitted + 1, 6);
  return out;
}

nlohmann::ordered_json to_json(const NullModel& model) {
  nlohmann::ordered_json constants = nlohmann::ordered_json::object();
  for (const std::string& c : published_compensators()) constants[c] = model.error_deg_s.at(c);
  return {{"what", "one constant for each compensator, fitted to gestures 1 to 4"},
          {"error_deg_s", std::move(constants)},
          {"log_rms_gestures_1_to_4", model.fitted_log_rms},
          {"log_rms_gestures_5_and_6", model.other_log_rms}};
}

}  // namespace flexor::study
