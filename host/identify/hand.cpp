#include "host/identify/hand.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <future>
#include <mutex>
#include <numeric>
#include <optional>
#include <set>
#include <span>

#include "host/identify/chain_fit.hpp"
#include "host/identify/estimator.hpp"
#include "host/identify/hold.hpp"
#include "host/identify/joint_fit.hpp"
#include "host/identify/map_check.hpp"
#include "host/identify/readings.hpp"
#include "host/identify/robust.hpp"
#include "host/identify/structure_text.hpp"
#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/io/numbers.hpp"
#include "host/io/run_in_order.hpp"
#include "host/model/correction.hpp"
#include "host/model/formats.hpp"
#include "host/recording/csv.hpp"

namespace flexor::identify {
namespace {

using Json = nlohmann::ordered_json;
using io::InputError;

constexpr double kLongLead_s = 0.15;
constexpr std::size_t kLeastHeldOut = 20;
constexpr double kBeside_s = 1;
constexpr std::size_t kBlocks = 8;
constexpr double kMuchWorse = 1.5;
constexpr double kLittle = 0.2;

using Files = HandRecordings;

using Takes = std::vector<JointSamples>;  // of a joint, in each pair
using Samples = std::vector<Takes>;       // of each joint

std::vector<std::string> sensors_of(const std::vector<JointMap>& map) {
  std::vector<std::string> out;
  for (const JointMap& joint : map) {
    for (const std::string& sensor : joint.sensors) {
      if (std::ranges::find(out, sensor) == out.end()) out.push_back(sensor);
    }
  }
  return out;
}

// Of each trial in the files.
std::vector<Files> read_files(const PairFiles& files, const HandRequest& request) {
  const recording::TimeOptions time =
      request.clock_offset_s ? request.time
                             : recording::times_of_pair(files.sensor, files.reference, request.time);
  std::vector<Files> out;
  const std::vector<std::string> sensors = sensors_of(request.map);
  const auto reader = recording::open_log(files.sensor, {sensors, time, recording::Holes::some});
  for (recording::Recording& trial : recording::read_segments(*reader, time)) {
    Files& one = out.emplace_back();
    one.sensor = std::move(trial);
    for (const std::string& sensor : sensors) {
      recording::state_unit(one.sensor, sensor, request.input_unit);
      recording::require_change(one.sensor, sensor, "is the sensor plugged in?");
    }
  }
  for (const JointMap& joint : request.map) {
    std::vector<recording::Recording> trials =
        recording::angle_segments(files.reference, joint.reference, time);
    if (trials.size() != out.size())
      throw InputError(fmt::format("{} trials in {}, {} in {}: they must be as many", out.size(),
                                   files.sensor.string(), trials.size(), files.reference.string()));
    for (std::size_t i = 0; i < out.size(); ++i) {
      out[i].reference.push_back(std::move(trials[i]));
      recording::to_degrees(out[i].reference.back(), joint.reference, request.output_unit);
      recording::require_change(out[i].reference.back(), joint.reference, "does the camera see the marks?");
    }
  }
  return out;
}

Samples sample_all(const std::vector<Files>& files, const std::vector<Clock>& clocks,
                   const HandRequest& request) {
  Samples out(request.map.size(), Takes(files.size()));
  for (std::size_t p = 0; p < files.size(); ++p) {
    for (std::size_t j = 0; j < request.map.size(); ++j) {
      for (const std::string& sensor : request.map[j].sensors)
        recording::sample_pair({files[p].sensor, sensor, files[p].reference[j], request.map[j].reference},
                               request.rate_hz, clocks[p].offset_s, request.lead_s, request.split,
                               out[j][p].sensors.emplace_back());
    }
  }
  return out;
}

// The fitted part alone: the end that is held out is not even in memory here. Beside a part that is held out of the middle
// the angles of a second are not fitted either.
Session session_of(const JointSamples& take) {
  const std::vector<recording::Aligned>& sensors = take.sensors;
  const recording::Aligned& first = take.own();
  const std::size_t size = first.held_end() < first.size() ? first.size() : first.holdout_begin;
  const auto guard = static_cast<std::size_t>(kBeside_s / first.period_s);
  const auto n = static_cast<Eigen::Index>(size);
  Session out;
  out.input.resize(n, std::ssize(sensors));
  for (std::size_t s = 0; s < sensors.size(); ++s) {
    out.input.col(static_cast<Eigen::Index>(s)) =
        Eigen::Map<const Eigen::VectorXd>(sensors[s].input.data(), n);
  }
  out.angle_deg = Eigen::Map<const Eigen::VectorXd>(first.angle_deg.data(), n);
  for (std::size_t k = 0; k < size; ++k) {
    const bool held =
        size > first.holdout_begin && k + guard >= first.holdout_begin && k < first.held_end() + guard;
    const bool good = std::ranges::none_of(sensors, [&](const auto& s) {
      return s.gap[k] != 0 || !(s.input[k] >= s.valid.min && s.input[k] <= s.valid.max);
    });
    out.use.push_back(good && !held);
  }
  return out;
}

bool left_out_wholly(const recording::Aligned& a) {
  return a.holdout_begin == a.overlap_begin && a.held_end() == a.size();
}

// Of what is left out wholly there is none.
std::vector<Session> sessions_of(const Takes& takes) {
  std::vector<Session> out;
  for (const JointSamples& take : takes)
    if (!left_out_wholly(take.own())) out.push_back(session_of(take));
  return out;
}

void add_inputs(const HandRequest& request, const std::vector<Files>& files, const Samples& samples,
                model::Model& model) {
  for (const std::string& sensor : sensors_of(request.map)) {
    model::Input input{sensor, sensor, files.front().sensor.column(sensor).unit, {}, HUGE_VAL, -HUGE_VAL};
    for (std::size_t j = 0; j < samples.size(); ++j) {
      const JointMap& joint = request.map[j];
      const auto s =
          static_cast<std::size_t>(std::ranges::find(joint.sensors, sensor) - joint.sensors.begin());
      if (s == joint.sensors.size()) continue;
      const std::string finger = joint.joint.substr(0, joint.joint.find('_'));
      if (input.strip.empty() && s == 0 && std::ranges::count(model::finger_names(), finger) > 0)
        input.strip = finger;
      for (const JointSamples& take : samples[j]) {
        if (left_out_wholly(take.own())) continue;
        const recording::Aligned& a = take.sensors[s];
        input.valid_min = std::min(input.valid_min, a.valid.min);
        input.valid_max = std::max(input.valid_max, a.valid.max);
        model.max_gap_s = std::max(model.max_gap_s, a.max_gap_s);
      }
    }
    model.inputs.push_back(std::move(input));
  }
}

// Errors by the compensator and by the baselines.
struct HeldOut {
  std::vector<double> own;
  std::map<std::string, std::vector<double>> baseline;  // by their names
};

// Of what is held out; with `guessed` also where nothing was seen.
HeldOut errors_of(std::span<const JointSamples> takes, bool guessed = false) {
  HeldOut out;
  for (const JointSamples& take : takes) {
    const recording::Aligned& a = take.own();
    for (const auto& [name, estimates] : take.estimated_deg) {
      std::vector<double>& errors = name.empty() ? out.own : out.baseline[name];
      for (std::size_t k = a.holdout_begin; k < a.held_end(); ++k)
        if (guessed || a.unseen[k] == 0) errors.push_back(estimates[k] - a.angle_deg[k]);
    }
  }
  return out;
}

// All pairs' held-out parts together, on one clock that jumps between them.
score::Score score_of(const Takes& takes, const std::string& name) {
  constexpr double kBetween_s = 1e5;
  std::vector<double> t_s;
  std::vector<double> measured;
  std::vector<double> estimated;
  std::vector<std::uint8_t> unseen;
  double max_step_s = 0;
  for (const JointSamples& take : takes) {
    const recording::Aligned& a = take.own();
    if (a.holdout_begin >= a.held_end()) continue;
    const double shift = t_s.empty() ? 0 : t_s.back() + kBetween_s - a.t_s[a.holdout_begin];
    for (std::size_t k = a.holdout_begin; k < a.held_end(); ++k) {
      t_s.push_back(a.t_s[k] + shift);
      measured.push_back(a.angle_deg[k]);
      estimated.push_back(take.estimated_deg.at(name)[k]);
      unseen.push_back(a.unseen[k]);
    }
    max_step_s = std::max({max_step_s, a.max_gap_s, 1.5 * a.period_s});
  }
  return score::score_seen(t_s, measured, estimated, unseen, max_step_s);
}

// The logs through the model, as apply runs it, into the samples of its joints, by this name.
void add_estimates(const std::string& name, const model::Model& model, const std::vector<Files>& files,
                   std::span<Takes> samples) {
  for (std::size_t p = 0; p < files.size(); ++p) {
    const recording::Recording& log = files[p].sensor;
    std::vector<const std::vector<double>*> columns;
    for (const model::Input& input : model.inputs) columns.push_back(&log.column(input.name).value);
    Estimator<model::DoubleArithmetic> estimator(model);
    std::vector<double> row(columns.size());
    for (std::size_t i = 0; i < log.t_s.size(); ++i) {
      for (std::size_t c = 0; c < columns.size(); ++c) row[c] = (*columns[c])[i];
      estimator.push(log.t_s[i], row, [&](const Estimate& e) {
        for (std::size_t j = 0; j < samples.size(); ++j) {
          std::vector<double>& out = samples[j][p].estimated_deg[name];
          if (out.size() < samples[j][p].own().size()) out.push_back(e.angle_deg[j]);
        }
      });
    }
  }
}

// All but blocks and joints.
model::Model start_model(const HandRequest& request, const std::vector<Files>& files,
                         const Samples& samples) {
  model::Model out;
  out.name = request.pairs.empty() ? "identified" : io::to_utf8(request.pairs.front().sensor.stem().string());
  out.description =
      fmt::format("{} joint(s), fitted to {} pair(s) of recordings", request.map.size(), files.size());
  out.written_by = "flexor " FLEXOR_VERSION;
  out.sample_period_s = 1 / request.rate_hz;
  add_inputs(request, files, samples, out);
  return out;
}

// A joint's baselines, as --structure gives them; one that cannot be fitted is refused.
void add_baselines(const model::Model& inputs, const JointMap& map, const std::vector<Files>& files,
                   Takes& takes, std::map<std::string, model::Model> fitted,
                   std::vector<std::string>& refusals) {
  const std::size_t sensors = map.sensors.size();
  for (const score::Baseline& one : score::kBaselines) {
    const WantedStructure wanted = parse_structure(one.structure, sensors);
    const Chain* chain = std::get_if<Chain>(&wanted);
    if (chain != nullptr && sensors > 1)
      continue;  // it has one sensor: where there are several it is no peer
    try {
      if (!fitted.contains(one.structure))
        fitted[one.structure] =
            (chain != nullptr ? fit_chain(*chain, sessions_of(takes), inputs, map, {}, HUGE_VAL, {})
                              : fit_joint(sessions_of(takes), inputs, map, one.structure, {}, {}))
                .model;
      add_estimates(one.name, fitted.at(one.structure), files, {&takes, 1});
    } catch (const io::JobError& error) {
      refusals.push_back(fmt::format("{}: {}", one.name, error.what()));
    }
  }
}

// Of the measured angle outside pauses.
double span_deg(const JointSamples& s, std::size_t begin, std::size_t end) {
  std::vector<double> seen;
  for (std::size_t k = begin; k < end; ++k)
    if (!s.gap(k)) seen.push_back(s.own().angle_deg[k]);
  return seen.empty() ? 0 : std::ranges::max(seen) - std::ranges::min(seen);
}

// What the held-out part says against the compensator.
void warn_of_holdout(const HandRequest& request, const Takes& takes, const JointResult& joint,
                     std::vector<std::string>& warnings) {
  if (const auto text = score::in_words_left_out(joint.holdout.left_out,
                                                 joint.holdout.samples + joint.holdout.left_out, "scored"))
    warnings.push_back(fmt::format("{}: {}", joint.name, *text));
  if (joint.holdout.rmse_deg > kMuchWorse * joint.fitted_rmse_deg) {
    warnings.push_back(
        fmt::format("{}: the error on unseen data is {:.1f} times the error on the fitted part: the glove "
                    "changed during the recording, or the motion did",
                    joint.name, joint.holdout.rmse_deg / joint.fitted_rmse_deg));
  }
  if (joint.hold_drift_deg > kMostDrift_deg && joint.verdict.advises) {
    warnings.push_back(
        fmt::format("{}: held still, its angle goes on by {:.1f} deg, as the sensor crept in the recording: "
                    "hold the hand for a "
                    "minute, and where that is wrong take --structure hysteresis, or record longer holds",
                    joint.name, joint.hold_drift_deg));
  }
  for (const std::string& refusal : joint.baseline_refusals)
    warnings.push_back(fmt::format("{}: baseline {}", joint.name, refusal));
  double moved_deg = 0;
  double taught_deg = 0;
  std::size_t unseen = 0;
  std::size_t fitted = 0;
  std::vector<recording::Halves> readings;
  for (const JointSamples& s : takes) {
    const recording::Aligned& own = s.own();
    moved_deg = std::max(moved_deg, span_deg(s, own.holdout_begin, own.size()));
    const auto taught = std::span(own.unseen).subspan(s.begin(), own.holdout_begin - s.begin());
    unseen += static_cast<std::size_t>(std::ranges::count(taught, 1));
    fitted += taught.size();
    taught_deg = std::max(taught_deg, span_deg(s, s.begin(), own.holdout_begin));
    const std::span all(own.input);
    readings.push_back(
        {all.subspan(s.begin(), own.holdout_begin - s.begin()), all.subspan(own.holdout_begin)});
  }
  if (const auto text = score::in_words_left_out(unseen, fitted, "fitted"))
    warnings.push_back(fmt::format("{}: {}", joint.name, *text));
  if (moved_deg < kLittle * taught_deg) {
    warnings.push_back(fmt::format(
        "{}: the finger moves by {:.1f} deg in the held-out part and by {:.0f} in the fitted one: nothing "
        "is proven; move through the whole range all the time, or choose another --split",
        joint.name, moved_deg, taught_deg));
  }
  if (const auto text = recording::beyond_fitted(readings))
    warnings.push_back(fmt::format("{}: {}", joint.name, *text));
}

ScoreRow row_of(const std::string& name, const HeldOut& errors) {
  ScoreRow out{name, errors.own.size(), score::rms(errors.own), {}};
  for (const auto& [baseline, error_deg] : errors.baseline)
    out.baseline_deg[baseline] = score::rms(error_deg);
  return out;
}

// Of all samples, or of those held out; where what follows the compensator takes `later_s` more than the lead that it was fitted with.
double rmse_deg(const Takes& takes, bool held_out, double later_s) {
  std::vector<double> errors;
  for (const JointSamples& s : takes) {
    const recording::Aligned& own = s.own();
    std::vector<double> t_s;
    for (std::size_t k = s.begin(); k < own.size(); ++k) t_s.push_back(s.since_begin_s(k));
    const std::span measured_deg = std::span(own.angle_deg).subspan(s.begin());
    for (std::size_t k = held_out ? own.holdout_begin : s.begin(); k < own.size(); ++k) {
      const double at_s = s.since_begin_s(k) + later_s;
      if (s.gap(k) || at_s < t_s.front() || at_s > t_s.back()) continue;
      const double error_deg = s.estimated_deg.at("")[k] - io::interpolate(t_s, measured_deg, at_s);
      if (std::isfinite(error_deg)) errors.push_back(error_deg);
    }
  }
  return score::rms(errors);
}

bool alike(const std::vector<double>& a, const std::vector<double>& b) {
  constexpr double kSame_deg = 1e-6;
  return std::ranges::equal(a, b, [](double x, double y) { return std::abs(x - y) < kSame_deg; });
}

// Itself is no baseline, whatever it is called, and is named.
score::Verdict judged(const HandRequest& request, HeldOut errors,
                      const std::vector<std::size_t>& part_ends = {}) {
  std::string itself;
  for (const score::Baseline& one : score::kBaselines) {
    const auto at = errors.baseline.find(one.name);
    if (at == errors.baseline.end()) continue;
    if (one.structure != request.structure && !alike(at->second, errors.own)) continue;
    if (itself.empty()) itself = one.name;
    errors.baseline.erase(at);
  }
  score::Verdict out = score::judge(errors.own, errors.baseline, 1 / request.rate_hz, part_ends);
  out.itself = itself;
  return out;
}

void score_joints(const HandRequest& request, const std::vector<Files>& files, Samples samples,
                  const std::set<std::string>& stuck, HandIdentification& r) {
  add_estimates("", r.model, files, samples);
  const model::Model inputs = start_model(request, files, samples);
  const std::vector<std::string> pairs = names_of_pairs(request);
  const auto score = [&](std::size_t j) {
    JointResult joint = r.joints[j];
    add_baselines(inputs, request.map[j], files, samples[j], joint.baseline_models, joint.baseline_refusals);
    joint.holdout = score_of(samples[j], "");
    joint.sooner_deg = rmse_deg(samples[j], true, -kLeadOff_s);
    joint.later_deg = rmse_deg(samples[j], true, kLeadOff_s);
    for (std::size_t p = 0; p < pairs.size(); ++p) {
      const HeldOut errors = errors_of({&samples[j][p], 1});
      if (!errors.own.empty()) joint.pairs.push_back(row_of(pairs[p], errors));
    }
    HeldOut errors = errors_of(samples[j]);
    if (errors.own.empty()) errors = errors_of(samples[j], true);  // as in the score
    for (const auto& [name, error_deg] : errors.baseline)
      joint.baselines.emplace(name, score_of(samples[j], name));
    joint.verdict = judged(request, std::move(errors));
    joint.verdict.advises = !stuck.contains(joint.name);
    return joint;
  };
  const auto take = [&](std::size_t j, JointResult& joint) {
    warn_of_holdout(request, samples[j], joint, r.warnings);
    r.joints[j] = std::move(joint);
  };
  io::run_in_order<JointResult>(0, r.joints.size(), io::threads_of(request.threads), score, take);
  for (std::size_t j = 0; j < samples.size(); ++j) r.joints[j].samples = std::move(samples[j]);
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
  r.model.training = {{"pairs", std::move(pairs)},
                      {"split", request.split},
                      {"fit_all", request.fit_all},
                      {"lead_s", request.lead_s}};
  if (request.map.size() == 1) r.model.training["output_column"] = request.map.front().reference;
  Json joints = Json::object();
  for (const JointResult& joint : r.joints) {
    joints[joint.name] = {{"structure", joint.structure},
                          {"verdict", score::to_json(joint.verdict)},
                          {"fitted_rmse_deg", joint.fitted_rmse_deg},
                          {"cross_validated_deg", joint.cross_validated_deg},
                          {"hold_drift_deg", joint.hold_drift_deg},
                          {"holdout", score::to_json(joint.holdout)}};
    if (joint.untried > 0) joints[joint.name]["untried_structures"] = joint.untried;
  }
  r.model.fit = {{"joints", std::move(joints)}};
}

void add_warnings(const Files& files, std::vector<std::string>& warnings) {
  warnings.insert(warnings.end(), files.sensor.warnings.begin(), files.sensor.warnings.end());
  for (const recording::Recording& reference : files.reference) {
    for (const std::string& warning : reference.warnings) {
      if (std::ranges::find(warnings, warning) == warnings.end()) warnings.push_back(warning);
    }
  }
}

// Readings that are left out, and those that no board takes.
void warn_of_readings(const model::Model& model, const std::vector<Files>& files,
                      std::vector<std::string>& warnings) {
  const model::Model board = model::folded(model).model;
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    const model::Input& input = model.inputs[i];
    std::vector<std::span<const double>> readings;
    for (const Files& one : files) readings.emplace_back(one.sensor.column(input.name).value);
    if (const auto text = refused_readings(input, readings)) warnings.push_back(*text);
    if (input.unit.empty()) {
      warnings.push_back(fmt::format(
          "column \"{}\" states no unit: the model runs on logs like this one; for the boards say it with "
          "--input-unit: count, V, ...",
          input.name));
    }
    if (!model::holds_readings(board.inputs[i])) {
      warnings.push_back(fmt::format(
          "{}: the boards take readings from -1024 to 1023, not {:g} to {:g}: this model runs on a "
          "PC, and deploy refuses it",
          input.name, input.valid_min, input.valid_max));
    }
  }
}

// Each text once, with the joints that it is true of.
void warn_of_lacking_motion(const HandRequest& request, const Samples& samples,
                            std::vector<std::string>& warnings) {
  std::vector<std::pair<std::string, std::vector<std::string>>> all;
  for (std::size_t j = 0; j < request.map.size(); ++j) {
    for (const std::string& text : lacking(sessions_of(samples[j]), 1 / request.rate_hz)) {
      auto known = std::ranges::find(all, text, &std::pair<std::string, std::vector<std::string>>::first);
      if (known == all.end()) known = all.insert(all.end(), {text, {}});
      known->second.push_back(request.map[j].joint);
    }
  }
  for (const auto& [text, joints] : all)
    warnings.push_back(fmt::format("{}: {}", fmt::join(joints, ", "), text));
}

// A joint that the wearer's own is fitted from.
model::Channel chain_of(const model::Model& model, const std::string& joint) {
  const auto at = std::ranges::find(model.joints, joint, &model::Joint::name);
  if (at == model.joints.end())
    throw InputError(fmt::format("the model to start from has no joint {}", joint));
  const auto chain = model::channel(model, static_cast<std::size_t>(at - model.joints.begin()));
  if (!chain)
    throw InputError(fmt::format("{}: the model to start from has no chain of blocks for it", joint));
  return *chain;
}

// Where the fit of a joint begins: its chain in the initial model, if there is one. Below its dead zone a model that is refitted has
// no reading of its wearer.
std::optional<Initial> initial_of(const HandRequest& request, const JointMap& map,
                                  const std::vector<Session>& sessions) {
  if (!request.initial) return {};
  Initial out{chain_of(*request.initial, map.joint), request.refit};
  const std::vector<double> readings = used_readings(sessions, 0);
  if (out.gain_alone && out.chain.dead_zone && !readings.empty())
    out.chain.dead_zone->lower = std::min(out.chain.dead_zone->lower, std::ranges::min(readings));
  return out;
}

void warn_of_other_units(const HandRequest& request, HandIdentification& r) {
  for (const JointMap& map : request.map) {
    const model::Channel chain = chain_of(*request.initial, map.joint);
    model::Input wanted;
    wanted.name = chain.input_column;
    wanted.unit = chain.input_unit;
    const auto input = std::ranges::find(r.model.inputs, map.sensors.front(), &model::Input::name);
    if (const auto note = unit_note(wanted, "--refit", input->column, input->unit))
      r.warnings.push_back(*note);
  }
}

// Joints that do not fit a board together: the largest is fitted again with less, and where no smaller one is there the next.
void fit_into_room(const HandRequest& request, const std::vector<std::string>& structures,
                   const std::function<std::future<JointResult>(std::size_t, double)>& fit,
                   const model::Model& inputs, HandIdentification& r) {
  std::vector<std::size_t> left;
  for (std::size_t j = 0; j < structures.size(); ++j)
    if (structures[j] == "auto") left.push_back(j);
  const auto share = [&](std::size_t j) { return request.room(r.joints[j].model); };
  while (request.room && request.room(r.model) > 1 && !left.empty()) {
    const std::size_t largest = *std::ranges::max_element(left, {}, share);
    try {
      JointResult smaller = fit(largest, share(largest)).get();
      if (!(request.room(smaller.model) < share(largest))) throw io::JobError("no smaller one is there");
      r.joints[largest] = std::move(smaller);
    } catch (const io::JobError&) {
      std::erase(left, largest);
      continue;
    }
    r.model = inputs;
    for (const JointResult& joint : r.joints) append(joint.model, r.model);
  }
  if (request.room && request.room(r.model) > 1)
    r.warnings.emplace_back("the joints together take more than a board's room: deploy refuses this model");
}

// `structures`, one for each joint.
void fit_joints(const HandRequest& request, const std::vector<std::string>& structures,
                const Samples& samples, const Step& step, HandIdentification& r) {
  const model::Model inputs = r.model;
  const std::size_t joints = request.map.size();
  // How far the fits of all joints are together, whatever thread each is on. A joint that has not begun is taken for one like
  // those that have.
  std::mutex mutex;
  std::vector<std::size_t> done_of(joints);
  std::vector<std::size_t> all_of(joints);
  const auto progress = [&](std::size_t joint) {
    return [&, joint](std::size_t done, std::size_t of, const std::string& what) {
      const std::lock_guard lock(mutex);
      done_of[joint] = done;
      all_of[joint] = of;
      const auto sum = [](const auto& all) { return std::reduce(all.begin(), all.end()); };
      const auto waiting = static_cast<std::size_t>(std::ranges::count(all_of, 0U));
      return !step || step(sum(done_of), sum(all_of) + waiting * of, what);
    };
  };
  // The first joint's failure is told, whichever failed first.
  const auto fit = [&](std::size_t j, double most) {
    std::packaged_task<JointResult()> task([&] {
      JointResult out;
      out.name = request.map[j].joint;
      const std::vector<Session> sessions = sessions_of(samples[j]);
      static_cast<JointFit&>(out) = fit_joint(sessions, inputs, request.map[j], structures[j],
                                              initial_of(request, request.map[j], sessions), progress(j),
                                              request.room, most);
      if (request.refit) out.structure = "gain and dead zone refitted";
      return out;
    });
    task();
    return task.get_future();
  };
  io::run_in_order<std::future<JointResult>>(
      0, joints, io::threads_of(request.threads), [&](std::size_t j) { return fit(j, HUGE_VAL); },
      [&](std::size_t, std::future<JointResult>& fitted) {
        r.joints.push_back(fitted.get());
        append(r.joints.back().model, r.model);
      });
  fit_into_room(request, structures, fit, inputs, r);
}

// How each sensor's readings spread, over the samples of the first joint that it tells of, and its poses by the joint whose own it
// is; one that is no joint's own has none.
void add_readings(const HandRequest& request, const Samples& samples, model::Model& model) {
  for (model::Input& input : model.inputs) {
    bool is_told = false;
    bool is_own = false;
    for (std::size_t j = 0; j < request.map.size() && !is_own; ++j) {
      const std::vector<std::string>& sensors = request.map[j].sensors;
      const auto at = std::ranges::find(sensors, input.name) - sensors.begin();
      if (at == std::ssize(sensors) || (is_told && at > 0)) continue;
      const std::vector<Session> sessions = sessions_of(samples[j]);
      if (!is_told) add_spread(sessions, at, input);
      is_told = true;
      is_own = at == 0;
      if (is_own) add_poses(sessions, 0, model.sample_period_s, input);
    }
  }
}

// Where each joint is at the open hand and at the fist: as the request says, else at the quantiles of its angles, of which the
// one nearer to zero is taken for the open hand. Where no joint comes near zero they are inner angles, as of MediaPipe: of one
// that reaches half a turn, which is straight, the other.
void add_ends(const HandRequest& request, const Samples& samples, HandIdentification& r) {
  constexpr double kShare = 0.02;
  constexpr double kNearZero_deg = 45;      // no open hand is bent more
  constexpr double kNearStraight_deg = 30;  // of half a turn
  std::vector<model::Ends> all;
  for (std::size_t j = 0; j < request.map.size(); ++j) {
    std::vector<double> angles = used_angles(sessions_of(samples[j]));
    std::ranges::sort(angles);
    model::Ends& ends = all.emplace_back(model::Ends{quantile(angles, kShare), quantile(angles, 1 - kShare)});
    if (std::abs(ends.fist_deg) < std::abs(ends.open_deg)) std::swap(ends.open_deg, ends.fist_deg);
  }
  const bool are_inner =
      std::ranges::all_of(all, [&](const auto& ends) { return std::abs(ends.open_deg) > kNearZero_deg; });
  for (std::size_t j = 0; j < request.map.size(); ++j) {
    model::Joint& joint = *std::ranges::find(r.model.joints, request.map[j].joint, &model::Joint::name);
    model::Ends ends = all[j];
    if (are_inner && std::abs(std::abs(ends.fist_deg) - 180) < kNearStraight_deg)
      std::swap(ends.open_deg, ends.fist_deg);
    if (const auto stated = request.ends.find(joint.name); stated != request.ends.end())
      joint.ends = stated->second;
    else if (std::abs(ends.fist_deg - ends.open_deg) >= model::kLeastEnds_deg)
      joint.ends = ends;
    if (joint.ends != ends || !are_inner) continue;
    r.warnings.push_back(fmt::format(
        "{0}: its angles never come near zero: {1:.0f} deg is taken for the open hand, {2:.0f} for the fist; "
        "if they are the other way round, add --pose-angles {0}={2:.0f}:{1:.0f}",
        joint.name, ends.open_deg, ends.fist_deg));
  }
}

void fit_model(const HandRequest& request, const std::vector<std::string>& structures,
               const std::vector<Files>& files, const Samples& samples, const Step& step,
               HandIdentification& r) {
  r.model = start_model(request, files, samples);
  if (request.refit) warn_of_other_units(request, r);
  fit_joints(request, structures, samples, step, r);
  add_readings(request, samples, r.model);
  add_ends(request, samples, r);
  std::erase_if(r.model.inputs, [&](const model::Input& input) {
    return std::ranges::none_of(r.model.blocks, [&](const auto& block) {
      return std::ranges::find(block.from, input.name) != block.from.end();
    });
  });
}

// Of each joint; where initial values are given and nothing is asked for, theirs.
std::vector<std::string> asked_for(const HandRequest& request) {
  std::vector<std::string> out(request.map.size(), request.structure);
  if (!request.initial || request.structure != "auto") return out;
  const Json fits = request.initial->fit.value("joints", Json::object());
  for (std::size_t j = 0; j < out.size(); ++j) {
    const std::string& joint = request.map[j].joint;
    Structure structure = structure_of(chain_of(*request.initial, joint));
    // A document has limits whether they were fitted or not; its own words tell.
    if (const Json fit = fits.value(joint, Json::object()); !request.refit && fit.contains("structure"))
      structure.saturation = fit["structure"].dump().find("saturation") != std::string::npos;
    out[j] = text_of(structure);
  }
  return out;
}

// What was proven on a part, the same structures once more from all; the figures stay those of the part. A joint of it that errs
// more on all than what was proven stays as that is; false: it was not fitted.
bool fit_again(const HandRequest& request, const std::vector<Files>& files, HandIdentification& r) {
  constexpr double kWorse = 1.03;
  HandRequest all = request;
  all.split = 1;
  HandIdentification again;
  std::vector<std::string> proven;
  for (std::size_t j = 0; j < r.joints.size(); ++j) {
    proven.push_back(r.joints[j].text);
    all.map[j].sensors = r.joints[j].sensors;
  }
  Samples samples = sample_all(files, r.clocks, all);
  try {
    fit_model(all, proven, files, samples, {}, again);
  } catch (const io::JobError& error) {
    r.warnings.push_back(
        fmt::format("fitted to all: {}: the model is the one of the first part", error.what()));
    return false;
  }
  add_estimates("", again.model, files, samples);
  again.model.blocks.clear();  // joint by joint below
  again.model.joints.clear();
  for (std::size_t j = 0; j < r.joints.size(); ++j) {
    const double part_deg = rmse_deg(r.joints[j].samples, false, 0);
    const double all_deg = rmse_deg(samples[j], false, 0);
    const auto chosen = std::ranges::find(again.joints[j].rows, true, &CandidateRow::chosen);
    const bool fits_board = chosen == again.joints[j].rows.end() || chosen->refusal.empty();
    if (fits_board && all_deg <= kWorse * part_deg) {
      append(again.joints[j].model, again.model);
      r.joints[j].hold_drift_deg = again.joints[j].hold_drift_deg;  // of what is worn
      continue;
    }
    append(r.joints[j].model, again.model);
    r.warnings.push_back(fmt::format(
        "{}: fitted to all it errs by {:.1f} deg, fitted to the first part by {:.1f}{}: the model is "
        "the one of the first part",
        r.joints[j].name, all_deg, part_deg, fits_board ? "" : ", and " + chosen->refusal));
  }
  r.model = std::move(again.model);
  return true;
}

// What is left out together: these pairs, from one share of their time to another.
struct Unit {
  std::string name;
  std::vector<std::size_t> pairs;
  double from = 0;
  double to = 1;
};

std::vector<Unit> units_of(const HandRequest& request) {
  std::vector<Unit> out;
  std::vector<std::size_t> all(request.pairs.size());
  std::iota(all.begin(), all.end(), 0);
  for (std::size_t b = 0; request.leave_out == LeaveOut::block && b < kBlocks; ++b) {
    constexpr double kShare = 1.0 / kBlocks;
    const auto at = static_cast<double>(b);
    out.push_back({fmt::format("block {} of {}", b + 1, kBlocks), all, at * kShare, (at + 1) * kShare});
  }
  if (request.leave_out == LeaveOut::take) {
    for (const std::size_t p : all) out.push_back({names_of_pairs(request)[p], {p}});
  }
  std::map<std::filesystem::path, std::vector<std::size_t>> folders;
  for (const std::size_t p : all)
    folders[std::filesystem::weakly_canonical(request.pairs[p].sensor).parent_path()].push_back(p);
  if (request.leave_out == LeaveOut::person) {
    std::vector<std::filesystem::path> persons;
    for (const auto& [folder, pairs] : folders) persons.push_back(folder);
    const std::vector<std::string> names = short_names(persons);
    for (const auto& [folder, pairs] : folders) out.push_back({names[out.size()], pairs});
  }
  if (out.size() > 1) return out;
  throw InputError(
      request.leave_out == LeaveOut::person
          ? "--leave-out person: all logs lie in one folder: put each person's into a folder of its own"
          : "--leave-out take: there is one pair alone: give more, or --leave-out block");
}

void check(const HandRequest& request) {
  if (request.pairs.empty())
    throw InputError("no recordings: --pair GLOVE CAMERA, or --sensor and --reference");
  if (!(request.split > 0 && request.split < 1)) throw InputError("the split must lie between 0 and 1");
  recording::check_clock(request.rate_hz, request.clock_offset_s, request.lead_s);
  (void)io::threads_of(request.threads);
  for (const JointMap& joint : request.map) (void)parse_structure(request.structure, joint.sensors.size());
}

void check_joints(const HandRequest& request) {
  const auto require_joint = [&](const std::string& name, const char* what) {
    if (std::ranges::find(request.map, name, &JointMap::joint) == request.map.end())
      throw InputError(fmt::format("the {} of \"{}\", which is no joint of the map", what, name));
  };
  for (const auto& [name, error_deg] : request.reference_error_deg) {
    require_joint(name, "error of the angles");
    if (!(error_deg > 0 && error_deg < 90))
      throw InputError(fmt::format("{}: the error of the angles must lie between 0 and 90 degrees", name));
  }
  for (const auto& [name, ends] : request.ends) {
    require_joint(name, "ends");
    if (!(std::abs(ends.fist_deg - ends.open_deg) >= model::kLeastEnds_deg))
      throw InputError(fmt::format("{}: open hand and fist must be a degree apart or more", name));
  }
}

// What the fit is off by and what its angles are off by, as if they had nothing in common: a bound, since noise of the angles is
// in both.
void state_reference_error(const HandRequest& request, HandIdentification& r) {
  for (model::Joint& joint : r.model.joints) {
    const auto found = request.reference_error_deg.find(joint.name);
    if (found == request.reference_error_deg.end()) continue;
    if (joint.accuracy) {
      for (double& error_deg : joint.accuracy->standard_error_deg)
        error_deg = std::hypot(error_deg, found->second);
    }
    r.warnings.push_back(
        fmt::format("{}: the measured angles themselves err by about {:g} deg: every figure is against them, "
                    "not against the hand",
                    joint.name, found->second));
  }
}

Samples without(Samples samples, const Unit& unit) {
  for (Takes& takes : samples) {
    for (std::size_t p = 0; p < takes.size(); ++p) {
      const bool out = std::ranges::find(unit.pairs, p) != unit.pairs.end();
      for (recording::Aligned& a : takes[p].sensors) {
        const auto at = [&](double share) {
          return a.overlap_begin +
                 static_cast<std::size_t>(share * static_cast<double>(a.size() - a.overlap_begin));
        };
        a.holdout_begin = out ? at(unit.from) : a.size();
        if (out && unit.to < 1) a.holdout_end = at(unit.to);
      }
    }
  }
  return samples;
}

// A model that is fitted to the rest, with every choice made anew: of each joint what it errs by on the unit. Throws io::Cancelled where
// it was stopped before it had tried all.
std::vector<HeldOut> errors_without(const Unit& unit, const HandRequest& request,
                                    const std::vector<Files>& files, const Samples& whole, const Step& step) {
  Samples samples = without(whole, unit);
  HandIdentification one;
  fit_model(request, asked_for(request), files, samples, step, one);
  add_estimates("", one.model, files, samples);
  const model::Model inputs = start_model(request, files, samples);
  std::vector<HeldOut> out;
  for (std::size_t j = 0; j < one.joints.size(); ++j) {
    if (one.joints[j].untried > 0) throw io::Cancelled("stopped");
    add_baselines(inputs, request.map[j], files, samples[j], one.joints[j].baseline_models,
                  one.joints[j].baseline_refusals);
    out.push_back(errors_of(samples[j]));
  }
  return out;
}

// One unit after the other is left out. Where one could not be, the rows of the others stand without a verdict.
void leave_out(const HandRequest& request, const std::vector<Files>& files, const Step& step,
               HandIdentification& r) {
  const std::vector<Unit> units = units_of(request);
  HandRequest all = request;
  all.split = 1;
  const Samples whole = sample_all(files, r.clocks, all);
  std::vector<HeldOut> errors(r.joints.size());
  std::vector<std::vector<std::size_t>> ends(r.joints.size());
  bool complete = true;
  for (std::size_t u = 0; u < units.size() && !r.leave_out_stopped; ++u) {
    const auto part = [&](std::size_t done, std::size_t of, const std::string& what) {
      return !step ||
             step(u * of + done, units.size() * of, fmt::format("without {}: {}", units[u].name, what));
    };
    try {
      const std::vector<HeldOut> found = errors_without(units[u], request, files, whole, part);
      for (std::size_t j = 0; j < errors.size(); ++j) {
        const HeldOut& more = found[j];
        const auto add = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
        add(errors[j].own, more.own);
        for (const auto& [name, error_deg] : more.baseline) add(errors[j].baseline[name], error_deg);
        if (more.own.empty()) continue;  // nothing was measured there
        r.joints[j].left_out.push_back(row_of(units[u].name, more));
        ends[j].push_back(errors[j].own.size());
      }
    } catch (const io::Cancelled&) {
      r.leave_out_stopped = true;
    } catch (const io::JobError& error) {
      complete = false;
      r.warnings.push_back(fmt::format("without {}: {}", units[u].name, error.what()));
    }
  }
  if (r.leave_out_stopped)
    r.warnings.emplace_back("stopped before each part was left out: their verdict is missing");
  for (std::size_t j = 0; complete && !r.leave_out_stopped && j < errors.size(); ++j) {
    HeldOut& all = errors[j];
    if (all.own.size() < 2) continue;
    std::erase_if(all.baseline, [&](const auto& one) { return one.second.size() != all.own.size(); });
    if (request.leave_out == LeaveOut::block) ends[j].clear();
    r.joints[j].left_out_verdict = judged(request, std::move(all), ends[j]);
  }
}

// A few samples prove nothing.
void check_held_out(const recording::Aligned& a) {
  if (left_out_wholly(a)) throw InputError("the split leaves nothing to fit: a larger --split");
  if (a.size() - a.holdout_begin >= kLeastHeldOut) return;
  throw InputError(
      fmt::format("{} samples would be held out, at least {} are needed: a smaller --split, or record longer",
                  a.size() - a.holdout_begin, kLeastHeldOut));
}

// All takes, each trial of a file one; `request.pairs` then name them.
std::vector<Files> read_takes(HandRequest& request, std::vector<std::string>& warnings) {
  std::vector<Files> out;
  std::vector<PairFiles> takes;
  for (const PairFiles& pair : request.pairs) {
    for (Files& one : read_files(pair, request)) {
      out.push_back(std::move(one));
      if (request.time.segments.empty()) refuse_seen_before(out);
      add_warnings(out.back(), warnings);
      takes.push_back(pair);
    }
  }
  request.pairs = std::move(takes);
  if (request.leave_out != LeaveOut::none) (void)units_of(request);
  return out;
}

}  // namespace

