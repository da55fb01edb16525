#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <span>

#include "host/identify/identify.hpp"
#include "host/identify/readings.hpp"
#include "host/identify/robust.hpp"
#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/recording/csv.hpp"

namespace flexor::identify {
namespace {

Json parameters_json(const std::vector<Parameter>& parameters) {
  Json out = Json::array();
  for (const Parameter& p : parameters) {
    const double reach = score::kNormal95 * p.standard_error;
    out.push_back({{"name", p.name},
                   {"value", p.value},
                   {"initial", p.initial},
                   {"standard_error", p.refused ? Json(nullptr) : Json(p.standard_error)},
                   {"interval95", p.refused ? Json(nullptr) : Json({p.value - reach, p.value + reach})}});
  }
  return out;
}

Json rows_json(const std::vector<ScoreRow>& rows) {
  Json out = Json::array();
  for (const ScoreRow& row : rows)
    out.push_back({{"name", row.name},
                   {"samples", row.samples},
                   {"rmse_deg", row.rmse_deg},
                   {"baselines", row.baseline_deg}});
  return out;
}

Json clocks_json(const Result& r) {
  Json out = Json::array();
  for (std::size_t p = 0; p < r.clocks.size(); ++p) {
    out.push_back({{"sensor", io::to_utf8(r.files[p].sensor.string())},
                   {"reference", io::to_utf8(r.files[p].reference.string())},
                   {"clock_offset_s", r.clocks[p].offset_s},
                   {"clock_offset_se_s", r.clocks[p].standard_error_s},
                   {"drift_ppm", r.clocks[p].drift_ppm},
                   {"drift_se_ppm", r.clocks[p].drift_se_ppm},
                   {"confidence", r.clocks[p].confidence}});
  }
  return out;
}

// Of the held-out part, thinned: what a page draws.
Json curve_json(const JointResult& joint) {
  constexpr std::size_t kMostPoints = 1200;
  std::size_t held_out = 0;
  for (const JointSamples& s : joint.samples) held_out += s.own().size() - s.own().holdout_begin;
  const std::size_t stride = held_out / kMostPoints + 1;
  Json out;
  for (const char* key : {"t_s", "measured_deg", "estimated_deg", "straight_line_deg"})
    out[key] = Json::array();
  for (const JointSamples& s : joint.samples) {
    const auto line = s.estimated_deg.find("line");
    for (std::size_t k = s.own().holdout_begin; k < s.own().size(); k += stride) {
      out["t_s"].push_back(s.since_begin_s(k));
      out["measured_deg"].push_back(s.own().angle_deg[k]);
      out["estimated_deg"].push_back(s.estimated_deg.at("")[k]);
      out["straight_line_deg"].push_back(line == s.estimated_deg.end() ? Json() : Json(line->second[k]));
    }
  }
  return out;
}

// Outside pauses, rising; never empty: with pauses all over those in them.
std::vector<double> readings(const JointResult& joint, std::size_t sensor) {
  std::vector<double> out;
  for (const JointSamples& s : joint.samples) {
    for (std::size_t k = s.begin(); k < s.own().size(); ++k) {
      if (!s.gap(k)) out.push_back(s.sensors[sensor].input[k]);
    }
  }
  const JointSamples& first = joint.samples.front();
  if (out.empty()) {
    const std::span all = std::span(first.sensors[sensor].input).subspan(first.begin());
    out = {all.begin(), all.end()};
  }
  std::ranges::sort(out);
  return out;
}

// Where the angle settles, reading by reading of the own sensor, while the joint's other ones stay at their medians.
Json static_map(const Result& r, std::size_t j) {
  constexpr int kPoints = 300;
  std::vector<double> row(r.proven.inputs.size(), std::numeric_limits<double>::quiet_NaN());
  const std::vector<std::string>& sensors = r.options.map[j].sensors;
  for (std::size_t i = 0; i < row.size(); ++i) {
    const auto sensor = std::ranges::find(sensors, r.proven.inputs[i].name);
    if (sensor == sensors.end()) continue;
    row[i] = quantile(readings(r.joints[j], static_cast<std::size_t>(sensor - sensors.begin())), 0.5);
  }
  const auto input = std::ranges::find(r.proven.inputs, sensors.front(), &model::Input::name);
  double& swept = row[static_cast<std::size_t>(input - r.proven.inputs.begin())];
  const std::vector<double> own = readings(r.joints[j], 0);
  const double low = std::max(own.front(), input->valid_min);  // others are refused, and the angle held
  const double high = std::min(own.back(), input->valid_max);
  Json reading = Json::array();
  Json angle = Json::array();
  for (int i = 0; i <= kPoints; ++i) {
    swept = low + (high - low) * i / kPoints;
    reading.push_back(swept);
    angle.push_back(still_angles(r.proven, row)[j]);
  }
  return {{"reading", std::move(reading)}, {"angle_deg", std::move(angle)}};
}

Json sensors(const Result& r, const JointMap& joint) {
  Json out = Json::array();
  for (const std::string& sensor : joint.sensors) {
    const auto input = std::ranges::find(r.model.inputs, sensor, &model::Input::name);
    if (input == r.model.inputs.end()) continue;
    out.push_back({{"column", sensor}, {"unit", input->unit}});
  }
  return out;
}

// Names of files, not where they lie: a report may be sent to others.
void add_origins(const Result& r, Json& pairs) {
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    const Json& origin = r.model.training.at("pairs").at(p);
    for (const char* key : {"sensor", "sensor_digest", "reference", "reference_digest"})
      pairs[p][key] = origin.at(key);
    double shared_s = 0;
    for (const JointResult& joint : r.joints)
      shared_s = std::max(shared_s, joint.samples[p].since_begin_s(joint.samples[p].own().size() - 1));
    pairs[p]["shared_s"] = shared_s;
  }
}

Json results(const Result& r) {
  Json json = to_json(r);
  json["kind"] = "hand";
  json["rate_hz"] = r.options.rate_hz;
  json["split"] = r.options.split;
  json["lead_s"] = r.options.lead_s;
  json["fit_all"] = r.options.fit_all;
  json["structure_asked_for"] = r.options.refit ? "refit" : r.options.structure;
  json["clock_offset_given"] = r.options.clock_offset_s.has_value();
  add_origins(r, json["pairs"]);
  for (std::size_t j = 0; j < r.joints.size(); ++j) {
    Json& joint = json["joints"][r.joints[j].name];
    joint.erase("held_out_curve");  // samples-N.csv has it whole
    joint["sensors"] = sensors(r, r.options.map[j]);
    joint["reference"] = r.options.map[j].reference;
    joint["baseline_refusals"] = r.joints[j].baseline_refusals;
    joint["static_map"] = static_map(r, j);
  }
  return json;
}

recording::Recording samples(const JointResult& joint) {
  recording::Recording out;
  for (const char* name : {"pair", "reading", "measured_deg", "estimated_deg", "straight_line_deg",
                           "line_lead_deg", "gap", "held_out"})
    out.columns.push_back({name, {}});
  for (std::size_t p = 0; p < joint.samples.size(); ++p) {
    const JointSamples& s = joint.samples[p];
    for (std::size_t k = s.begin(); k < s.own().size(); ++k) {
      const auto of = [&](const char* name) {
        const auto at = s.estimated_deg.find(name);
        return at == s.estimated_deg.end() ? std::numeric_limits<double>::quiet_NaN() : at->second[k];
      };
      const double row[] = {static_cast<double>(p + 1),
                            s.own().input[k],
                            s.own().angle_deg[k],
                            of(""),
                            of("line"),
                            of("line_lead"),
                            s.gap(k) ? 1.0 : 0.0,
                            k >= s.own().holdout_begin ? 1.0 : 0.0};
      out.t_s.push_back(s.since_begin_s(k));
      for (std::size_t c = 0; c < out.columns.size(); ++c) out.columns[c].value.push_back(row[c]);
    }
  }
  return out;
}

// Every RMSE in a row of its own.
std::string scores_csv(const Result& r) {
  std::string out = "joint,part,name,model,samples,rmse_deg,low95_deg,high95_deg\n";
  const auto add = [&](const std::string& name_of_joint, const char* part, const ScoreRow& row,
                       const score::Verdict* verdict) {
    const std::string joint = recording::quoted(name_of_joint);
    out += fmt::format("{},{},{},compensator,{},{},{}\n", joint, part, recording::quoted(row.name),
                       row.samples, row.rmse_deg,
                       verdict == nullptr || !verdict->has_interval
                           ? ","
                           : fmt::format("{},{}", verdict->rmse_low_deg, verdict->rmse_high_deg));
    for (const auto& [name, rmse_deg] : row.baseline_deg)
      out += fmt::format("{},{},{},{},{},{},,\n", joint, part, recording::quoted(row.name), name, row.samples,
                         rmse_deg);
  };
  for (const JointResult& joint : r.joints) {
    ScoreRow all = joint.all();
    all.name = "all";
    add(joint.name, "held out", all, &joint.verdict);
    for (const ScoreRow& row : joint.pairs) add(joint.name, "held out", row, nullptr);
    for (const ScoreRow& row : joint.left_out) add(joint.name, "left out", row, nullptr);
    if (!joint.left_out_verdict) continue;
    all = {"all", 0, joint.left_out_verdict->rmse_deg, {}};
    for (const ScoreRow& row : joint.left_out) all.samples += row.samples;
    add(joint.name, "left out", all, &*joint.left_out_verdict);
  }
  return out;
}

// A row and a column for each parameter, named in the first line.
std::string covariance_csv(const JointResult& joint) {
  std::string out;
  for (const Parameter& p : joint.parameters) out += (out.empty() ? "" : ",") + recording::quoted(p.name);
  out += '\n';
  for (const auto row : joint.covariance.rowwise()) out += fmt::format("{}\n", fmt::join(row, ","));
  return out;
}

}  // namespace

