#include "host/identify/identification.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "host/identify/estimator.hpp"
#include "host/identify/hold.hpp"
#include "host/identify/motion_check.hpp"
#include "host/identify/poses.hpp"
#include "host/identify/structure_text.hpp"
#include "host/io/json.hpp"
#include "host/model/channel.hpp"
#include "host/model/compensator.hpp"
#include "host/recording/unit.hpp"
#include "host/score/least_squares.hpp"

namespace flexor::identify {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kMuchWorse = 1.5;
constexpr double kLittle = 0.2;
constexpr double kCreep_deg = 1;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// A finger named in either column; none if there is none.
std::optional<std::string> finger_in(const recording::Pair& pair) {
  for (std::string column : {pair.input, pair.output}) {
    std::ranges::transform(column, column.begin(), [](unsigned char c) { return std::tolower(c); });
    for (const char* name : {"thumb", "index", "pointer", "middle", "ring", "pinky", "little"}) {
      if (column.find(name) != std::string::npos) return model::finger(name);
    }
  }
  return std::nullopt;
}

// Not one of the families, which have options of their own.
bool is_text(const Request& r) {
  if (r.monotone && r.structure == "auto") return false;
  return std::ranges::none_of(families(), [&](Family family) { return name(family) == r.structure; });
}

Structure requested_structure(const Request& r) {
  const Family wanted = family(r.structure);
  if (r.dead_zone) {
    if (wanted != Family::hw) throw io::InputError("a dead zone goes with structure hw only");
    if (r.knots) throw io::InputError("a dead zone replaces the input curve: leave out the number of knots");
    return make_dead_zone_structure(r.order.value_or(1));
  }
  const auto refuse = [&](bool given, const char* what) {
    if (given)
      throw io::InputError(fmt::format("structure {} has no {}: leave that option out", r.structure, what));
  };
  const bool still = wanted == Family::linear;
  refuse(r.order && still, "poles (--order)");
  refuse(r.knots && (still || wanted == Family::linear_dynamic), "curve (--knots)");
  refuse(r.plays && wanted != Family::hw_hysteresis, "play operators (--plays)");
  Structure s = make_structure(wanted, r.order.value_or(kDefaultOrder), r.knots.value_or(kDefaultKnots),
                               r.plays.value_or(kDefaultPlays));
  s.monotone = r.monotone && (s.input_knots > 0 || s.output_knots > 0);
  check(s);
  return s;
}

// The log through the model, as apply runs it, at the samples that are scored.
std::vector<double> estimate(const model::Model& model, const Identification& r) {
  Estimator<model::DoubleArithmetic> estimator(model);
  const recording::Series log = r.pair.sensor.series(r.pair.input);
  std::vector<double> out;
  for (std::size_t i = 0; i < log.t_s.size() && out.size() < r.aligned.size(); ++i) {
    estimator.push(log.t_s[i], log.value.subspan(i, 1),
                   [&](const Estimate& e) { out.push_back(e.angle_deg[0]); });
  }
  out.resize(r.aligned.size());
  return out;
}

// All but blocks and joints.
model::Model start_model(const std::string& structure, const Identification& r) {
  model::Model m;
  m.name = io::to_utf8(std::filesystem::path(r.pair.sensor.source).stem().string());
  m.description = fmt::format("{} fitted to {} against {}", structure, r.pair.input, r.pair.output);
  m.written_by = "flexor " FLEXOR_VERSION;
  m.sample_period_s = r.aligned.period_s;
  m.max_gap_s = r.aligned.max_gap_s;
  return m;
}

model::Model make_model(const Summary& fit, const Identification& r) {
  model::Model m = start_model(describe(fit.structure), r);
  model::Channel channel = fit.channel;
  channel.input_column = r.pair.input;
  channel.input_unit = r.pair.sensor.column(r.pair.input).unit;
  channel.valid_min = r.aligned.valid.min;
  channel.valid_max = r.aligned.valid.max;
  model::add(m, channel);
  return m;
}

class Scorer {
 public:
  Scorer(const recording::Aligned& aligned, std::size_t begin)
      : angle_(aligned.angle_deg),
        gap_(aligned.gap),
        unseen_(aligned.unseen),
        begin_(begin),
        t_(aligned.t_s.begin() + static_cast<std::ptrdiff_t>(begin), aligned.t_s.end()),
        max_step_s_(std::max(aligned.max_gap_s, 1.5 * aligned.period_s)) {}

