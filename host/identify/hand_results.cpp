#include "host/identify/hand_results.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <span>

#include "host/identify/readings.hpp"
#include "host/identify/robust.hpp"
#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/recording/csv.hpp"

namespace flexor::identify {
namespace {

using Json = nlohmann::ordered_json;

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
Json static_map(const HandIdentification& r, std::size_t j) {
  constexpr int kPoints = 300;
  std::vector<double> row(r.proven.inputs.size(), std::numeric_limits<double>::quiet_NaN());
  const std::vector<std::string>& sensors = r.request.map[j].sensors;
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

Json sensors(const HandIdentification& r, const JointMap& joint) {
  Json out = Json::array();
  for (const std::string& sensor : joint.sensors) {
    const auto input = std::ranges::find(r.model.inputs, sensor, &model::Input::name);
    if (input == r.model.inputs.end()) continue;
    out.push_back({{"column", sensor}, {"unit", input->unit}});
  }
  return out;
}

// Names of files, not where they lie: a report may be sent to others.
void add_origins(const HandIdentification& r, Json& pairs) {
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

Json results(const HandIdentification& r) {
  Json json = to_json(r);
  json["kind"] = "hand";
  json["rate_hz"] = r.request.rate_hz;
  json["split"] = r.request.split;
  json["lead_s"] = r.request.lead_s;
  json["fit_all"] = r.request.fit_all;
  json["structure_asked_for"] = r.request.refit ? "refit" : r.request.structure;
  json["clock_offset_given"] = r.request.clock_offset_s.has_value();
  add_origins(r, json["pairs"]);
  for (std::size_t j = 0; j < r.joints.size(); ++j) {
    Json& joint = json["joints"][r.joints[j].name];
    joint.erase("held_out_curve");  // samples-N.csv has it whole
    joint["sensors"] = sensors(r, r.request.map[j]);
    joint["reference"] = r.request.map[j].reference;
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
std::string scores_csv(const HandIdentification& r) {
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

void save_hand_results(const HandIdentification& r, const std::filesystem::path& folder) {
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
