#include "host/identify/identify.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <future>
#include <mutex>
#include <numeric>
#include <set>
#include <span>

#include "host/identify/estimator.hpp"
#include "host/identify/hold.hpp"
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

using io::InputError;

constexpr double kLongLead_s = 0.15;
constexpr std::size_t kLeastHeldOut = 20;
constexpr double kBeside_s = 1;
constexpr std::size_t kBlocks = 8;
constexpr double kMuchWorse = 1.5;
constexpr double kLittle = 0.2;
constexpr double kTogether = 0.25;
constexpr double kLost = 0.02;

using Sampled = std::vector<JointSamples>;  // of a joint, in each pair
using Samples = std::vector<Sampled>;       // of each joint

Samples sample_all(const std::vector<Take>& takes, const std::vector<Clock>& clocks, const Options& options) {
  Samples out(options.map.size(), Sampled(takes.size()));
  for (std::size_t p = 0; p < takes.size(); ++p) {
    for (std::size_t j = 0; j < options.map.size(); ++j) {
      for (const std::string& sensor : options.map[j].sensors)
        recording::sample_pair({takes[p].sensor, sensor, takes[p].reference[j], options.map[j].reference},
                               options.rate_hz, clocks[p].offset_s, options.lead_s, options.split,
                               out[j][p].sensors.emplace_back());
    }
  }
  return out;
}

bool is_good(const recording::Aligned& a, std::size_t k) {
  return a.gap[k] == 0 && a.input[k] >= a.valid.min && a.input[k] <= a.valid.max;
}

// The fitted part alone: the end that is held out is not even in memory here. Beside a part that is held out of the middle
// the angles of a second are not fitted either.
Session session_of(const JointSamples& take) {
  const recording::Aligned& first = take.own();
  const std::size_t size = first.held_end() < first.size() ? first.size() : first.holdout_begin;
  const auto guard = static_cast<std::size_t>(kBeside_s / first.period_s);
  const auto n = static_cast<Eigen::Index>(size);
  Session out;
  out.input.resize(n, std::ssize(take.sensors));
  for (Eigen::Index s = 0; const recording::Aligned& sensor : take.sensors)
    out.input.col(s++) = Eigen::Map<const Eigen::VectorXd>(sensor.input.data(), n);
  out.angle_deg = Eigen::Map<const Eigen::VectorXd>(first.angle_deg.data(), n);
  for (std::size_t k = 0; k < size; ++k) {
    const bool held =
        size > first.holdout_begin && k + guard >= first.holdout_begin && k < first.held_end() + guard;
    out.use.push_back(!held &&
                      std::ranges::all_of(take.sensors, [k](const auto& s) { return is_good(s, k); }));
  }
  return out;
}

bool left_out_wholly(const recording::Aligned& a) {
  return a.holdout_begin == a.overlap_begin && a.held_end() == a.size();
}

// Of what is left out wholly there is none.
std::vector<Session> sessions_of(const Sampled& sampled) {
  std::vector<Session> out;
  for (const JointSamples& take : sampled)
    if (!left_out_wholly(take.own())) out.push_back(session_of(take));
  return out;
}