  score::Score all(const std::vector<double>& estimate) const {
    const std::span measured(angle_.begin() + static_cast<std::ptrdiff_t>(begin_), angle_.end());
    const std::span estimated(estimate.begin() + static_cast<std::ptrdiff_t>(begin_), estimate.end());
    return score::score_seen(t_, measured, estimated, std::span(unseen_).subspan(begin_), max_step_s_);
  }

  // None where less than two samples are left, or the finger stands still in all of them.
  std::optional<score::Score> without_gaps(const std::vector<double>& estimate) const {
    std::vector<double> t;
    std::vector<double> measured;
    std::vector<double> estimated;
    for (std::size_t k = begin_; k < angle_.size(); ++k) {
      if (gap_[k]) continue;
      t.push_back(t_[k - begin_]);
      measured.push_back(angle_[k]);
      estimated.push_back(estimate[k]);
    }
    if (t.size() < 2 || std::ranges::min(measured) == std::ranges::max(measured)) return std::nullopt;
    return score::score(t, measured, estimated, max_step_s_);
  }

 private:
  const std::vector<double>& angle_;
  const std::vector<std::uint8_t>& gap_;
  const std::vector<std::uint8_t>& unseen_;
  std::size_t begin_;
  std::vector<double> t_;
  double max_step_s_;
};

TableRow make_row(const Candidate& candidate, const Identification& r, const Scorer& scorer) {
  TableRow row;
  row.name = describe(candidate.structure);
  row.refusal = candidate.refusal;
  if (!row.refusal.empty()) return row;
  row.parameters = candidate.summary.free_parameters;
  row.fitted_rmse_deg = candidate.summary.rmse_deg;
  if (candidate.cross_validated_deg > 0) row.cross_validated_deg = candidate.cross_validated_deg;
  row.holdout = scorer.all(estimate(make_model(candidate.summary, r), r));
  return row;
}

struct Plain {
  std::vector<double> line;
  std::vector<double> curve;
};

Plain plain_estimates(const recording::Aligned& aligned, const std::vector<std::uint8_t>& use) {
  std::vector<double> reading;
  std::vector<double> angle;
  for (std::size_t k = 0; k < use.size(); ++k) {
    if (!use[k]) continue;
    reading.push_back(aligned.input[k]);
    angle.push_back(aligned.angle_deg[k]);
  }
  const auto [offset, gain] = score::least_squares_line(reading, angle);
  Plain out{{}, score::least_squares_curve(reading, angle, aligned.input)};
  for (const double u : aligned.input) out.line.push_back(offset + gain * u);
  return out;
}

// What a refusal means to somebody who only wants to use the compensator; the refusal itself follows in
// brackets.
std::string in_plain_words(const std::string& refusal) {
  const auto starts = [&](const char* what) { return refusal.starts_with(what); };
  const char* meaning = "part of the curve could not be learnt from this recording";
  if (starts("saturation")) {
    meaning =
        "the finger never reached an end stop there, so that this limit of the output is a safe one, not a "
        "measured one";
  } else if (starts("pole") || starts("tap")) {
    meaning =
        "one detail of how the sensor lags could not be learnt from this recording: other values fit as well";
  } else if (starts("radius") || starts("weight")) {
    meaning =
        "one detail of the sensor's hysteresis could not be learnt from this recording: other values fit as "
        "well";
  }
  return fmt::format("{} ({})", meaning, refusal);
}

double span_deg(const recording::Aligned& a, std::size_t begin, std::size_t end) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (std::size_t k = begin; k < end; ++k) {
    if (a.gap[k]) continue;
    low = std::min(low, a.angle_deg[k]);
    high = std::max(high, a.angle_deg[k]);
  }
  return std::max(0.0, high - low);
}

using Warnings = std::vector<std::string>;