bool JointSamples::gap(std::size_t k) const {
  return std::ranges::any_of(sensors, [k](const recording::Aligned& sensor) { return sensor.gap[k] != 0; });
}

ScoreRow JointResult::all() const {
  ScoreRow out{name, holdout.samples, holdout.rmse_deg, {}};
  for (const auto& [baseline, score] : baselines) out.baseline_deg[baseline] = score.rmse_deg;
  return out;
}

Clock clock_of(const std::vector<JointMap>& map, std::optional<double> given, HandRecordings& files,
               std::vector<std::string>& warnings) {
  std::vector<recording::Witness> witnesses;
  const std::vector<std::string> sensors = sensors_of(map);
  std::vector<recording::Recording> readings;
  for (const std::string& sensor : sensors)
    readings.push_back(recording::without_holes(files.sensor, sensor));
  for (std::size_t j = 0; j < map.size(); ++j) {
    const std::string& first = map[j].sensors.front();
    const auto sensor = static_cast<std::size_t>(std::ranges::find(sensors, first) - sensors.begin());
    witnesses.push_back(
        {sensor, readings[sensor].series(first), &files.reference[j], map[j].reference, map[j].joint});
  }
  const bool known = share_a_clock(files.sensor, files.reference.front());
  if (!given && known) given = 0;
  std::vector<std::string> said;
  Clock clock = recording::find_clock(witnesses, given, known, said);
  bool is_left_out = false;
  for (const recording::Witness& w : witnesses)
    is_left_out |= recording::leave_out_frozen(*w.reference, w.column, w.reading, clock.offset_s, warnings);
  if (is_left_out) {  // which said of the clocks what it could
    said.clear();
    const double taken_out_ppm = clock.drift_ppm;
    clock = recording::find_clock(witnesses, given, known, said);
    clock.drift_ppm += taken_out_ppm;
  }
  if (known) clock.confidence = 1;
  for (const std::string& warning : said)
    warnings.push_back(fmt::format("{}: {}", files.sensor.source, warning));
  return clock;
}

