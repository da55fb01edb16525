#include "host/identify/hand.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/QR>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <set>

#include "host/identify/baselines.hpp"
#include "host/identify/estimator.hpp"
#include "host/identify/hold.hpp"
#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/model/formats.hpp"
#include "host/recording/csv.hpp"

namespace flexor::identify {
namespace {

using Json = nlohmann::ordered_json;
using io::InputError;

constexpr double kSameClock_s = 0.5;  // offsets of two joints further apart are two opinions
constexpr double kLeastClockError_s = 0.01;
constexpr double kUnsure = 0.15;
constexpr double kMostDrift_deg = 1;

// One pair of files: the sensors in one recording, a reference for each joint.
struct Files {
  recording::Recording sensor;
  std::vector<recording::Recording> reference;  // of each joint
};

struct Sampled {
  std::vector<std::vector<recording::Aligned>> sensor;  // of each joint, its sensors
};

std::vector<std::string> sensors_of(const std::vector<JointMap>& map) {
  std::vector<std::string> out;
  for (const JointMap& joint : map) {
    for (const std::string& sensor : joint.sensors) {
      if (std::ranges::find(out, sensor) == out.end()) out.push_back(sensor);
    }
  }
  return out;
}

Files read_files(const PairFiles& files, const HandRequest& request) {
  Files out;
  const std::vector<std::string> sensors = sensors_of(request.map);
  out.sensor = recording::read_csv(files.sensor, sensors, request.time_unit);
  for (const std::string& sensor : sensors) {
    recording::state_unit(out.sensor, sensor, request.input_unit);
    recording::require_change(out.sensor, sensor, "is the sensor plugged in?");
  }
  for (const JointMap& joint : request.map) {
    out.reference.push_back(recording::read_angle(files.reference, joint.reference, request.time_unit));
    recording::to_degrees(out.reference.back(), joint.reference, request.output_unit);
    recording::require_change(out.reference.back(), joint.reference, "does the camera see the marks?");
  }
  return out;
}

struct Opinion {
  double offset_s;
  double confidence;
  double error_s;  // from its quarters