Json to_json(const Result& r) {
  Json joints = Json::object();
  for (std::size_t j = 0; j < r.joints.size(); ++j) {
    const JointResult& joint = r.joints[j];
    Json rows = Json::array();
    std::vector<CandidateRow> ranked = joint.rows;
    std::ranges::stable_sort(ranked, {}, [](const CandidateRow& row) {
      return std::pair(!row.chosen, row.fold_loss.value_or(HUGE_VAL));
    });
    for (const CandidateRow& row : ranked) {
      Json one = {
          {"structure", row.structure},
          {"chosen", row.chosen},
          {"cross_validated_rmse_deg", row.cross_validated_deg},
          {"fitted_rmse_deg", std::isnan(row.fitted_rmse_deg) ? Json(nullptr) : Json(row.fitted_rmse_deg)},
          {"fold_loss", row.fold_loss},
          {"fold_loss_se", row.fold_loss ? Json(row.fold_loss_se) : Json(nullptr)},
          {"effective_parameters", row.parameters},
          {"hold_drift_deg", row.hold_drift_deg}};
      if (!row.refusal.empty()) one["refusal"] = row.refusal;
      rows.push_back(std::move(one));
    }
    const model::Ends ends =
        model::ends(r.model, *std::ranges::find(r.model.joints, joint.name, &model::Joint::name));
    joints[joint.name] = {{"verdict", score::to_json(joint.verdict)},
                          {"holdout", joint.holdout},
                          {"baselines", joint.baselines},
                          {"pairs", rows_json(joint.pairs)},
                          {"lead_off_rmse_deg", {joint.sooner_deg, joint.later_deg}},
                          {"structure", joint.structure},
                          {"structure_text", joint.text},
                          {"hold_drift_deg", joint.hold_drift_deg},
                          {"ends", {{"open_deg", ends.open_deg}, {"fist_deg", ends.fist_deg}}},
                          {"fitted_rmse_deg", joint.fitted_rmse_deg},
                          {"cross_validated_rmse_deg", joint.cross_validated_deg},
                          {"effective_parameters", joint.effective},
                          {"condition", joint.condition},
                          {"iterations", joint.iterations > 0 ? Json(joint.iterations) : Json(nullptr)},
                          {"start", joint.start > 0 ? Json(joint.start) : Json(nullptr)},
                          {"parameters", parameters_json(joint.parameters)},
                          {"structures", std::move(rows)},
                          {"held_out_curve", curve_json(joint)}};
    if (!joint.left_out.empty())
      joints[joint.name]["left_out"] = {
          {"verdict", joint.left_out_verdict ? score::to_json(*joint.left_out_verdict) : Json(nullptr)},
          {"rows", rows_json(joint.left_out)}};
  }
  return {{"joints", std::move(joints)},
          {"pairs", clocks_json(r)},
          {"fit_seconds", r.fit_seconds},
          {"version", FLEXOR_VERSION},
          {"warnings", r.warnings}};
}

void save_results(const Result& r, const std::filesystem::path& folder) {
  io::make_folder(folder);
  for (std::size_t j = 0; j < r.joints.size(); ++j) {
    io::write_file(folder / fmt::format("samples-{}.csv", j + 1), recording::to_csv(samples(r.joints[j])));
    if (!r.joints[j].parameters.empty())
      io::write_file(folder / fmt::format("covariance-{}.csv", j + 1), covariance_csv(r.joints[j]));
  }
  io::write_file(folder / "scores.csv", scores_csv(r));
  io::write_file(folder / "results.json", io::dump(results(r)));
}

}  // namespace flexor::identify
