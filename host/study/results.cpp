#include "host/study/results.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/study/published.hpp"
#include "runtime/link/hand_end.hpp"

namespace flexor::study {
namespace {

Json statistic_json(const Statistic& s) { return {{"mean", s.mean()}, {"ci95", s.ci95()}}; }

template <class Value>
Json by_finger(const Value& value) {
  Json out = Json::object();
  for (std::size_t i = 0; i < kFingers; ++i) out[model::finger_names()[i]] = value(i);
  return out;
}

Json cell_json(const Cell& c, const std::vector<std::string>& compensators) {
  const auto if_any = [](const Statistic& s) { return s.count() > 0 ? statistic_json(s) : Json(nullptr); };
  Json differences = Json::object();
  for (std::size_t j = 0; j < compensators.size(); ++j) {
    if (compensators[j] != c.compensator)
      differences[compensators[j]] = statistic_json(c.difference_deg_s[j]);
  }
  return {{"gesture", c.gesture > 0 ? Json(c.gesture) : Json(c.motion)},
          {"compensator", c.compensator},
          {"trials", c.total_deg_s.count()},
          {"total_error_deg_s", statistic_json(c.total_deg_s)},
          {"lag_removed_deg_s", if_any(c.lag_removed_deg_s)},
          {"lag_s", if_any(c.lag_s)},
          {"trials_with_a_lag", c.lag_s.count()},
          {"published_deg_s", c.published_deg_s},
          {"finger_error_deg_s", by_finger([&](std::size_t i) { return c.finger_deg_s[i].mean(); })},
          {"swing_deg", by_finger([&](std::size_t i) { return c.swing_deg[i].mean(); })},
          {"difference_deg_s", std::move(differences)},
          {"impact_deg_s", by_finger([&](std::size_t i) { return c.impact_deg_s[i]; })},
          {"pressed_s", by_finger([&](std::size_t i) { return c.pressed_s[i].mean(); })},
          {"frames_sent", c.frames_sent},
          {"frames_lost", c.frames_lost}};
}

// Every cell, and the worst compensator's fastest hit of any trial and mean of a trial's pressing over the motions.
Json cells_json(const Result& r) {
  Json cells = Json::array();
  for (const Cell& c : r.cells) cells.push_back(cell_json(c, r.compensators));
  double impact_deg_s = 0;
  double most_pressed_s = 0;
  for (std::size_t c = 0; c < r.compensators.size(); ++c) {
    double pressed_s = 0;
    for (std::size_t m = 0; m < r.motions.size(); ++m) {
      const Cell& cell = r.cell(m, c);
      impact_deg_s = std::max(impact_deg_s, std::ranges::max(cell.impact_deg_s));
      pressed_s += cell.total_pressed_s() / static_cast<double>(r.motions.size());
    }
    most_pressed_s = std::max(most_pressed_s, pressed_s);
  }
  return {{"cells", std::move(cells)}, {"impact_deg_s", impact_deg_s}, {"pressed_s", most_pressed_s}};
}

const Cell* find(const Result& result, int gesture, const std::string& compensator) {
  for (const Cell& cell : result.cells)
    if (cell.gesture == gesture && cell.compensator == compensator) return &cell;
  return nullptr;
}

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

// Writes the traces; what results.json has of them.
Json save_traces(const Plan& plan, const std::filesystem::path& folder) {
  io::make_folder(folder / "traces");
  Json motions = Json::array();
  for (std::size_t m = 0; m < plan.motions.size(); ++m) {
    const twin::Motion& motion = plan.motions[m];
    Json traces = Json::array();
    Json finger;
    for (std::size_t c = 0; c < plan.compensators.size(); ++c) {
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

std::optional<Distance> distance(const Result& result, int from, int to) {
  std::set<int> gestures;
  Distance out;
  const Json null = null_model().at("error_deg_s");
  LogRms ours;
  LogRms constants;
  for (const Cell& cell : result.cells) {
    if (!cell.published_deg_s || cell.gesture < from || cell.gesture > to) continue;
    ours.add(cell.total_deg_s.mean(), *cell.published_deg_s);
    constants.add(null.at(cell.compensator).get<double>(), *cell.published_deg_s);
    gestures.insert(cell.gesture);
    if (std::ranges::find(out.compensators, cell.compensator) == out.compensators.end())
      out.compensators.push_back(cell.compensator);
  }
  if (ours.count() == 0) return std::nullopt;
  out.log_rms = ours.value();
  out.null_model_log_rms = constants.value();
  out.gestures.assign(gestures.begin(), gestures.end());
  out.is_all = static_cast<int>(out.gestures.size()) == to - from + 1;
  return out;
}

std::vector<std::string> warnings(const Result& result, const Plan& plan) {
  const twin::Parameters& p = plan.parameters;
  const double period_s = plan.compensators.front().model.sample_period_s;
  const double frame_s = p.frame_rate_hz > 0 ? std::max(1 / p.frame_rate_hz, period_s) : period_s;
  const double delay_ms = 1000 * (p.module_latency_s + p.jitter_s);
  const double greatest_ms = link::greatest_delay_ms(1000 * frame_s);
  std::vector<std::string> out;
  if (plan.engine == nullptr && delay_ms > greatest_ms)
    out.push_back(
        fmt::format("the radio delays by {:g} ms (radio.module_latency_s, radio.jitter_s): the firmware's "
                    "guarded link follows up to {:g} ms, the twin has no such limit",
                    delay_ms, greatest_ms));
  const auto cell = std::ranges::find_if(result.cells, [](const Cell& c) { return c.silent_trials > 0; });
  if (cell == result.cells.end()) return out;
  const auto silent = std::ranges::count_if(result.cells, [](const Cell& c) { return c.silent_trials > 0; });
  out.push_back(fmt::format(
      "{} with {}{}: at most half of the frames reached the hand in {} of {} trials: its error is the "
      "radio's, no "
      "compensator's; see radio.* of the twin, and runtime/link/PROTOCOL.md for the greatest delay",
      cell->motion, cell->compensator, silent > 1 ? fmt::format(" and {} others", silent - 1) : "",
      cell->silent_trials, cell->total_deg_s.count()));
  return out;
}

Json shape_checks(const Result& result, const Plan& plan) {
  Json out = Json::array();
  const auto place = [](const std::string& compensator, std::size_t finger) {
    return fmt::format("{}, {}", compensator, model::finger_names()[finger]);
  };
  if (const Cell* raw = find(result, 2, "raw")) {
    const std::size_t stillest = raw->swing_deg[1].mean() < raw->swing_deg[2].mean() ? 1 : 2;
    const double swing_deg = raw->swing_deg[stillest].mean();
    out.push_back(
        {{"gesture", 2},
         {"what", "large fluctuations: swing of index and middle, which the person keeps still, with raw"},
         {"where", place("raw", stillest)},
         {"value_deg", swing_deg},
         {"at_least_deg", kLargeSwing_deg},
         {"agrees", swing_deg >= kLargeSwing_deg}});
  }
  std::pair<double, std::string> largest{-1, ""};
  for (const std::string& c : published_compensators()) {
    const Cell* cell = find(result, 4, c);
    if (cell == nullptr) return out;
    const auto motion = std::ranges::find(plan.motions, 4, &twin::Motion::number);
    for (std::size_t i = 2; i < kFingers; ++i)
      largest = std::max(largest, {cell->finger_deg_s[i].mean() / motion->duration_s(), place(c, i)});
  }
  out.push_back(
      {{"gesture", 4},
       {"what", "no significant deviations: mean |e| of middle, ring and pinky with all compensators"},
       {"where", largest.second},
       {"value_deg", largest.first},
       {"at_most_deg", kSignificant_deg},
       {"agrees", largest.first <= kSignificant_deg}});
  return out;
}

Json to_json(const Result& r, const Plan& plan) {
  const auto whole = [](const std::optional<Distance>& d) {
    return d && d->is_all ? Json(d->log_rms) : Json(nullptr);
  };
  const std::optional<Distance> fitted = distance(r, 1, kLastFittedGesture);
  const std::optional<Distance> not_fitted = distance(r, kLastFittedGesture + 1, kLastGesture);
  Json out = cells_json(r);
  out.update({{"log_rms",
               {{"gestures_1_to_4", whole(fitted)},
                {"gestures_5_and_6", whole(not_fitted)},
                {"all", whole(distance(r, 1, kLastGesture))},
                {"fitted", fitted},
                {"not_fitted", not_fitted}}},
              {"null_model", null_model()},
              {"shapes", shape_checks(r, plan)},
              {"engine", plan.engine != nullptr ? plan.engine->name() : "twin"},
              {"rate_hz", 1 / plan.compensators.front().model.sample_period_s},
              {"seed", plan.seed},
              {"warnings", warnings(r, plan)},
              {"version", FLEXOR_VERSION}});
  return out;
}

Json to_json(const ScenarioResult& s) {
  Json out = s.scenario;
  out.update(cells_json(s.result));
  return out;
}

void save_results(const Plan& plan, const Result& result, const std::vector<ScenarioResult>& scenarios,
                  const std::filesystem::path& folder) {
  Json json = {{"kind", "experiment"}};
  json.update(to_json(result, plan));
  json["compensators"] = result.compensators;
  json["motions"] = save_traces(plan, folder);
  json["scenarios"] = Json::array();
  for (const ScenarioResult& s : scenarios) json["scenarios"].push_back(to_json(s));
  json["twin"] = Json::parse(twin::to_json(plan.parameters));
  io::write_file(folder / "results.json", io::dump(json));
}

}  // namespace flexor::study