  double weight() const {
    return std::max(confidence, 1e-3) / (error_s * error_s + kLeastClockError_s * kLeastClockError_s);
  }
};

Opinion opinion_of(const recording::Alignment& a) {
  std::vector<double> quarters;
  for (const auto& quarter : a.quarter_offset_s) {
    if (quarter) quarters.push_back(*quarter);
  }
  double squares = 0;
  for (const double q : quarters) squares += (q - a.clock_offset_s) * (q - a.clock_offset_s);
  const auto n = static_cast<double>(quarters.size());
  return {a.clock_offset_s, a.confidence, n > 1 ? std::sqrt(squares / (n * (n - 1))) : 0.1};
}

// All joints of a file share its clock: their offsets weighted by what they know, those that agree with the surest.
Clock clock_of(const Files& files, const HandRequest& request, std::vector<std::string>& warnings) {
  std::vector<Opinion> opinions;
  std::string reason;
  for (std::size_t j = 0; j < request.map.size(); ++j) {
    const JointMap& joint = request.map[j];
    try {
      const recording::Alignment a = recording::align(files.sensor.series(joint.sensors.front()),
                                                      files.reference[j].series(joint.reference));
      opinions.push_back(opinion_of(a));
    } catch (const io::JobError& error) {
      reason = fmt::format("{}: {}", joint.joint, error.what());
    }
  }
  const bool one_file = !files.sensor.digest.empty() && files.sensor.digest == files.reference.front().digest;
  if (request.clock_offset_s || one_file) {
    const double given = request.clock_offset_s.value_or(0);
    double confidence = 0;
    for (const Opinion& o : opinions) {
      if (std::abs(o.offset_s - given) < kSameClock_s) confidence = std::max(confidence, o.confidence);
    }
    return {given, 0, confidence};
  }
  if (opinions.empty()) throw io::JobError(reason);
  const Opinion best = *std::ranges::max_element(opinions, {}, &Opinion::confidence);
  std::erase_if(opinions,
                [&](const Opinion& o) { return std::abs(o.offset_s - best.offset_s) > kSameClock_s; });
  double weight = 0;
  double sum = 0;
  double doubt = 1;
  for (const Opinion& o : opinions) {
    weight += o.weight();
    sum += o.weight() * o.offset_s;
    doubt *= 1 - o.confidence;
  }
  Clock clock{sum / weight, 0, 1 - doubt};
  double squares = 0;
  for (const Opinion& o : opinions) {
    const double error_s = o.weight() * std::max(o.error_s, std::abs(o.offset_s - clock.offset_s));
    squares += error_s * error_s;
  }
  clock.standard_error_s = std::max(kLeastClockError_s, std::sqrt(squares) / weight);
  if (clock.confidence < kUnsure) {
    warnings.push_back(
        fmt::format("{}: the clock offset of {:+.2f} s is unsure (confidence {:.2f}): are these recordings "
                    "of one motion?",
                    files.sensor.source, clock.offset_s, clock.confidence));
  }
  return clock;
}

Sampled sample(const Files& files, const Clock& clock, const HandRequest& request) {
  Sampled out;
  for (std::size_t j = 0; j < request.map.size(); ++j) {
    out.sensor.emplace_back();
    for (const std::string& sensor : request.map[j].sensors) {
      const recording::Pair pair{files.sensor, sensor, files.reference[j], request.map[j].reference};
      recording::sample_pair(pair, request.rate_hz, clock.offset_s, request.lead_s, request.split,
                             out.sensor.back().emplace_back());
    }
  }
  return out;
}

// The fitted part alone: what is held out is not even in memory here.
Session session_of(const std::vector<recording::Aligned>& sensors) {
  const recording::Aligned& first = sensors.front();
  const auto n = static_cast<Eigen::Index>(first.holdout_begin);
  Session out;
  out.input.resize(n, std::ssize(sensors));
  for (std::size_t s = 0; s < sensors.size(); ++s) {
    out.input.col(static_cast<Eigen::Index>(s)) =
        Eigen::Map<const Eigen::VectorXd>(sensors[s].input.data(), n);
  }
  out.angle_deg = Eigen::Map<const Eigen::VectorXd>(first.angle_deg.data(), n);
  for (std::size_t k = 0; k < first.holdout_begin; ++k) {
    const bool good = std::ranges::none_of(sensors, [&](const auto& s) {
      return s.gap[k] != 0 || !(s.input[k] >= s.valid.min && s.input[k] <= s.valid.max);
    });
    out.use.push_back(good);
  }
  return out;
}

void add_inputs(const HandRequest& request, const std::vector<Files>& files,
                const std::vector<Sampled>& samples, model::Model& model) {
  std::map<std::string, recording::Range> ranges;
  std::map<std::string, std::string> strips;
  for (const Sampled& sampled : samples) {
    for (std::size_t j = 0; j < request.map.size(); ++j) {
      for (std::size_t s = 0; s < request.map[j].sensors.size(); ++s) {
        const recording::Aligned& a = sampled.sensor[j][s];
        const auto [it, fresh] = ranges.emplace(request.map[j].sensors[s], a.valid);
        if (!fresh)
          it->second = {std::min(it->second.min, a.valid.min), std::max(it->second.max, a.valid.max)};
        model.max_gap_s = std::max(model.max_gap_s, a.max_gap_s);
      }
    }
  }
  for (const JointMap& joint : request.map) {
    const std::string finger = joint.joint.substr(0, joint.joint.find('_'));
    const auto& names = model::finger_names();
    if (std::ranges::find(names, finger) != names.end()) strips.emplace(joint.sensors.front(), finger);
  }
  for (const std::string& sensor : sensors_of(request.map)) {
    const recording::Range& range = ranges.at(sensor);
    const auto strip = strips.find(sensor);
    model.inputs.push_back({sensor, sensor, files.front().sensor.column(sensor).unit,
                            strip == strips.end() ? "" : strip->second, range.min, range.max});
  }
}

model::Model with_joint(const model::Model& inputs, const Additive& fit, const JointMap& joint) {
  model::Model out = inputs;
  add_to(out, fit, joint.sensors, joint.joint);
  return out;
}

// Nobody else's inputs: a joint is tried by itself.
model::Model alone(const model::Model& inputs, const Additive& fit, const JointMap& joint) {
  model::Model own = inputs;
  std::erase_if(own.inputs, [&](const model::Input& input) {
    return std::ranges::find(joint.sensors, input.name) == joint.sensors.end();
  });
  return with_joint(own, fit, joint);
}

// Why this candidate cannot be worn; empty: it can.
std::string refusal_of(const model::Model& model, double drift_deg) {
  if (drift_deg > kMostDrift_deg) {
    return fmt::format("held still, its angle drifts by {:.1f} degrees within a minute", drift_deg);
  }
  try {
    model::check(model);
    model::check_fixed(model);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

JointResult choose(const std::vector<Session>& sessions, const model::Model& inputs, const JointMap& joint,
                   const Step& step) {
  JointResult out;
  out.name = joint.joint;
  bool chosen = false;
  const auto drift = [&](const Additive& fit) {
    return hold_drift_deg(alone(inputs, fit, joint), sessions, joint.sensors);
  };
  for (const Additive& fit :
       fit_additive(sessions, inputs.sample_period_s, joint.joint, drift, kMostDrift_deg, step)) {
    CandidateRow row{describe(fit.branches), fit.cross_validated_deg,
                     fit.fitted_rmse_deg,    fit.effective,
                     fit.hold_drift_deg,     refusal_of(alone(inputs, fit, joint), fit.hold_drift_deg)};
    if (!chosen && row.refusal.empty()) {
      chosen = row.chosen = true;
      out.fit = fit;
      out.hold_drift_deg = fit.hold_drift_deg;
    }
    out.rows.push_back(std::move(row));
  }
  if (!chosen) throw io::JobError(fmt::format("{}: {}", joint.joint, out.rows.front().refusal));
  return out;
}

// Errors of all pairs' held-out parts together, on one clock that jumps between them.
struct Held {
  std::vector<double> t_s;
  std::vector<double> measured;
  double max_step_s = 0;

  score::Score score(const std::vector<double>& estimated) const {
    return score::score(t_s, measured, estimated, max_step_s);
  }
};

Held held_of(const std::vector<Sampled>& samples, std::size_t joint) {
  constexpr double kBetween_s = 1e5;
  Held out;
  for (const Sampled& sampled : samples) {
    const recording::Aligned& a = sampled.sensor[joint].front();
    const double shift = out.t_s.empty() ? 0 : out.t_s.back() + kBetween_s - a.t_s[a.holdout_begin];
    for (std::size_t k = a.holdout_begin; k < a.size(); ++k) {
      out.t_s.push_back(a.t_s[k] + shift);
      out.measured.push_back(a.angle_deg[k]);
    }
    out.max_step_s = std::max({out.max_step_s, a.max_gap_s, 1.5 * a.period_s});
  }
  return out;
}

// The logs through the whole model, as apply runs it: of each joint, its held-out samples.
std::vector<std::vector<double>> estimates(const model::Model& model, const std::vector<Files>& files,
                                           const std::vector<Sampled>& samples) {
  std::vector<std::vector<double>> out(model.joints.size());
  for (std::size_t p = 0; p < files.size(); ++p) {
    const recording::Recording& log = files[p].sensor;
    std::vector<const std::vector<double>*> columns;
    for (const model::Input& input : model.inputs) columns.push_back(&log.column(input.name).value);
    Estimator<model::DoubleArithmetic> estimator(model);
    std::vector<double> row(columns.size());
    std::size_t k = 0;
    for (std::size_t i = 0; i < log.t_s.size(); ++i) {
      for (std::size_t c = 0; c < columns.size(); ++c) row[c] = (*columns[c])[i];
      estimator.push(log.t_s[i], row, [&](const Estimate& e) {
        for (std::size_t j = 0; j < out.size(); ++j) {
          const recording::Aligned& a = samples[p].sensor[j].front();
          if (k >= a.holdout_begin && k < a.size()) out[j].push_back(e.angle_deg[j]);
        }
        ++k;
      });
    }
  }
  return out;
}

void score_joints(const std::vector<Files>& files, const std::vector<Sampled>& samples,
                  HandIdentification& r) {
  const auto estimated = estimates(r.model, files, samples);
  for (std::size_t j = 0; j < r.joints.size(); ++j) {
    JointResult& joint = r.joints[j];
    const Held held = held_of(samples, j);
    joint.holdout = held.score(estimated[j]);
    std::vector<const recording::Aligned*> own;
    for (const Sampled& sampled : samples) own.push_back(&sampled.sensor[j].front());
    for (const Baseline& baseline : baselines(own)) {
      if (baseline.refusal.empty()) {
        joint.baselines.emplace(baseline.name, held.score(baseline.held_out_deg));
      } else {
        joint.baseline_refusals.push_back(fmt::format("{}: {}", baseline.name, baseline.refusal));
      }
    }
    const auto line = joint.baselines.find("line");
    if (line != joint.baselines.end() && joint.holdout.rmse_deg >= line->second.rmse_deg) {
      r.warnings.push_back(
          fmt::format("{}: on data it never saw the compensator ({:.2f} deg) is no better than a straight "
                      "line ({:.2f} deg)",
                      joint.name, joint.holdout.rmse_deg, line->second.rmse_deg));
    }
  }
}

void describe(const HandRequest& request, const std::vector<Files>& files, HandIdentification& r) {
  Json pairs = Json::array();
  const auto name = [](const recording::Recording& one) {
    return io::to_utf8(std::filesystem::path(one.source).filename().string());
  };
  for (std::size_t p = 0; p < files.size(); ++p) {
    pairs.push_back({{"sensor", name(files[p].sensor)},
                     {"sensor_digest", files[p].sensor.digest},
                     {"reference", name(files[p].reference.front())},
                     {"reference_digest", files[p].reference.front().digest},
                     {"clock_offset_s", r.clocks[p].offset_s}});
  }
  r.model.training = {{"pairs", std::move(pairs)}, {"split", request.split}, {"lead_s", request.lead_s}};
  Json joints = Json::object();
  for (const JointResult& joint : r.joints) {
    joints[joint.name] = {{"structure", describe(joint.fit.branches)},
                          {"fitted_rmse_deg", joint.fit.fitted_rmse_deg},
                          {"cross_validated_deg", joint.fit.cross_validated_deg},
                          {"hold_drift_deg", joint.hold_drift_deg},
                          {"holdout", score::to_json(joint.holdout)}};
  }
  r.model.fit = {{"joints", std::move(joints)}};
}

void check(const HandRequest& request) {
  if (request.pairs.empty())
    throw InputError("no recordings: --pair GLOVE CAMERA, or --sensor and --reference");
  if (!(request.split > 0 && request.split < 1)) throw InputError("the split must lie between 0 and 1");
  if (!(request.rate_hz > 0) || !std::isfinite(request.rate_hz))
    throw InputError("the rate must be positive");
  if (!(request.lead_s >= 0 && request.lead_s <= 1)) throw InputError("the lead must lie between 0 and 1 s");
}

}  // namespace

std::vector<JointMap> parse_map(const std::string& text) {
  std::vector<JointMap> out;
  std::size_t at = 0;
  const auto fail = [&](std::size_t where, const std::string& what) {
    throw InputError(
        fmt::format("--map: {} at \"{}\"; write JOINT=SENSOR:ANGLE,... as index=SensorA1:index_deg, several "
                    "sensors with +",
                    what, io::shortened(text.substr(where), 30)));
  };
  while (at <= text.size()) {
    const std::size_t end = std::min(text.find(',', at), text.size());
    const std::string item = text.substr(at, end - at);
    const std::size_t equals = item.find('=');
    const std::size_t colon = item.rfind(':');
    if (equals == std::string::npos || equals == 0) fail(at, "no joint");
    if (colon == std::string::npos || colon < equals || colon + 1 == item.size())
      fail(at + equals, "no angle");
    JointMap joint{model::joint_name(item.substr(0, equals)), {}, item.substr(colon + 1)};
    std::size_t from = equals + 1;
    while (from <= colon) {
      const std::size_t to = std::min(item.find('+', from), colon);
      if (to == from) fail(at + from, "no sensor");
      joint.sensors.push_back(item.substr(from, to - from));
      from = to + 1;
      if (to == colon) break;
    }
    const std::set<std::string> different(joint.sensors.begin(), joint.sensors.end());
    if (different.size() < joint.sensors.size()) fail(at, "a sensor twice");
    if (std::ranges::find(out, joint.joint, &JointMap::joint) != out.end()) fail(at, "a joint twice");
    out.push_back(std::move(joint));
    at = end + 1;
  }
  return out;
}

HandIdentification identify_hand(const HandRequest& request, const Step& step) {
  check(request);
  HandIdentification r;
  r.request = request;
  std::vector<Files> files;
  std::vector<Sampled> samples;
  for (const PairFiles& pair : request.pairs) {
    files.push_back(read_files(pair, request));
    r.warnings.insert(r.warnings.end(), files.back().sensor.warnings.begin(),
                      files.back().sensor.warnings.end());
    for (const recording::Recording& reference : files.back().reference) {
      for (const std::string& warning : reference.warnings) {
        if (std::ranges::find(r.warnings, warning) == r.warnings.end()) r.warnings.push_back(warning);
      }
    }
    r.clocks.push_back(clock_of(files.back(), request, r.warnings));
    samples.push_back(sample(files.back(), r.clocks.back(), request));
  }
  r.model.name = io::to_utf8(request.pairs.front().sensor.stem().string());
  r.model.description =
      fmt::format("{} joint(s), fitted to {} pair(s) of recordings", request.map.size(), files.size());
  r.model.written_by = "flexor " FLEXOR_VERSION;
  r.model.sample_period_s = 1 / request.rate_hz;
  add_inputs(request, files, samples, r.model);

  const auto start = std::chrono::steady_clock::now();
  const model::Model inputs = r.model;
  for (std::size_t j = 0; j < request.map.size(); ++j) {
    std::vector<Session> sessions;
    for (const Sampled& sampled : samples) sessions.push_back(session_of(sampled.sensor[j]));
    r.joints.push_back(
        choose(sessions, inputs, request.map[j], [&](auto done, auto of, const std::string& what) {
          return !step || step(j * of + done, request.map.size() * of, what);
        }));
    add_to(r.model, r.joints.back().fit, request.map[j].sensors, request.map[j].joint);
  }
  r.fit_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  score_joints(files, samples, r);
  describe(request, files, r);
  return r;
}

Json to_json(const HandIdentification& r) {
  Json joints = Json::object();
  for (const JointResult& joint : r.joints) {
    Json baselines = Json::object();
    for (const auto& [name, score] : joint.baselines) baselines[name] = score::to_json(score);
    Json rows = Json::array();
    for (const CandidateRow& row : joint.rows) {
      Json one = {{"structure", row.structure},
                  {"chosen", row.chosen},
                  {"cross_validated_rmse_deg", row.cross_validated_deg},
                  {"fitted_rmse_deg", row.fitted_rmse_deg},
                  {"effective_parameters", row.parameters},
                  {"hold_drift_deg", row.hold_drift_deg}};
      if (!row.refusal.empty()) one["refusal"] = row.refusal;
      rows.push_back(std::move(one));
    }
    joints[joint.name] = {{"holdout", score::to_json(joint.holdout)},
                          {"baselines", std::move(baselines)},
                          {"structure", describe(joint.fit.branches)},
                          {"hold_drift_deg", joint.hold_drift_deg},
                          {"fitted_rmse_deg", joint.fit.fitted_rmse_deg},
                          {"cross_validated_rmse_deg", joint.fit.cross_validated_deg},
                          {"effective_parameters", joint.fit.effective},
                          {"condition", joint.fit.condition},
                          {"structures", std::move(rows)}};
  }
  Json pairs = Json::array();
  for (std::size_t p = 0; p < r.clocks.size(); ++p) {
    pairs.push_back({{"sensor", io::to_utf8(r.request.pairs[p].sensor.string())},
                     {"reference", io::to_utf8(r.request.pairs[p].reference.string())},
                     {"clock_offset_s", r.clocks[p].offset_s},
                     {"clock_offset_se_s", r.clocks[p].standard_error_s},
                     {"confidence", r.clocks[p].confidence}});
  }
  return {{"joints", std::move(joints)},
          {"pairs", std::move(pairs)},
          {"fit_seconds", r.fit_seconds},
          {"version", FLEXOR_VERSION},
          {"warnings", r.warnings}};
}

}  // namespace flexor::identify