void add_inputs(const Options& options, const std::vector<Take>& takes, const Samples& samples,
                model::Model& model) {
  for (const std::string& sensor : sensors_of(options.map)) {
    model::Input input{sensor, sensor, takes.front().sensor.column(sensor).unit, {}, HUGE_VAL, -HUGE_VAL};
    for (std::size_t j = 0; j < samples.size(); ++j) {
      const JointMap& joint = options.map[j];
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

// By the compensator, of the name "", and by the baselines.
using Errors = std::map<std::string, std::vector<double>>;

// Of what is held out; with `guessed` also where nothing was seen.
Errors errors_of(std::span<const JointSamples> sampled, bool guessed = false) {
  Errors out = {{"", {}}};
  for (const JointSamples& take : sampled) {
    const recording::Aligned& a = take.own();
    for (const auto& [name, estimates] : take.estimated_deg) {
      std::vector<double>& errors = out[name];
      for (std::size_t k = a.holdout_begin; k < a.held_end(); ++k)
        if (guessed || a.unseen[k] == 0) errors.push_back(estimates[k] - a.angle_deg[k]);
    }
  }
  return out;
}

// All pairs' held-out parts together, on one clock that jumps between them.
score::Score score_of(const Sampled& sampled, const std::string& name) {
  constexpr double kBetween_s = 1e5;
  std::vector<double> t_s;
  std::vector<double> measured;
  std::vector<double> estimated;
  std::vector<std::uint8_t> unseen;
  double max_step_s = 0;
  for (const JointSamples& take : sampled) {
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
void add_estimates(const std::string& name, const model::Model& model, const std::vector<Take>& takes,
                   std::span<Sampled> samples) {
  for (std::size_t p = 0; p < takes.size(); ++p) {
    const recording::Recording& log = takes[p].sensor;
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
model::Model start_model(const Options& options, const std::vector<Take>& takes, const Samples& samples) {
  model::Model out;
  const std::filesystem::path log = takes.front().files.sensor.stem();
  out.name = log.empty() ? "identified" : io::to_utf8(log.string());
  out.description =
      fmt::format("{} joint(s), fitted to {} pair(s) of recordings", options.map.size(), takes.size());
  out.written_by = "flexor " FLEXOR_VERSION;
  out.sample_period_s = 1 / options.rate_hz;
  add_inputs(options, takes, samples, out);
  return out;
}

// A joint's baselines, as --structure gives them; one that cannot be fitted is refused.
void add_baselines(const model::Model& inputs, const JointMap& map, const std::vector<Take>& takes,
                   Sampled& sampled, JointResult& joint) {
  std::map<std::string, model::Model>& fitted = joint.baseline_models;
  for (const score::Baseline& one : score::kBaselines) {
    try {
      if (!fitted.contains(one.structure))
        fitted[one.structure] = fit_baseline({sessions_of(sampled), inputs, map}, one.structure).model;
      add_estimates(one.name, fitted.at(one.structure), takes, {&sampled, 1});
    } catch (const io::JobError& error) {
      joint.baseline_refusals.push_back(fmt::format("{}: {}", one.name, error.what()));
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
void warn_of_holdout(const Sampled& sampled, const JointResult& joint, std::vector<std::string>& warnings) {
  if (const auto text = score::in_words_left_out(joint.holdout.left_out,
                                                 joint.holdout.samples + joint.holdout.left_out, "scored"))
    warnings.push_back(fmt::format("{}: {}", joint.name, *text));
  if (joint.holdout.rmse_deg > kMuchWorse * joint.fitted_rmse_deg)
    warnings.push_back(
        fmt::format("{}: the error on unseen data is {:.1f} times the error on the fitted part: the glove "
                    "changed during the recording, or the motion did",
                    joint.name, joint.holdout.rmse_deg / joint.fitted_rmse_deg));
  if (joint.hold_drift_deg > kMostDrift_deg && joint.verdict.advises)
    warnings.push_back(fmt::format(
        "{}: held still, its angle goes on by {:.1f} deg, to follow a sensor that creeps: hold the hand "
        "for a minute, and where that is wrong take --structure hysteresis, or record longer holds",
        joint.name, joint.hold_drift_deg));
  for (const std::string& refusal : joint.baseline_refusals)
    warnings.push_back(fmt::format("{}: baseline {}", joint.name, refusal));
  double moved_deg = 0;
  double taught_deg = 0;
  std::size_t unseen = 0;
  std::size_t fitted = 0;
  std::vector<recording::Halves> readings;
  for (const JointSamples& s : sampled) {
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

ScoreRow row_of(const std::string& name, const Errors& errors) {
  ScoreRow out{name, errors.at("").size(), score::rms(errors.at("")), {}};
  for (const auto& [baseline, error_deg] : errors)
    if (!baseline.empty()) out.baseline_deg[baseline] = score::rms(error_deg);
  return out;
}

// Of all samples, or of those held out; where what follows the compensator takes `later_s` more than the lead that it was fitted with.
double rmse_deg(const Sampled& sampled, bool held_out, double later_s) {
  std::vector<double> errors;
  for (const JointSamples& s : sampled) {
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
score::Verdict judged(const Options& options, Errors errors, const std::vector<std::size_t>& part_ends = {}) {
  std::string itself;
  const std::vector<double> own = errors.extract("").mapped();
  for (const score::Baseline& one : score::kBaselines) {
    const auto at = errors.find(one.name);
    if (at == errors.end()) continue;
    if (one.structure != options.structure && !alike(at->second, own)) continue;
    if (itself.empty()) itself = one.name;
    errors.erase(at);
  }
  score::Verdict out = score::judge(own, errors, 1 / options.rate_hz, part_ends);
  out.itself = itself;
  return out;
}

void score_joints(const Options& options, const std::vector<Take>& takes, Samples samples,
                  const std::set<std::string>& stuck, Result& r) {
  add_estimates("", r.model, takes, samples);
  const model::Model inputs = start_model(options, takes, samples);
  const std::vector<std::string> pairs = names_of(r.files);
  const auto score = [&](std::size_t j) {
    JointResult joint = r.joints[j];
    add_baselines(inputs, options.map[j], takes, samples[j], joint);
    joint.holdout = score_of(samples[j], "");
    joint.sooner_deg = rmse_deg(samples[j], true, -kLeadOff_s);
    joint.later_deg = rmse_deg(samples[j], true, kLeadOff_s);
    for (std::size_t p = 0; p < pairs.size(); ++p) {
      const Errors errors = errors_of({&samples[j][p], 1});
      if (!errors.at("").empty()) joint.pairs.push_back(row_of(pairs[p], errors));
    }
    Errors errors = errors_of(samples[j]);
    if (errors.at("").empty()) errors = errors_of(samples[j], true);  // as in the score
    for (const auto& [name, error_deg] : errors)
      if (!name.empty()) joint.baselines.emplace(name, score_of(samples[j], name));
    joint.verdict = judged(options, std::move(errors));
    joint.verdict.advises = !stuck.contains(joint.name);
    return joint;
  };
  const auto take = [&](std::size_t j, JointResult& joint) {
    warn_of_holdout(samples[j], joint, r.warnings);
    r.joints[j] = std::move(joint);
  };
  io::run_in_order<JointResult>(0, r.joints.size(), io::threads_of(options.threads), score, take);
  for (std::size_t j = 0; j < samples.size(); ++j) r.joints[j].samples = std::move(samples[j]);
}

void describe(const Options& options, const std::vector<Take>& takes, Result& r) {
  Json pairs = Json::array();
  const auto name = [](const recording::Recording& one) {
    return io::to_utf8(std::filesystem::path(one.source).filename().string());
  };
  for (std::size_t p = 0; p < takes.size(); ++p)
    pairs.push_back({{"sensor", name(takes[p].sensor)},
                     {"sensor_digest", takes[p].sensor.digest},
                     {"reference", name(takes[p].reference.front())},
                     {"reference_digest", takes[p].reference.front().digest},
                     {"clock_offset_s", r.clocks[p].offset_s}});
  r.model.training = {{"pairs", std::move(pairs)},
                      {"split", options.split},
                      {"fit_all", options.fit_all},
                      {"lead_s", options.lead_s}};
  if (options.map.size() == 1) r.model.training["output_column"] = options.map.front().reference;
  Json joints = Json::object();
  for (const JointResult& joint : r.joints) {
    joints[joint.name] = {{"structure", joint.structure},
                          {"verdict", score::to_json(joint.verdict)},
                          {"fitted_rmse_deg", joint.fitted_rmse_deg},
                          {"cross_validated_deg", joint.cross_validated_deg},
                          {"hold_drift_deg", joint.hold_drift_deg},
                          {"holdout", joint.holdout}};
    if (joint.untried > 0) joints[joint.name]["untried_structures"] = joint.untried;
  }
  r.model.fit = {{"joints", std::move(joints)}};
}

// Readings that are left out, and those that no board takes.
void warn_of_readings(const model::Model& model, const std::vector<Take>& takes,
                      std::vector<std::string>& warnings) {
  const model::Model board = model::folded(model).model;
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    const model::Input& input = model.inputs[i];
    std::vector<std::span<const double>> readings;
    for (const Take& one : takes) readings.emplace_back(one.sensor.column(input.name).value);
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
void warn_of_lacking_motion(const Options& options, const Samples& samples,
                            std::vector<std::string>& warnings) {
  std::vector<std::pair<std::string, std::vector<std::string>>> all;
  for (std::size_t j = 0; j < options.map.size(); ++j) {
    for (const std::string& text : lacking(sessions_of(samples[j]), 1 / options.rate_hz)) {
      auto known = std::ranges::find(all, text, &std::pair<std::string, std::vector<std::string>>::first);
      if (known == all.end()) known = all.insert(all.end(), {text, {}});
      known->second.push_back(options.map[j].joint);
    }
  }
  for (const auto& [text, joints] : all)
    warnings.push_back(fmt::format("{}: {}", fmt::join(joints, ", "), text));
}

// A joint that the wearer's own is fitted from.
model::Channel chain_of(const model::Model& model, const std::string& joint) {
  const auto at = std::ranges::find(model.joints, joint, &model::Joint::name);
  if (at == model.joints.end()) throw InputError("the model to start from has no joint {}", joint);
  const auto chain = model::channel(model, static_cast<std::size_t>(at - model.joints.begin()));
  if (!chain)
    throw InputError(
        "{}: the model to start from has no chain of one sensor for it, but a sum of curves or a mix of "
        "sensors: fit it to its wearer with flexor recalibrate, or leave out --refit and --initial",
        joint);
  return *chain;
}

// Where the fit of a joint begins: its chain in the initial model, if there is one. Below its dead zone a model that is refitted has
// no reading of its wearer.
std::optional<Initial> initial_of(const Options& options, const JointMap& map,
                                  const std::vector<Session>& sessions) {
  if (!options.initial) return {};
  Initial out{chain_of(*options.initial, map.joint), options.refit};
  const std::vector<double> readings = used_readings(sessions, 0);
  if (out.gain_alone && out.chain.dead_zone && !readings.empty())
    out.chain.dead_zone->lower = std::min(out.chain.dead_zone->lower, std::ranges::min(readings));
  return out;
}

void warn_of_other_units(const Options& options, Result& r) {
  for (const JointMap& map : options.map) {
    const model::Channel chain = chain_of(*options.initial, map.joint);
    model::Input wanted;
    wanted.name = chain.input_column;
    wanted.unit = chain.input_unit;
    const auto input = std::ranges::find(r.model.inputs, map.sensors.front(), &model::Input::name);
    if (const auto note = unit_note(wanted, "--refit", input->column, input->unit))
      r.warnings.push_back(*note);
  }
}

// Where each joint is at the open hand and at the fist: as the options say, else at the quantiles of its angles, of which the
// one nearer to zero is taken for the open hand. Where no joint comes near zero they are inner angles, as of MediaPipe: of one
// that reaches half a turn, which is straight, the other. None where the two are hardly apart.
std::vector<std::optional<model::Ends>> ends_of(const Options& options, const Samples& samples,
                                                std::vector<std::string>& warnings) {
  constexpr double kShare = 0.02;
  constexpr double kNearZero_deg = 45;      // no open hand is bent more
  constexpr double kNearStraight_deg = 30;  // of half a turn
  std::vector<std::optional<model::Ends>> out;
  for (const Sampled& sampled : samples) {
    std::vector<double> angles = used_angles(sessions_of(sampled));
    if (angles.empty()) angles.push_back(0);  // the fit will say so
    std::ranges::sort(angles);
    model::Ends ends{quantile(angles, kShare), quantile(angles, 1 - kShare)};
    if (std::abs(ends.fist_deg) < std::abs(ends.open_deg)) std::swap(ends.open_deg, ends.fist_deg);
    out.emplace_back(ends);
  }
  const bool are_inner =
      std::ranges::all_of(out, [&](const auto& ends) { return std::abs(ends->open_deg) > kNearZero_deg; });
  for (std::size_t j = 0; j < out.size(); ++j) {
    const std::string& joint = options.map[j].joint;
    model::Ends& ends = *out[j];
    if (are_inner && std::abs(std::abs(ends.fist_deg) - 180) < kNearStraight_deg)
      std::swap(ends.open_deg, ends.fist_deg);
    const auto stated = options.ends.find(joint);
    if (are_inner && (stated == options.ends.end() || stated->second == ends))
      warnings.push_back(
          fmt::format("{0}: its angles never come near zero: {1:.0f} deg is taken for the open hand, {2:.0f} "
                      "for the fist; if they are the other way round, add --pose-angles {0}={2:.0f}:{1:.0f}",
                      joint, ends.open_deg, ends.fist_deg));
    if (stated != options.ends.end())
      ends = stated->second;
    else if (std::abs(ends.fist_deg - ends.open_deg) < model::kLeastEnds_deg)
      out[j].reset();
  }
  return out;
}

// Joints that do not fit a board together: the largest is fitted again with less, and where no smaller one is there the next. What one
// step saved and the later ones made needless is given back.
void fit_into_room(const Options& options, const std::vector<std::string>& structures,
                   const std::function<std::future<JointResult>(std::size_t, double)>& fit,
                   const model::Model& inputs, Result& r) {
  std::vector<std::size_t> left;
  for (std::size_t j = 0; j < structures.size(); ++j)
    if (structures[j] == "auto") left.push_back(j);
  const auto share = [&](std::size_t j) { return options.room(r.joints[j].model); };
  std::vector<std::pair<std::size_t, JointResult>> larger;
  const auto exchange = [&](std::size_t j, JointResult& other) {
    std::swap(r.joints[j], other);
    r.model = inputs;
    for (const JointResult& joint : r.joints) append(joint.model, r.model);
  };
  while (options.room && options.room(r.model) > 1 && !left.empty()) {
    const std::size_t largest = *std::ranges::max_element(left, {}, share);
    std::optional<JointResult> smaller;
    try {
      smaller = fit(largest, share(largest)).get();
    } catch (const io::JobError&) {  // there is no smaller one
    }
    if (!smaller || !(options.room(smaller->model) < share(largest))) {
      std::erase(left, largest);
      continue;
    }
    exchange(largest, *smaller);
    larger.emplace_back(largest, std::move(*smaller));
  }
  std::ranges::reverse(larger);
  for (auto& [j, before] : larger) {
    exchange(j, before);
    if (options.room(r.model) > 1) exchange(j, before);
  }
  if (options.room && options.room(r.model) > 1)
    r.warnings.emplace_back("the joints together take more than a board's room: deploy refuses this model");
}

// `structures`, one for each joint.
void fit_joints(const Options& options, const std::vector<std::string>& structures, const Samples& samples,
                const Step& step, Result& r) {
  const std::vector<std::optional<model::Ends>> ends = ends_of(options, samples, r.warnings);
  const model::Model inputs = r.model;
  const std::size_t joints = options.map.size();
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
  // The first joint's failure is reported, whichever failed first.
  const auto fit = [&](std::size_t j, double most) {
    std::packaged_task<JointResult()> work([&] {
      JointResult out;
      out.name = options.map[j].joint;
      const std::vector<Session> sessions = sessions_of(samples[j]);
      const auto room = [&](model::Model model) {
        model.joints.front().ends = ends[j];
        return options.room(model);
      };
      const Task task{sessions, inputs, options.map[j], progress(j), options.room ? Room(room) : Room(),
                      most};
      static_cast<JointFit&>(out) =
          fit_joint(task, structures[j], initial_of(options, options.map[j], sessions));
      out.model.joints.front().ends = ends[j];
      if (options.refit) out.structure = "gain and dead zone refitted";
      return out;
    });
    work();
    return work.get_future();
  };
  io::run_in_order<std::future<JointResult>>(
      0, joints, io::threads_of(options.threads), [&](std::size_t j) { return fit(j, HUGE_VAL); },
      [&](std::size_t, std::future<JointResult>& fitted) {
        r.joints.push_back(fitted.get());
        append(r.joints.back().model, r.model);
      });
  fit_into_room(options, structures, fit, inputs, r);
}

// Samples count where the fingers that this joint's sensors follow are as far closed as its own, to a quarter of their ranges: a sensor
// that feels its neighbours reads otherwise at the open hand than where its finger alone is open.
std::vector<Session> together(const Samples& samples, std::size_t joint,
                              const std::vector<JointResult>& joints) {
  std::vector<Session> out = sessions_of(samples[joint]);
  const auto shares = [](const Session& session) -> Eigen::ArrayXd {
    const double least = session.angle_deg.minCoeff();
    return (session.angle_deg.array() - least) / (session.angle_deg.maxCoeff() - least);
  };
  for (std::size_t j = 0; j < samples.size(); ++j) {
    const auto& sensors = joints[joint].sensors;
    if (j == joint || std::ranges::find(sensors, joints[j].sensors.front()) == sensors.end()) continue;
    const std::vector<Session> other = sessions_of(samples[j]);
    for (std::size_t p = 0; p < out.size(); ++p) {
      if (other[p].angle_deg.size() != out[p].angle_deg.size()) continue;
      const Eigen::ArrayXd apart = (shares(other[p]) - shares(out[p])).abs();
      for (std::size_t k = 0; k < out[p].use.size(); ++k)
        if (!(apart(static_cast<Eigen::Index>(k)) <= kTogether)) out[p].use[k] = 0;
    }
  }
  return out;
}

// How each sensor's readings spread, over the samples of the first joint that it tells of, and its poses by the joint whose own it
// is; one that is no joint's own has none.
void add_readings(const Options& options, const Samples& samples, Result& r) {
  for (model::Input& input : r.model.inputs) {
    bool is_added = false;
    bool is_own = false;
    for (std::size_t j = 0; j < options.map.size() && !is_own; ++j) {
      const std::vector<std::string>& sensors = options.map[j].sensors;
      const auto at = std::ranges::find(sensors, input.name) - sensors.begin();
      if (at == std::ssize(sensors) || (is_added && at > 0)) continue;
      const std::vector<Session> sessions = sessions_of(samples[j]);
      if (!is_added) add_spread(sessions, at, input);
      is_added = true;
      is_own = at == 0;
      if (is_own) add_poses(together(samples, j, r.joints), 0, r.model.sample_period_s, input);
    }
  }
}

void fit_model(const Options& options, const std::vector<std::string>& structures,
               const std::vector<Take>& takes, const Samples& samples, const Step& step, Result& r) {
  r.model = start_model(options, takes, samples);
  if (options.refit) warn_of_other_units(options, r);
  fit_joints(options, structures, samples, step, r);
  add_readings(options, samples, r);
  std::erase_if(r.model.inputs, [&](const model::Input& input) {
    return std::ranges::none_of(r.model.blocks, [&](const auto& block) {
      return std::ranges::find(block.from, input.name) != block.from.end();
    });
  });
}

// Of each joint; where initial values are given and nothing is asked for, theirs.
std::vector<std::string> asked_for(const Options& options) {
  std::vector<std::string> out(options.map.size(), options.structure);
  if (!options.initial || options.structure != "auto") return out;
  const Json fits = options.initial->fit.value("joints", Json::object());
  for (std::size_t j = 0; j < out.size(); ++j) {
    const std::string& joint = options.map[j].joint;
    Structure structure = structure_of(chain_of(*options.initial, joint));
    // A document has limits whether they were fitted or not; its own words tell.
    if (const Json fit = fits.value(joint, Json::object()); !options.refit && fit.contains("structure"))
      structure.saturation = fit["structure"].dump().find("saturation") != std::string::npos;
    out[j] = text_of(structure);
  }
  return out;
}

// What was proven on a part, the same structures once more from all; the figures stay those of the part. A joint of it that errs
// more on all than what was proven stays as that is; false: it was not fitted.
bool fit_again(const Options& options, const std::vector<Take>& takes, Result& r) {
  constexpr double kWorse = 1.03;
  Options all = options;
  all.split = 1;
  Result again;
  std::vector<std::string> proven;
  for (std::size_t j = 0; j < r.joints.size(); ++j) {
    proven.push_back(r.joints[j].text);
    all.map[j].sensors = r.joints[j].sensors;
  }
  Samples samples = sample_all(takes, r.clocks, all);
  try {
    fit_model(all, proven, takes, samples, {}, again);
  } catch (const io::JobError& error) {
    r.warnings.push_back(
        fmt::format("fitted to all: {}: the model is the one of the first part", error.what()));
    return false;
  }
  add_estimates("", again.model, takes, samples);
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

std::vector<Unit> units_of(const Options& options, const std::vector<PairFiles>& takes) {
  std::vector<Unit> out;
  std::vector<std::size_t> all(takes.size());
  std::iota(all.begin(), all.end(), 0);
  for (std::size_t b = 0; options.leave_out == LeaveOut::block && b < kBlocks; ++b) {
    constexpr double kShare = 1.0 / kBlocks;
    const auto at = static_cast<double>(b);
    out.push_back({fmt::format("block {} of {}", b + 1, kBlocks), all, at * kShare, (at + 1) * kShare});
  }
  if (options.leave_out == LeaveOut::take)
    for (const std::size_t p : all) out.push_back({names_of(takes)[p], {p}});
  std::map<std::filesystem::path, std::vector<std::size_t>> folders;
  for (const std::size_t p : all)
    folders[std::filesystem::weakly_canonical(takes[p].sensor).parent_path()].push_back(p);
  if (options.leave_out == LeaveOut::person) {
    std::vector<std::filesystem::path> persons;
    for (const auto& [folder, pairs] : folders) persons.push_back(folder);
    const std::vector<std::string> names = short_names(persons);
    for (const auto& [folder, pairs] : folders) out.push_back({names[out.size()], pairs});
  }
  if (out.size() > 1) return out;
  throw InputError(
      options.leave_out == LeaveOut::person
          ? "--leave-out person: all logs lie in one folder: put each person's into a folder of its own"
          : "--leave-out take: there is one pair alone: give more, or --leave-out block");
}

void check(const Options& options) {
  if (!(options.split > 0 && options.split < 1)) throw InputError("the split must lie between 0 and 1");
  recording::check_clock(options.rate_hz, options.clock_offset_s, options.lead_s);
  (void)io::threads_of(options.threads);
  for (const JointMap& joint : options.map) (void)parse_structure(options.structure, joint.sensors.size());
  const auto require_joint = [&](const std::string& name, const char* what) {
    if (std::ranges::find(options.map, name, &JointMap::joint) == options.map.end())
      throw InputError("the {} of \"{}\", which is no joint of the map", what, name);
  };
  for (const auto& [name, error_deg] : options.reference_error_deg) {
    require_joint(name, "error of the angles");
    if (!(error_deg > 0 && error_deg < 90))
      throw InputError("{}: the error of the angles must lie between 0 and 90 degrees", name);
  }
  for (const auto& [name, ends] : options.ends) {
    require_joint(name, "ends");
    if (!(std::abs(ends.fist_deg - ends.open_deg) >= model::kLeastEnds_deg))
      throw InputError("{}: open hand and fist must be a degree apart or more", name);
  }
}

// What the fit is off by and what its angles are off by, as if they had nothing in common: a bound, since noise of the angles is
// in both.
void state_reference_error(const Options& options, Result& r) {
  for (model::Joint& joint : r.model.joints) {
    const auto found = options.reference_error_deg.find(joint.name);
    if (found == options.reference_error_deg.end()) continue;
    if (joint.accuracy)
      for (double& error_deg : joint.accuracy->standard_error_deg)
        error_deg = std::hypot(error_deg, found->second);
    r.warnings.push_back(
        fmt::format("{}: the measured angles themselves err by about {:g} deg: every figure is against them, "
                    "not against the hand",
                    joint.name, found->second));
  }
}

Samples without(Samples samples, const Unit& unit) {
  for (Sampled& sampled : samples) {
    for (std::size_t p = 0; p < sampled.size(); ++p) {
      const bool out = std::ranges::find(unit.pairs, p) != unit.pairs.end();
      for (recording::Aligned& a : sampled[p].sensors) {
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

// A model that is fitted to the rest, with every choice made again: of each joint what it errs by on the unit. Throws io::Cancelled where
// it was stopped before it had tried all.
std::vector<Errors> errors_without(const Unit& unit, const Options& options, const std::vector<Take>& takes,
                                   const Samples& whole, const Step& step) {
  Samples samples = without(whole, unit);
  Result one;
  fit_model(options, asked_for(options), takes, samples, step, one);
  add_estimates("", one.model, takes, samples);
  const model::Model inputs = start_model(options, takes, samples);
  std::vector<Errors> out;
  for (std::size_t j = 0; j < one.joints.size(); ++j) {
    if (one.joints[j].untried > 0) throw io::Cancelled("stopped");
    add_baselines(inputs, options.map[j], takes, samples[j], one.joints[j]);
    out.push_back(errors_of(samples[j]));
  }
  return out;
}

// One unit after the other is left out. Where one could not be, the rows of the others stand without a verdict.
void leave_out(const Options& options, const std::vector<Take>& takes, const Step& step, Result& r) {
  const std::vector<Unit> units = units_of(options, r.files);
  Options all = options;
  all.split = 1;
  const Samples whole = sample_all(takes, r.clocks, all);
  std::vector<Errors> errors(r.joints.size(), {{"", {}}});
  std::vector<std::vector<std::size_t>> ends(r.joints.size());
  bool complete = true;
  for (std::size_t u = 0; u < units.size() && !r.leave_out_stopped; ++u) {
    const auto part = [&](std::size_t done, std::size_t of, const std::string& what) {
      return !step ||
             step(u * of + done, units.size() * of, fmt::format("without {}: {}", units[u].name, what));
    };
    try {
      const std::vector<Errors> found = errors_without(units[u], options, takes, whole, part);
      for (std::size_t j = 0; j < errors.size(); ++j) {
        for (const auto& [name, more] : found[j])
          errors[j][name].insert(errors[j][name].end(), more.begin(), more.end());
        if (found[j].at("").empty()) continue;  // nothing was measured there
        r.joints[j].left_out.push_back(row_of(units[u].name, found[j]));
        ends[j].push_back(errors[j].at("").size());
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
    const std::size_t size = errors[j].at("").size();
    if (size < 2) continue;
    std::erase_if(errors[j], [size](const auto& one) { return one.second.size() != size; });
    if (options.leave_out == LeaveOut::block) ends[j].clear();
    r.joints[j].left_out_verdict = judged(options, std::move(errors[j]), ends[j]);
  }
}

// Sensors beside the own one whose readings are missing or refused where its are good, so that each would hold the angle, or that
// never change.
void leave_out_lost(Samples& samples, Options& options, std::vector<std::string>& warnings) {
  for (std::size_t j = 0; j < samples.size(); ++j) {
    std::vector<std::string>& sensors = options.map[j].sensors;
    for (std::size_t s = sensors.size() - 1; s > 0; --s) {
      double good = 0;
      std::vector<double> readings;
      for (const JointSamples& take : samples[j]) {
        for (std::size_t k = take.begin(); k < take.own().holdout_begin; ++k) {
          if (!is_good(take.own(), k)) continue;
          ++good;
          if (is_good(take.sensors[s], k)) readings.push_back(take.sensors[s].input[k]);
        }
      }
      const double lost = good - static_cast<double>(readings.size());
      const bool moves = !readings.empty() && std::ranges::min(readings) < std::ranges::max(readings);
      if (good == 0 || (moves && lost <= kLost * good)) continue;
      warnings.push_back(fmt::format(
          "{}: {} is left out: {}", options.map[j].joint, sensors[s],
          moves ? fmt::format("{:.0f} % of its readings are missing or refused", 100 * lost / good)
                : "it never changes in the fitted part"));
      sensors.erase(sensors.begin() + static_cast<std::ptrdiff_t>(s));
      for (JointSamples& take : samples[j])
        take.sensors.erase(take.sensors.begin() + static_cast<std::ptrdiff_t>(s));
    }
  }
}

// A few samples prove nothing.
void check_held_out(const recording::Aligned& a) {
  if (left_out_wholly(a)) throw InputError("the split leaves nothing to fit: a larger --split");
  if (a.size() - a.holdout_begin >= kLeastHeldOut) return;
  throw InputError(
      "{} samples would be held out, at least {} are needed: a smaller --split, or record longer",
      a.size() - a.holdout_begin, kLeastHeldOut);
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

Result identify_files(const Request& request, const Step& step) {
  check(request);
  std::vector<std::string> warnings;
  Result out = identify(read_takes(request, warnings), request, step);
  out.warnings.insert(out.warnings.begin(), warnings.begin(), warnings.end());
  return out;
}

Result identify(std::vector<Take> takes, const Options& asked, const Step& step) {
  check(asked);
  Options options = asked;
  if (takes.empty()) throw InputError("no recordings: --pair GLOVE CAMERA, or --sensor and --reference");
  Result r;
  for (const Take& take : takes) r.files.push_back(take.files);
  if (options.leave_out != LeaveOut::none) (void)units_of(options, r.files);
  if (options.lead_s > kLongLead_s) {
    r.warnings.push_back(fmt::format(
        "a lead of {:g} s is long: it is right where flexor latency and the hand's 0.02 s add up to it; "
        "curves and chains lose two fifths in the twin by one that is twice as long",
        options.lead_s));
  }
  std::set<std::string> stuck;  // joints
  for (std::size_t p = 0; p < takes.size(); ++p) {
    r.clocks.push_back(clock_of(options.map, options.clock_offset_s, takes[p], r.warnings));
    const Clock& clock = r.clocks.back();
    const std::size_t before = r.warnings.size();
    stuck.merge(check_map(options, takes[p], clock.offset_s, r.warnings));
    const std::string why = r.warnings.size() > before ? r.warnings[before] : "";
    if (!options.clock_offset_s)
      refuse_unsure(takes[p].sensor.source, clock.offset_s, clock.confidence,
                    clock.surest ? clock.surest->jump.value_or(why) : why);
  }
  Samples samples = sample_all(takes, r.clocks, options);
  leave_out_lost(samples, options, r.warnings);
  r.options = options;
  for (std::size_t j = 0; j < options.map.size(); ++j) {
    for (const JointSamples& take : samples[j]) check_held_out(take.own());
    const std::vector<Session> sessions = sessions_of(samples[j]);
    check_gloves(options.map[j], names_of(r.files), sessions);
    const auto other = std::ranges::find(options.map, options.map[j].reference, &JointMap::reference);
    if (other->joint != options.map[j].joint)
      r.warnings.push_back(fmt::format("{} and {}: \"{}\" is the angle of both: is the map right?",
                                       other->joint, options.map[j].joint, other->reference));
    for (const std::string& text : one_sided(options.map[j], sessions))
      r.warnings.push_back(fmt::format("{}: {}", options.map[j].joint, text));
  }
  warn_of_lacking_motion(options, samples, r.warnings);
  const auto start = std::chrono::steady_clock::now();
  fit_model(options, asked_for(options), takes, samples, step, r);
  r.fit_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  for (const JointResult& joint : r.joints)
    if (joint.untried > 0) r.warnings.push_back(fmt::format("{}: {}", joint.name, kStopped));
  score_joints(options, takes, samples, stuck, r);
  if (options.leave_out != LeaveOut::none) leave_out(options, takes, step, r);
  r.proven = r.model;
  Options done = options;
  done.fit_all = options.fit_all && fit_again(options, takes, r);
  state_reference_error(options, r);
  warn_of_readings(r.model, takes, r.warnings);
  describe(done, takes, r);
  return r;
}

std::vector<LeftOut> leave_person_out(const Request& request, const std::vector<std::size_t>& own,
                                      const Step& step) {
  check(request);
  Options options = request;
  options.split = 1;
  std::vector<Take> takes;
  Result r;
  Unit unit;
  for (std::size_t p = 0; p < request.pairs.size(); ++p) {
    try {
      std::vector<Take> read = read_takes({options, {request.pairs[p]}}, r.warnings);
      std::vector<Clock> clocks;
      for (Take& take : read) {
        clocks.push_back(clock_of(options.map, options.clock_offset_s, take, r.warnings));
        if (!options.clock_offset_s)
          refuse_unsure(take.sensor.source, clocks.back().offset_s, clocks.back().confidence);
      }
      for (std::size_t i = 0; i < read.size(); ++i) {
        if (std::ranges::find(own, p) != own.end()) unit.pairs.push_back(takes.size());
        r.clocks.push_back(clocks[i]);
        takes.push_back(std::move(read[i]));
      }
    } catch (const InputError&) {  // its own row says why
    } catch (const io::JobError&) {
    }
  }
  if (unit.pairs.empty() || unit.pairs.size() == takes.size())
    throw io::JobError("of this person, or of all others, no recording can be used");
  std::vector<LeftOut> out;
  for (const Errors& errors :
       errors_without(unit, options, takes, sample_all(takes, r.clocks, options), step)) {
    const std::string& joint = options.map[out.size()].joint;
    if (errors.at("").size() < 2) throw io::JobError(joint + ": nothing was measured there");
    out.push_back({row_of(joint, errors), judged(options, errors)});
  }
  return out;
}

model::Model fit_takes(std::vector<Take> takes, const Options& options, const Step& step) {
  Result r;
  Options all = options;
  all.split = 1;
  all.threads = 1;  // whoever asks for fits has threads of its own
  for (Take& one : takes) r.clocks.push_back(clock_of(all.map, all.clock_offset_s, one, r.warnings));
  fit_model(all, asked_for(all), takes, sample_all(takes, r.clocks, all), step, r);
  describe(all, takes, r);
  return r.model;
}

}  // namespace flexor::identify