// How the fit went, and how the held-out part compares with it.
void warn_of_fit(const Identification& r, Warnings& warnings) {
  for (const std::string& refusal : r.fit.refusals) {
    warnings.push_back(in_plain_words(refusal));
  }
  if (r.fit.status == Status::iteration_limit) {
    warnings.emplace_back(
        "the fit was still improving when it was stopped: try a simpler structure or a longer recording");
  }
  if (r.holdout.rmse_deg >= r.baseline.rmse_deg) {
    warnings.push_back(
        fmt::format("on data it never saw the compensator ({:.2f} deg) is no better than a straight "
                    "line ({:.2f} deg)",
                    r.holdout.rmse_deg, r.baseline.rmse_deg));
  }
  if (const auto text = score::in_words_left_out(r.holdout)) warnings.push_back(*text);
  if (!r.holdout_without_gaps) {
    warnings.emplace_back("all of the held-out part lies in pauses of a log: its figures say little");
  } else if (r.holdout_without_gaps->rmse_deg > kMuchWorse * r.fit.rmse_deg) {
    warnings.push_back(
        fmt::format("the error on unseen data is {:.1f} times the error on the fitted part: the glove "
                    "changed during the recording, or the motion did",
                    r.holdout_without_gaps->rmse_deg / r.fit.rmse_deg));
  }
  if (r.holdout_without_gaps && r.holdout.rmse_deg > kMuchWorse * r.holdout_without_gaps->rmse_deg) {
    warnings.push_back(
        fmt::format("most of the error falls into pauses of a log, where there is nothing to compensate: "
                    "without them it is {:.2f} deg; log without pauses",
                    r.holdout_without_gaps->rmse_deg));
  }
}

// What the fitted part did not teach.
void warn_of_motion(const Identification& r, Warnings& warnings) {
  const double moved = span_deg(r.aligned, r.holdout_begin, r.aligned.size());
  const double taught = span_deg(r.aligned, r.aligned.overlap_begin, r.holdout_begin);
  if (moved < kLittle * taught) {
    warnings.push_back(fmt::format(
        "the finger moves by {:.1f} deg in the held-out part and by {:.0f} in the fitted one: nothing "
        "is proven; move through the whole range all the time, or choose another --split",
        moved, taught));
  }
  Session fitted;
  fitted.input =
      Eigen::Map<const Eigen::VectorXd>(r.aligned.input.data(), static_cast<Eigen::Index>(r.holdout_begin));
  if (const double creep = hold_drift_deg(r.model, {fitted}, {r.model.inputs.front().name});
      creep > kCreep_deg) {
    warnings.push_back(fmt::format(
        "held still, the angle creeps by up to {:.1f} deg within a minute: the recording holds too few "
        "rests to tell slow recovery from repeated motion; a structure of fewer poles creeps less",
        creep));
  }
  const std::span readings(r.aligned.input);
  if (const auto text = recording::beyond_fitted(
          {{readings.subspan(r.aligned.overlap_begin, r.holdout_begin - r.aligned.overlap_begin),
            readings.subspan(r.holdout_begin)}}))
    warnings.push_back(*text);
}

// What the log does not say, or says wrongly.
void warn_of_log(const Identification& r, Warnings& warnings) {
  const model::Input& input = r.model.inputs.front();
  if (const auto text = refused_readings(input, {r.pair.sensor.column(r.pair.input).value}))
    warnings.push_back(*text);
  if (input.unit.empty()) {
    warnings.push_back(fmt::format(
        "column \"{}\" states no unit: the model runs on logs like this one; for the boards say it with "
        "--input-unit: count, V, ...",
        r.pair.input));
  }
  if (!r.request.channel && !finger_in(r.pair)) {
    warnings.emplace_back("no column names a finger: the channel is called index; --channel says otherwise");
  }
}

void add_warnings(Identification& r) {
  r.warnings = r.aligned.warnings;
  warn_of_fit(r, r.warnings);
  warn_of_motion(r, r.warnings);
  warn_of_log(r, r.warnings);
}

// The fitted part alone: what is held out is not even in memory here.
Data fitted_data(const Identification& r, const std::string& channel) {
  const recording::Aligned& a = r.aligned;
  const auto fitted = static_cast<Eigen::Index>(r.holdout_begin);
  Data data;
  data.channel = channel;
  data.period_s = a.period_s;
  data.input = Eigen::Map<const Eigen::VectorXd>(a.input.data(), fitted);
  data.angle_deg = Eigen::Map<const Eigen::VectorXd>(a.angle_deg.data(), fitted);
  data.use.resize(r.holdout_begin);
  for (std::size_t k = 0; k < data.use.size(); ++k) data.use[k] = !a.gap[k];
  return data;
}

