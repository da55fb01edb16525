#include "host/study/shape_check.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace flexor::study {
namespace {

const Cell* find(const Result& result, int gesture, const std::string& compensator) {
  const auto it = std::ranges::find_if(result.cells, [&](const Cell& cell) {
    return cell.gesture == gesture && cell.compensator == compensator;
  });
  return it == result.cells.end() ? nullptr : &*it;
}

}  // namespace

std::vector<ShapeCheck> shape_checks(const Result& result, const Plan& plan) {
  std::vector<ShapeCheck> out;
  const auto place = [](const std::string& compensator, std::size_t finger) {
    return fmt::format("{}, {}", compensator, model::finger_names()[finger]);
  };
  if (const Cell* raw = find(result, 2, "raw")) {
    const std::size_t stillest = raw->swing_deg[1].mean() < raw->swing_deg[2].mean() ? 1 : 2;
    out.push_back({2, "large fluctuations: swing of index and middle, which the person keeps still, with raw",
                   place("raw", stillest), raw->swing_deg[stillest].mean(), kLargeSwing_deg, true});
  }
  ShapeCheck still{4,
                   "no significant deviations: mean |e| of middle, ring and pinky with all compensators",
                   "",
                   -1,
                   kSignificant_deg,
                   false};
  for (const std::string& c : published_compensators()) {
    const Cell* cell = find(result, 4, c);
    if (cell == nullptr) return out;
    const auto motion = std::ranges::find(plan.motions, 4, &twin::Motion::number);
    for (std::size_t i = 2; i < kFingers; ++i) {
      const double deviation_deg = cell->finger_deg_s[i].mean() / motion->duration_s();
      if (deviation_deg <= still.value_deg) continue;
      still.value_deg = deviation_deg;
      still.where = place(c, i);
    }
  }
  out.push_back(std::move(still));
  return out;
}

nlohmann::ordered_json to_json(const std::vector<ShapeCheck>& checks) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (const ShapeCheck& c : checks) {
    out.push_back({{"gesture", c.gesture},
                   {"what", c.what},
                   {"where", c.where},
                   {"value_deg", c.value_deg},
                   {c.is_least ? "at_least_deg" : "at_most_deg", c.threshold_deg},
                   {"agrees", c.agrees()}});
  }
  return out;
}

}  // namespace flexor::study