std::vector<std::string> names_of_pairs(const HandRequest& request) {
  std::vector<std::filesystem::path> logs;
  for (const PairFiles& pair : request.pairs) logs.push_back(pair.sensor);
  return short_names(logs);
}

HandIdentification identify_hand(const HandRequest& asked, const Step& step) {
  check(asked);
  check_joints(asked);
  HandIdentification r;
  r.request = asked;
  const HandRequest& request = r.request;
  if (request.lead_s > kLongLead_s) {
    r.warnings.push_back(fmt::format(
        "a lead of {:g} s is long: it is right where flexor latency and the hand's 0.02 s add up to it; "
        "curves and chains lose two fifths in the twin by one that is twice as long",
        request.lead_s));
  }
  std::vector<Files> files = read_takes(r.request, r.warnings);
  std::set<std::string> stuck;  // joints
  for (std::size_t p = 0; p < files.size(); ++p) {
    r.clocks.push_back(clock_of(request.map, request.clock_offset_s, files[p], r.warnings));
    const std::size_t said = r.warnings.size();
    stuck.merge(check_map(request, request.pairs[p], files[p], r.clocks.back().offset_s, r.warnings));
    if (!request.clock_offset_s)
      refuse_unsure(files[p].sensor.source, r.clocks.back().offset_s, r.clocks.back().confidence,
                    r.warnings.size() > said ? r.warnings[said] : "");
  }
  const Samples samples = sample_all(files, r.clocks, request);
  for (std::size_t j = 0; j < request.map.size(); ++j) {
    for (const JointSamples& take : samples[j]) check_held_out(take.own());
    const std::vector<Session> sessions = sessions_of(samples[j]);
    check_gloves(request, j, sessions);
    const auto other = std::ranges::find(request.map, request.map[j].reference, &JointMap::reference);
    if (other->joint != request.map[j].joint)
      r.warnings.push_back(fmt::format("{} and {}: \"{}\" is the angle of both: is the map right?",
                                       other->joint, request.map[j].joint, other->reference));
    for (const std::string& text : one_sided(request.map[j], sessions))
      r.warnings.push_back(fmt::format("{}: {}", request.map[j].joint, text));
  }
  warn_of_lacking_motion(request, samples, r.warnings);
  const auto start = std::chrono::steady_clock::now();
  fit_model(request, asked_for(request), files, samples, step, r);
  r.fit_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  for (const JointResult& joint : r.joints) {
    if (joint.untried > 0) r.warnings.push_back(fmt::format("{}: {}", joint.name, kStopped));
  }
  score_joints(request, files, samples, stuck, r);
  if (request.leave_out != LeaveOut::none) leave_out(request, files, step, r);
  r.proven = r.model;
  HandRequest done = request;
  done.fit_all = request.fit_all && fit_again(request, files, r);
  state_reference_error(request, r);
  warn_of_readings(r.model, files, r.warnings);
  describe(done, files, r);
  return r;
}

