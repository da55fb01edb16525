#include "host/study/laboratory.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "host/io/io.hpp"
#include "host/study/glove_fit.hpp"
#include "host/study/shape_check.hpp"

namespace flexor::study {
namespace {

using Json = nlohmann::ordered_json;

void add_cells(const std::string& scenario, const Result& result, Json& out) {
  for (const Cell& cell : result.cells) {
    out.push_back({{"scenario", scenario},
                   {"gesture", cell.gesture > 0 ? Json(cell.gesture) : Json(cell.motion)},
                   {"compensator", cell.compensator},
                   {"error_deg_s", cell.total_deg_s.mean()}});
  }
}

}  // namespace

Json play_laboratory(const LaboratoryPlan& laboratory) {
  Plan plan = laboratory.plan;
  const GloveRequest request{plan.parameters, laboratory.rate_hz, 1, laboratory.glove_seed};
  const GloveFit glove = fit_glove(request, record_glove(request));
  for (const Compensator& c : glove.baselines) plan.compensators.push_back(c);
  plan.compensators.push_back({"identified", glove.identified});
  const Result ordinary = run(plan, {});
  Json cells = Json::array();
  add_cells("", ordinary, cells);
  Json shapes = to_json(shape_checks(ordinary, plan));
  for (const Scenario& scenario : laboratory.scenarios) {
    Plan changed = plan;
    for (const std::string& assignment : scenario.set) twin::assign(changed.parameters, assignment);
    add_cells(scenario.name, run(changed, {}), cells);
  }
  return {{"cells", std::move(cells)},
          {"lead_s", glove.lead_s ? Json(*glove.lead_s) : Json(nullptr)},
          {"shapes", std::move(shapes)}};
}

}  // namespace flexor::study