struct Fitted {
  std::vector<Candidate> candidates;
  std::optional<std::size_t> chosen;  // of these; none: what stands below
  std::optional<JointFit> by_text;
  double seconds = 0;       // without the families that only stand beside it in the table
  std::size_t untried = 0;  // candidates, after a stop
};

bool goes_on(const Progress& progress, std::size_t done, const Structure& next) {
  return !progress || progress(done, families().size(), describe(next));
}

// The other families at their usual size, so that the table compares; a stop leaves it short.
void fit_others(const Data& data, std::optional<Family> chosen, const Progress& progress,
                std::vector<Candidate>& candidates) {
  std::size_t done = chosen ? 1 : 0;
  for (const Family family : families()) {
    if (family == chosen) continue;
    Candidate other{make_structure(family), {}, 0, {}};
    if (!goes_on(progress, done++, other.structure)) return;
    try {
      Options quick;
      quick.max_starts = 2;
      other.summary = fit(other.structure, data, quick);
    } catch (const io::JobError& error) {
      other.refusal = error.what();
    }
    candidates.push_back(std::move(other));
  }
}

model::Input input_of(const std::string& channel, const Identification& r) {
  return {r.pair.input, r.pair.input,        r.pair.sensor.column(r.pair.input).unit,
          channel,      r.aligned.valid.min, r.aligned.valid.max};
}

JointFit fit_by_text(const Identification& r, const Data& data, const Progress& progress) {
  model::Model inputs = start_model("", r);
  inputs.inputs.push_back(input_of(data.channel, r));
  Session session{data.input, data.angle_deg, data.use};
  for (std::size_t k = 0; k < session.use.size(); ++k) {
    const double u = data.input(static_cast<Eigen::Index>(k));
    session.use[k] = session.use[k] && u >= r.aligned.valid.min && u <= r.aligned.valid.max;
  }
  return fit_joint({session}, inputs, {data.channel, {r.pair.input}, r.pair.output}, r.request.structure,
                   progress);
}

Fitted fit_structures(const Identification& r, const Data& data, const Progress& progress) {
  const Request& request = r.request;
  const auto start = std::chrono::steady_clock::now();
  if (is_text(request)) {
    Fitted out;
    out.by_text = fit_by_text(r, data, progress);
    out.seconds = seconds_since(start);
    out.untried = out.by_text->untried;
    fit_others(data, {}, progress, out.candidates);
    return out;
  }
  if (request.structure == "auto") {
    Selection selection = select(auto_candidates(request.monotone), data, progress);
    return {std::move(selection.candidates), selection.chosen, {}, seconds_since(start), selection.untried};
  }
  Candidate asked{requested_structure(request), {}, 0, {}};
  if (!goes_on(progress, 0, asked.structure)) throw io::Cancelled("cancelled");
  asked.summary = fit(asked.structure, data);
  Fitted out{{std::move(asked)}, 0, {}, seconds_since(start)};
  fit_others(data, out.candidates.front().structure.family, progress, out.candidates);
  return out;
}

// Where the model comes from and how good it is, into the model.
void document(Identification& r) {
  const auto file = [](const recording::Recording& recording) {
    return io::to_utf8(std::filesystem::path(recording.source).filename().string());
  };
  r.model.training = {{"sensor", file(r.pair.sensor)},
                      {"sensor_digest", r.pair.sensor.digest},
                      {"reference", file(r.pair.reference)},
                      {"reference_digest", r.pair.reference.digest},
                      {"output_column", r.pair.output},
                      {"clock_offset_s", r.aligned.clock_offset_s},
                      {"split", r.request.split},
                      {"lead_s", r.request.lead_s},
                      {"fitted_samples", r.fit.used_samples}};
  Json parameters = Json::array();
  for (const Parameter& p : r.fit.parameters) {
    Json entry = {{"name", p.name}, {"value", p.value}};
    if (p.refused) {
      entry["refused"] = true;
    } else {
      entry["standard_error"] = p.standard_error;
    }
    parameters.push_back(std::move(entry));
  }
  r.model.fit = {{"structure", r.structure_detail},
                 {"fitted_rmse_deg", r.fit.rmse_deg},
                 {"condition", r.fit.condition},
                 {"verdict", verdict_of(r.holdout.rmse_deg, r.baseline.rmse_deg)},
                 {"holdout", score::to_json(r.holdout)},
                 {"parameters", std::move(parameters)}};
}