std::vector<LeftOut> leave_person_out(const HandRequest& asked, const std::vector<std::size_t>& own,
                                      const Step& step) {
  check(asked);
  HandRequest request = asked;
  request.split = 1;
  request.pairs.clear();
  std::vector<Files> files;
  HandIdentification r;
  Unit unit;
  for (std::size_t p = 0; p < asked.pairs.size(); ++p) {
    HandRequest one = request;
    one.pairs = {asked.pairs[p]};
    try {
      std::vector<Files> read = read_takes(one, r.warnings);
      std::vector<Clock> clocks;
      for (Files& take : read) {
        clocks.push_back(clock_of(request.map, request.clock_offset_s, take, r.warnings));
        if (!request.clock_offset_s)
          refuse_unsure(take.sensor.source, clocks.back().offset_s, clocks.back().confidence);
      }
      for (std::size_t i = 0; i < read.size(); ++i) {
        if (std::ranges::find(own, p) != own.end()) unit.pairs.push_back(files.size());
        request.pairs.push_back(asked.pairs[p]);
        r.clocks.push_back(clocks[i]);
        files.push_back(std::move(read[i]));
      }
    } catch (const InputError&) {  // its own row says why
    } catch (const io::JobError&) {
    }
  }
  if (unit.pairs.empty() || unit.pairs.size() == files.size())
    throw io::JobError("of this person, or of all others, no recording can be used");
  std::vector<LeftOut> out;
  for (const HeldOut& errors :
       errors_without(unit, request, files, sample_all(files, r.clocks, request), step)) {
    const std::string& joint = request.map[out.size()].joint;
    if (errors.own.size() < 2) throw io::JobError(joint + ": nothing was measured there");
    out.push_back({row_of(joint, errors), judged(request, errors)});
  }
  return out;
}

