#include "host/study/null_model.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "host/study/catalogue.hpp"
#include "host/study/log_rms.hpp"

namespace flexor::study {
namespace {

double constant_log_rms(const NullModel& model, int from, int to) {
  LogRms out;
  for (const auto& [compensator, constant] : model.error_deg_s) {
    for (int g = from; g <= to; ++g) out.add(constant, *published_error_deg_s(g, compensator));
  }
  return out.value();
}

}  // namespace

NullModel null_model() {
  NullModel out;
  for (const std::string& c : published_compensators()) {
    double sum = 0;
    for (int g = 1; g <= kLastFittedGesture; ++g) sum += std::log(*published_error_deg_s(g, c));
    out.error_deg_s[c] = std::exp(sum / kLastFittedGesture);
  }
  out.fitted_log_rms = constant_log_rms(out, 1, kLastFittedGesture);
  out.other_log_rms = constant_log_rms(out, kLastFittedGesture + 1, kLastGesture);
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
