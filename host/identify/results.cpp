#include "host/identify/results.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/identify/identify_files.hpp"
#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/model/channel.hpp"
#include "host/model/compensator.hpp"
#include "host/recording/csv.hpp"

namespace flexor::identify {
namespace {

using Json = nlohmann::ordered_json;

template <class T>
Json or_null(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json alignment(const Identification& r) {
  if (!r.aligned.alignment) return nullptr;
  const recording::Alignment& a = *r.aligned.alignment;
  Json quarters = Json::array();
  for (const auto& quarter : a.quarter_offset_s) quarters.push_back(or_null(quarter));
  return {{"confidence", a.confidence},
          {"offset_given", r.request.clock_offset_s.has_value()},
          {"quarter_offset_s", std::move(quarters)},
          {"drift_ppm", or_null(a.drift_ppm)}};
}

// Where a finger's angle settles, reading by reading: there every block starts at rest.
Json static_map(const Identification& r) {
  const model::Compensator<model::DoubleArithmetic> fresh(r.model);
  const auto [low, high] = std::ranges::minmax(r.aligned.input);
  constexpr int kPoints = 300;
  Json reading = Json::array();
  Json angle = Json::array();
  for (int i = 0; i <= kPoints; ++i) {
    const double at = low + (high - low) * i / kPoints;
    auto still = fresh;
    reading.push_back(at);
    angle.push_back(still.step(at).angle_deg);
  }
  return {{"reading", std::move(reading)}, {"angle_deg", std::move(angle)}};
}

// The linear part's answer to a step of 1 at t = 0, as a share of where it ends; none where it is not one part.
Json step_response(const Identification& r) {
  const auto chain = model::channel(r.model, 0);
  if (!chain) return nullptr;
  model::Channel channel;
  channel.name = r.model.joints.front().name;
  channel.lti = chain->lti;
  channel.lti.gain = 1;
  channel.lti.offset = 0;
  channel.valid_min = -10;
  channel.valid_max = 10;
  channel.saturation = {-100, 100};
  const model::Model m = model::model_of(channel, r.model.sample_period_s);
  model::Compensator<model::DoubleArithmetic> step(m);
  double slowest = 5;
  for (const double pole : channel.lti.poles_rad_s) slowest = std::min(slowest, -pole);
  const auto rows = static_cast<int>(std::clamp(4 / slowest, 0.5, 10.0) / m.sample_period_s) + 1;
  (void)step.step(0.0);
  Json t_s = Json::array({-m.sample_period_s});
  Json share = Json::array({0});
  for (int k = 0; k < rows; ++k) {
    t_s.push_back(k * m.sample_period_s);
    share.push_back(step.step(1.0).angle_deg);
  }
  return {{"t_s", std::move(t_s)}, {"share", std::move(share)}};
}

Json knots(const Identification& r) {
  const auto channel = model::channel(r.model, 0);
  if (!channel || !channel->input_curve) return nullptr;
  return {{"reading", channel->input_curve->x}, {"angle_deg", channel->input_curve->y}};
}

Json parameters(const Identification& r) {
  Json out = Json::array();
  for (const Parameter& p : r.fit.parameters) {
    out.push_back({{"name", p.name},
                   {"value", p.value},
                   {"standard_error", p.refused ? Json(nullptr) : Json(p.standard_error)}});
  }
  return out;
}

Json origin(const recording::Recording& log, const std::string& column) {
  return {{"file", io::to_utf8(std::filesystem::path(log.source).filename().string())},
          {"digest", log.digest},
          {"column", column}};
}

Json results(const Identification& r) {
  Json json = to_json(r);
  json["kind"] = "identification";
  json["sensor"] = origin(r.pair.sensor, r.pair.input);
  json["sensor"]["unit"] = r.model.inputs.front().unit;
  json["reference"] = origin(r.pair.reference, r.pair.output);
  json["rate_hz"] = r.request.rate_hz;
  json["split"] = r.request.split;
  json["structure_asked_for"] = r.request.structure;
  json["shared_s"] = r.aligned.t_s.back() - r.aligned.t_s[r.aligned.overlap_begin];
  json["alignment"] = alignment(r);
  json["fit"] = {{"parameters", parameters(r)},
                 {"condition", r.fit.condition},
                 {"samples", r.fit.used_samples},
                 {"iterations", r.fit.iterations},
                 {"starts", r.fit.starts}};
  for (std::size_t i = 0; i < r.rows.size(); ++i) {
    if (r.rows[i].refusal.empty())
      json["structures"][i]["holdout_fit_percent"] = r.rows[i].holdout.fit_percent;
  }
  json["static_map"] = static_map(r);
  json["knots"] = knots(r);
  json["step_response"] = step_response(r);
  return json;
}

recording::Recording samples(const Identification& r) {
  const recording::Aligned& a = r.aligned;
  recording::Recording out;
  out.columns = {{"reading", a.input},
                 {"measured_deg", a.angle_deg},
                 {"estimated_deg", r.estimated_deg},
                 {"straight_line_deg", r.baseline_deg},
                 {"gap", {}},
                 {"held_out", {}}};
  for (std::size_t k = 0; k < a.size(); ++k) {
    out.t_s.push_back(a.t_s[k] - a.t_s[a.overlap_begin]);  // since both logs run
    out.columns[4].value.push_back(a.gap[k]);
    out.columns[5].value.push_back(k >= r.holdout_begin ? 1 : 0);
  }
  return out;
}

std::string scan(const Identification& r) {
  const recording::Alignment a = r.aligned.alignment.value_or(recording::Alignment());
  std::string out = "clock_offset_s,explained_percent\n";
  for (std::size_t k = 0; k < a.scan_offset_s.size(); ++k)
    out += fmt::format("{},{}\n", a.scan_offset_s[k], 100 * a.scan_eta_squared[k]);
  return out;
}

}  // namespace

recording::Recording holdout(const Identification& r) {
  recording::Recording out;
  out.columns = {{"measured_deg", {}}, {"estimated_deg", {}}, {"straight_line_deg", {}}, {"gap", {}}};
  for (std::size_t k = r.holdout_begin; k < r.aligned.size(); ++k) {
    out.t_s.push_back(r.aligned.t_s[k]);
    out.columns[0].value.push_back(r.aligned.angle_deg[k]);
    out.columns[1].value.push_back(r.estimated_deg[k]);
    out.columns[2].value.push_back(r.baseline_deg[k]);
    out.columns[3].value.push_back(r.aligned.gap[k]);
  }
  return out;
}

void save_results(const Identification& r, const std::filesystem::path& folder) {
  io::make_folder(folder);
  io::write_file(folder / "holdout.csv", recording::to_csv(holdout(r)));
  io::write_file(folder / "samples.csv", recording::to_csv(samples(r)));
  io::write_file(folder / "alignment_scan.csv", scan(r));
  io::write_file(folder / "results.json", io::dump(results(r)));
}

}  // namespace flexor::identify
