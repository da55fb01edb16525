#include "host/study/results.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/io/io.hpp"
#include "host/io/json.hpp"

namespace flexor::study {
namespace {

using Json = nlohmann::ordered_json;

// Joint angles of a finger at the end, from straight: MCP, PIP (the thumb's IP) and DIP.
Json final_posture(const twin::Parameters& p, const std::array<std::vector<float>, kFingers>& angle_deg) {
  Json out = Json::object();
  for (std::size_t i = 0; i < kFingers; ++i) {
    const twin::Posture joints =
        twin::posture(static_cast<int>(i), static_cast<double>(angle_deg[i].back()) - p.hand_lower_deg[i]);
    out[model::finger_names()[i]] = {joints.mcp_deg, joints.pip_deg, joints.dip_deg};
  }
  return out;
}

std::string to_csv(const twin::Trial& trial, double camera_rate_hz) {
  fmt::memory_buffer out;
  const auto add = [&]<class... Args>(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(out), format, std::forward<Args>(args)...);
  };
  add("t_s");
  for (const std::string& finger : model::finger_names()) add(",{0}_finger_deg,{0}_hand_deg", finger);
  for (std::size_t k = 0; k < trial.hand_deg[0].size(); ++k) {
    add("\n{:.4f}", static_cast<double>(k) / camera_rate_hz);
    for (std::size_t i = 0; i < kFingers; ++i)
      add(",{:.2f},{:.2f}", trial.glove_deg[i][k], trial.hand_deg[i][k]);
  }
  add("\n");
  return fmt::to_string(out);
}

// Writes the traces; what results.json says of them.
Json save_traces(const Plan& plan, const std::filesystem::path& folder) {
  io::make_folder(folder / "traces");
  Json motions = Json::array();
  for (std::size_t m = 0; m < plan.motions.size(); ++m) {
    const twin::Motion& motion = plan.motions[m];
    Json traces = Json::array();
    Json finger;
    for (std::size_t c = 0; c < plan.compensators.size(); ++c) {
      if (plan.stop != nullptr && plan.stop->load()) throw io::Cancelled("stopped");
      const twin::Trial trial = first_trial(plan, motion, plan.compensators[c]);
      const std::string file = fmt::format("traces/motion{}_compensator{}.csv", m + 1, c + 1);
      io::write_file(folder / file, to_csv(trial, plan.parameters.camera_rate_hz));
      if (c == 0) finger = final_posture(plan.parameters, trial.glove_deg);
      traces.push_back({{"compensator", plan.compensators[c].name},
                        {"file", file},
                        {"final_posture_deg", final_posture(plan.parameters, trial.hand_deg)}});
    }
    motions.push_back({{"name", motion.name()},
                       {"gesture", motion.number() > 0 ? Json(motion.number()) : Json(nullptr)},
                       {"duration_s", motion.duration_s()},
                       {"final_posture_deg", std::move(finger)},
                       {"traces", std::move(traces)}});
  }
  return motions;
}

}  // namespace

Json to_json(const ScenarioResult& s, const Plan& plan) {
  const Stops stops = stops_of(s.result);
  return {{"name", s.scenario.name},
          {"set", s.scenario.set},
          {"worn_s", s.scenario.worn_s},
          {"drift_turns_s", s.scenario.drift_turns_s},
          {"tracked", s.scenario.tracked},
          {"recalibrated", s.scenario.recalibrated},
          {"cells", to_json(s.result, plan).at("cells")},
          {"impact_deg_s", stops.impact_deg_s},
          {"pressed_s", stops.pressed_s}};
}

Stops stops_of(const Result& r) {
  Stops out;
  for (std::size_t c = 0; c < r.compensators.size(); ++c) {
    double pressed_s = 0;
    for (std::size_t m = 0; m < r.motions.size(); ++m) {
      const Cell& cell = r.cell(m, c);
      out.impact_deg_s = std::max(out.impact_deg_s, cell.fastest_impact_deg_s());
      pressed_s += cell.total_pressed_s() / static_cast<double>(r.motions.size());
    }
    out.pressed_s = std::max(out.pressed_s, pressed_s);
  }
  return out;
}

void save_results(const Plan& plan, const Result& result, const std::vector<ScenarioResult>& scenarios,
                  const std::filesystem::path& folder) {
  Json json = {{"kind", "experiment"}};
  json.update(to_json(result, plan));
  json["compensators"] = result.compensators;
  json["motions"] = save_traces(plan, folder);
  json["scenarios"] = Json::array();
  for (const ScenarioResult& s : scenarios) json["scenarios"].push_back(to_json(s, plan));
  json["twin"] = Json::parse(twin::to_json(plan.parameters));
  io::write_file(folder / "results.json", io::dump(json));
}

}  // namespace flexor::study