model::Model fit_hand(const HandRequest& request, std::vector<HandRecordings> recordings, const Step& step) {
  HandIdentification r;
  HandRequest all = request;
  all.split = 1;
  all.threads = 1;  // whoever asks for fits has threads of its own
  for (Files& one : recordings) r.clocks.push_back(clock_of(all.map, all.clock_offset_s, one, r.warnings));
  fit_model(all, asked_for(all), recordings, sample_all(recordings, r.clocks, all), step, r);
  describe(all, recordings, r);
  return r.model;
}

namespace {

Json parameters_json(const std::vector<Parameter>& parameters) {
  Json out = Json::array();
  for (const Parameter& p : parameters) {
    const double reach = score::kNormal95 * p.standard_error;
    out.push_back({{"name", p.name},
                   {"value", p.value},
                   {"initial", p.initial ? Json(*p.initial) : Json(nullptr)},
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

Json clocks_json(const HandIdentification& r) {
  Json out = Json::array();
  for (std::size_t p = 0; p < r.clocks.size(); ++p) {
    out.push_back({{"sensor", io::to_utf8(r.request.pairs[p].sensor.string())},
                   {"reference", io::to_utf8(r.request.pairs[p].reference.string())},
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

}  // namespace

Json to_json(const HandIdentification& r) {
  Json joints = Json::object();
  for (std::size_t j = 0; j < r.joints.size(); ++j) {
    const JointResult& joint = r.joints[j];
    Json baselines = Json::object();
    for (const auto& [name, score] : joint.baselines) baselines[name] = score::to_json(score);
    Json rows = Json::array();
    for (const CandidateRow& row : joint.rows) {
      Json one = {
          {"structure", row.structure},
          {"chosen", row.chosen},
          {"cross_validated_rmse_deg",
           row.cross_validated_deg ? Json(*row.cross_validated_deg) : Json(nullptr)},
          {"fitted_rmse_deg", std::isnan(row.fitted_rmse_deg) ? Json(nullptr) : Json(row.fitted_rmse_deg)},
          {"fold_loss", row.fold_loss ? Json(*row.fold_loss) : Json(nullptr)},
          {"fold_loss_se", row.fold_loss ? Json(row.fold_loss_se) : Json(nullptr)},
          {"effective_parameters", row.parameters},
          {"hold_drift_deg", row.hold_drift_deg ? Json(*row.hold_drift_deg) : Json(nullptr)}};
      if (!row.refusal.empty()) one["refusal"] = row.refusal;
      rows.push_back(std::move(one));
    }
    const model::Ends ends =
        model::ends(r.model, *std::ranges::find(r.model.joints, joint.name, &model::Joint::name));
    joints[joint.name] = {{"verdict", score::to_json(joint.verdict)},
                          {"holdout", score::to_json(joint.holdout)},
                          {"baselines", std::move(baselines)},
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

}  // namespace flexor::identify