// What was chosen, as fit and model.
void take(const Fitted& fitted, Identification& r) {
  if (fitted.chosen) {
    r.fit = fitted.candidates[*fitted.chosen].summary;
    r.structure = name(r.fit.structure.family);
    r.structure_detail = describe(r.fit.structure);
    r.model = make_model(r.fit, r);
    return;
  }
  const JointFit& fit = *fitted.by_text;
  r.structure = r.request.structure == "auto" ? "additive" : fit.text;
  r.structure_detail = fit.structure;
  r.hold_drift_deg = fit.hold_drift_deg;
  r.cross_validated_deg = fit.cross_validated_deg;
  r.fit.used_samples = fit.fitted_samples;
  r.fit.free_parameters = static_cast<int>(std::lround(fit.effective));
  r.fit.rmse_deg = fit.fitted_rmse_deg;
  r.fit.condition = fit.condition;
  r.fit.parameters = fit.parameters;
  r.model = start_model(r.structure_detail, r);
  r.model.inputs = fit.model.inputs;
  append(fit.model, r.model);
}

// Of the additive candidates that were not taken only the chosen one runs over what was held out.
void make_rows(const Fitted& fitted, const Scorer& scorer, Identification& r) {
  for (std::size_t i = 0; i < fitted.candidates.size(); ++i) {
    r.rows.push_back(make_row(fitted.candidates[i], r, scorer));
    r.rows.back().chosen = fitted.chosen == i;
  }
  if (fitted.by_text) {
    r.rows.push_back({r.structure_detail, r.fit.free_parameters, r.fit.rmse_deg, r.cross_validated_deg,
                      r.holdout, "", true});
  }
  std::ranges::stable_sort(
      r.rows, {}, [](const TableRow& row) { return std::pair(!row.refusal.empty(), row.parameters); });
}

}  // namespace

void check(const Request& request) {
  if (!is_text(request) && request.structure != "auto") {
    (void)requested_structure(request);
  } else if (request.order || request.knots || request.plays || request.dead_zone ||
             (request.monotone && request.structure != "auto")) {
    throw io::InputError(
        "--order, --knots, --plays, --dead-zone and --monotone go with linear-dynamic, hammerstein, wiener, "
        "hw and hw-hysteresis; auto "
        "chooses them itself, and a structure as text has its numbers in it");
  }
  if (is_text(request)) (void)parse_structure(request.structure, 1);
  if (!(request.split > 0 && request.split < 1)) throw io::InputError("the split must lie between 0 and 1");
  if (request.channel) (void)model::finger(*request.channel);
}

Identification identify(recording::Pair pair, const Request& request, const Progress& progress) {
  check(request);
  const std::string channel =
      request.channel ? model::finger(*request.channel) : finger_in(pair).value_or("index");
  Identification r;
  r.request = request;
  r.pair = std::move(pair);
  recording::state_unit(r.pair.sensor, r.pair.input, request.input_unit);
  r.aligned =
      recording::align_pair(r.pair, request.rate_hz, request.clock_offset_s, request.lead_s, request.split);
  const recording::Aligned& a = r.aligned;
  r.holdout_begin = a.holdout_begin;

  const Data data = fitted_data(r, channel);
  const Fitted fitted = fit_structures(r, data, progress);
  r.fit_seconds = fitted.seconds;
  take(fitted, r);
  add_poses({{data.input, data.angle_deg, data.use}}, 0, data.period_s, r.model.inputs.front());
  r.model.inputs.front().readings = readings_of({{data.input, data.angle_deg, data.use}}, 0);

  std::vector<std::uint8_t> use = data.use;
  use.resize(a.size(), 0);
  const Scorer scorer(a, r.holdout_begin);
  Plain plain = plain_estimates(a, use);
  r.static_curve = scorer.all(plain.curve);
  r.baseline = scorer.all(plain.line);
  r.baseline_deg = std::move(plain.line);
  r.estimated_deg = estimate(r.model, r);
  r.holdout = scorer.all(r.estimated_deg);
  r.holdout_without_gaps = scorer.without_gaps(r.estimated_deg);
  make_rows(fitted, scorer, r);
  document(r);
  add_warnings(r);
  if (fitted.untried > 0) r.warnings.emplace_back(kStopped);
  return r;
}

}  // namespace flexor::identify
