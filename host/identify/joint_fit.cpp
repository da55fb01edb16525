#include "host/identify/joint_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "host/identify/additive_system.hpp"
#include "host/identify/hold.hpp"
#include "host/identify/robust.hpp"
#include "host/io/io.hpp"
#include "host/model/correction.hpp"
#include "host/model/fixed_error.hpp"
#include "host/model/formats.hpp"

namespace flexor::identify {
namespace {

using io::InputError;

constexpr double kCreepPays = 0.1;  // of the error: less is not worth an angle that goes on in a hold
constexpr double kWandersAlike = 1.5;
constexpr double kShowsCreep_s = 2;  // of a hold
constexpr double kUnseenDrift = 2;   // of the still one's error, which 19 of 20 of its angles are within
constexpr double kMostCreep_deg = 10;
// What the recording shows needs no hold: a motion no slower than a third of the part, and an error that is a quarter less. Where the
// part is ten times as long and the error halves it may drift farther; a chain's pole of a tenth of the part leans on its bound.
constexpr double kMemories = 3;
constexpr double kShown = 0.75;
constexpr double kManyMemories = 10.1;
constexpr double kHalved = 0.5;
constexpr double kMuchLarger = 0.1;
constexpr double kSure =
    1.5;  // standard errors over six folds: nine of ten gains by chance are less (Student's t)
constexpr int kAttacks = 15;  // of the search for fixed point's error
constexpr int kReadings = 5000;
constexpr double kNearly = 0.5;  // what a short search finds is less than what there is
constexpr const char* kNoRoom = "with it the joints together take more than a board's room";
constexpr double kMargin = 0.96;             // deploy searches all joints together, with other readings
constexpr double kFewCounts = 64;            // readings below: a board's steps are too coarse for them
constexpr double kMostCounts = 32767. / 32;  // that a board holds
constexpr double kTwelveBits = 4095;         // of larger counts a model is one for a PC

void require_moving(const std::vector<Session>& sessions, const JointMap& joint) {
  const Stack stack(sessions);
  for (Eigen::Index s = 0; s < stack.input.cols(); ++s) {
    const Eigen::VectorXd u = stack.input(stack.used, s);
    if (!(u.maxCoeff() > u.minCoeff()))
      throw io::JobError("{}: {} never changes in the fitted part", joint.joint,
                         joint.sensors[static_cast<std::size_t>(s)]);
  }
}

std::string chain_refusal(const JointFit& chain) {
  return refusal_of(chain.model, chain.creeps ? 0 : chain.hold_drift_deg);
}

// Of counts and degrees, which a board or the twin's reads. Readings in another unit may never meet one, and where they do, deploy
// converts and judges them.
std::string imprecision_of(const model::Model& identified) {
  const model::Model model = model::folded(identified).model;
  const auto is_counted = [](const model::Input& input) {
    return (input.unit == "count" || input.unit == "deg") && model::holds_readings(input);
  };
  if (!std::ranges::all_of(model.inputs, is_counted)) return "";
  model::ErrorSearch search;
  search.attacks = kAttacks;
  search.noise = kReadings;
  const double most_deg = kMargin * model::allowed_fixed_error_deg(model.joints.front());
  double error_deg = model::worst_fixed_error_deg(model, search).front();
  if (error_deg > kNearly * most_deg && error_deg <= most_deg)
    error_deg = model::worst_fixed_error_deg(model).front();
  if (error_deg <= most_deg) return "";
  return fmt::format("in the glove's integers it is up to {:.3f} degrees off, at most {:.2f} are allowed",
                     error_deg, most_deg);
}

// "curve at 352", "play 2 at 352", "motion over 0.3 s at 352"; of several sensors with their names before.
void add_parameters(const Additive& fit, const std::vector<std::string>& sensors, Fitted& out) {
  std::vector<Eigen::Index> order;
  for (std::size_t s = 0; s < fit.knots.size(); ++s) {
    const std::string sensor = sensors.size() > 1 ? sensors[s] + " " : "";
    const auto add = [&](Eigen::Index column, const std::string& what) {
      for (Eigen::Index k = 0; k < fit.value.rows(); ++k) {
        const double knot = fit.knots[s][static_cast<std::size_t>(k)];
        const Eigen::Index at = order.emplace_back(column * fit.value.rows() + k);
        out.parameters.push_back({fmt::format("{}{} at {:.4g}", sensor, what, knot), fit.value(k, column),
                                  std::sqrt(fit.covariance(at, at))});
      }
    };
    for (std::size_t b = 0; b < fit.branches.still(); ++b)
      add(fit.still(s) + static_cast<Eigen::Index>(b), b == 0 ? "curve" : fmt::format("play {}", b));
    for (std::size_t l = 0; l < fit.branches.lags_s.size(); ++l)
      add(fit.moving(s) + static_cast<Eigen::Index>(l),
          fmt::format("motion over {:g} s", fit.branches.lags_s[l]));
  }
  out.covariance = fit.covariance(order, order);
}

JointFit taken(const Additive& fit, const Task& task) {
  JointFit out;
  out.structure = describe(fit.branches);
  out.text = text_of(fit.branches);
  out.sensors = task.joint.sensors;
  out.model = joint_model(task.inputs, fit, task.joint);
  out.hold_drift_deg = *fit.hold_drift_deg;
  static_cast<Fitted&>(out) = fit;
  out.cross_validated_deg = fit.cross_validated_deg;
  out.fold_loss = fit.plain_loss;
  out.limits = fit.branches.open ? 0 : 2;
  add_parameters(fit, out.sensors, out);
  return out;
}

// `folds`: the losses of those that were cross-validated.
CandidateRow row_of(const std::string& structure, const Fitted& fit, double cross_validated_deg,
                    std::optional<double> hold_drift_deg, const std::vector<double>& folds) {
  CandidateRow out{structure, {}, fit.fitted_rmse_deg, fit.effective, hold_drift_deg, "", false};
  if (folds.empty()) return out;
  const Eigen::Map<const Eigen::ArrayXd> loss(folds.data(), std::ssize(folds));
  const auto n = static_cast<double>(loss.size());
  out.cross_validated_deg = cross_validated_deg;
  out.fold_loss = loss.mean();
  out.fold_loss_se = std::sqrt((loss - loss.mean()).square().sum() / (n - 1) / n);
  return out;
}

// Why a row that looks better than the chosen one was passed over, where nothing says so yet.
void explain(const std::vector<CandidateRow>& rows, CandidateRow& row, const std::string& why) {
  const auto chosen = std::ranges::find(rows, true, &CandidateRow::chosen);
  if (chosen == rows.end() || row.chosen || !row.refusal.empty()) return;
  if (row.cross_validated_deg < chosen->cross_validated_deg || row.fold_loss < chosen->fold_loss)
    row.refusal = why;
}

// The best sum that holds still while its readings do, and those that creep back after their sensor, with their rows.
using Creeping = std::vector<std::pair<std::size_t, JointFit>>;
struct SumFit {
  JointFit still;
  Creeping creeping;
};

SumFit fit_sum(const Candidates& candidates, const Task& task) {
  std::optional<Additive> best;
  std::vector<std::string> refusals;
  std::size_t at = 0;  // of the rows
  const auto drift = [&](const Additive& fit) {
    return hold_drift_deg(joint_model(task.inputs, fit, task.joint), task.sessions, task.joint.sensors);
  };
  std::vector<std::pair<std::size_t, Additive>> creeping;  // and their rows
  // The best that can be worn, unless one is precise as well. What creeps is compared with it afterwards.
  const auto accept = [&](const Additive& fit) {
    const model::Model model = joint_model(task.inputs, fit, task.joint);
    const bool creeps = identify::creeps(fit.branches);
    refusals.push_back(refusal_of(model, creeps ? 0 : *fit.hold_drift_deg));
    if (refusals.back().empty() && !task.fits(model)) refusals.back() = kNoRoom;
    const bool worn = refusals.back().empty();
    if (worn) refusals.back() = imprecision_of(model);
    const bool precise = refusals.back().empty();
    if (creeps && candidates.branches.size() > 1) {
      if (precise) creeping.emplace_back(refusals.size() - 1, fit);
      return false;
    }
    if (worn && (precise || !best)) {
      best = fit;
      at = refusals.size() - 1;
    }
    return precise;
  };
  std::size_t untried = 0;
  const auto counted = [&](std::size_t done, std::size_t of, const std::string& what) {
    if (!task.step || task.step(done, of, what)) return true;
    untried = of - std::max<std::size_t>(done, 1);
    return false;
  };
  require_moving(task.sessions, task.joint);
  const std::vector<Additive> all = fit_additive(task.sessions, task.inputs.sample_period_s, task.joint.joint,
                                                 candidates, drift, accept, counted);
  if (!best) throw io::JobError("{}: {}", task.joint.joint, refusals.front());
  SumFit sum{taken(*best, task), {}};
  for (const auto& [row, fit] : creeping) sum.creeping.emplace_back(row, taken(fit, task));
  JointFit& out = sum.still;
  out.untried = untried;
  for (const Additive& one : all) {
    out.rows.push_back(
        row_of(describe(one.branches), one, one.cross_validated_deg, one.hold_drift_deg, one.plain_loss));
    const std::size_t k = out.rows.size() - 1;
    if (k < refusals.size()) out.rows.back().refusal = refusals[k];
    out.rows.back().chosen = k == at;
  }
  const auto donned_loss = [&](std::size_t k) { return mean(all[k].fold_loss); };
  for (std::size_t k = 0; k < all.size(); ++k)
    explain(out.rows, out.rows[k],
            mean(all[k].plain_loss) > mean(all[at].plain_loss) ? "its loss over the folds is larger"
            : donned_loss(k) > donned_loss(at)                 ? "put on a little otherwise it errs more"
                                                               : "larger, for too small a gain");
  return sum;
}

void choose(JointFit one, std::size_t row, const std::string& why, JointFit& best) {
  one.rows = std::move(best.rows);
  one.untried = best.untried;
  one.baseline_models = std::move(best.baseline_models);
  for (CandidateRow& of : one.rows) of.chosen = &of == &one.rows[row];
  for (CandidateRow& of : one.rows) explain(one.rows, of, why);
  best = std::move(one);
}

// What creeps back after its sensor beside the best of all that hold still, and beside the sum that a smaller chain took the place
// of: of those that pay the best.
void let_creeping_compete(Creeping& creeping, const std::vector<Session>& sessions, const JointFit& sum,
                          JointFit& best) {
  JointFit* chosen = nullptr;
  std::size_t chosen_row = 0;
  for (auto& [row, one] : creeping) {
    std::string& refusal = best.rows[row].refusal;
    refusal = creep_refusal(one, best, sessions);
    if (refusal.empty()) refusal = creep_refusal(one, sum, sessions);
    if (!refusal.empty() || (chosen != nullptr && mean(one.fold_loss) >= mean(chosen->fold_loss))) continue;
    chosen = &one;
    chosen_row = row;
  }
  if (chosen != nullptr) choose(std::move(*chosen), chosen_row, "holds still where the sensor creeps", best);
}

// Why this chain is not taken in place of `best`; empty: it is.
std::string chain_refusal(const JointFit& chain, const JointFit& best) {
  if (chain.fold_loss.size() != best.fold_loss.size()) {  // not validated, or not over the same
    return fmt::format(
        "it fits the part by {:.2f} degrees; the best so far errs by {:.2f} on what it did not see",
        chain.fitted_rmse_deg, best.cross_validated_deg);
  }
  // Within a standard error the smaller wins, unless its squares over the folds are larger by far.
  const bool smaller = chain.effective + chain.limits < best.effective + best.limits;
  const double most_deg = (smaller ? 1 + kMuchLarger : 1) * best.cross_validated_deg;
  if (!(gain_in_errors(chain.fold_loss, best.fold_loss) > (smaller ? -1 : 1)))
    return smaller ? "its loss over the folds is larger"
                   : "no better than the best by more than a standard error";
  if (!(chain.cross_validated_deg <= most_deg)) return "errs more than the best";
  const std::string out = chain_refusal(chain);
  return out.empty() ? imprecision_of(chain.model) : out;
}

// Chains beside the best sum, over the same folds.
void let_chains_compete(const Task& task, JointFit& best, Creeping& creeping) {
  constexpr std::array<std::string_view, 9> kChains = {"line",
                                                       kPublishedForm,
                                                       "linear-dynamic",
                                                       "wiener",
                                                       "hammerstein",
                                                       "hw",
                                                       "hysteresis-hw",
                                                       "curve > pair > saturation",
                                                       "curve > pair > curve"};
  for (std::size_t k = 0; k < kChains.size(); ++k) {
    if (task.step && !task.step(k, kChains.size(), fmt::format("{}: {}", task.joint.joint, kChains[k]))) {
      best.untried += kChains.size() - k;
      return;
    }
    const auto chain = std::get<Chain>(parse_structure(kChains[k], 1));
    // What anybody would take first is validated however badly it fits.
    const bool is_baseline = kChains[k] == "line" || kChains[k] == kPublishedForm;
    try {
      JointFit one = fit_chain(chain, {task.sessions, task.inputs, task.joint}, {},
                               is_baseline ? HUGE_VAL : (1 + kMuchLarger) * best.cross_validated_deg);
      if (is_baseline) best.baseline_models.emplace(kChains[k], one.model);
      CandidateRow& row = best.rows.emplace_back(one.row());
      row.refusal = chain_refusal(one, best);
      if (row.refusal.empty() && !task.fits(one.model)) row.refusal = kNoRoom;
      row.chosen = false;
      if (row.refusal.empty() && one.creeps) {
        creeping.emplace_back(best.rows.size() - 1, std::move(one));
      } else if (row.refusal.empty()) {
        choose(std::move(one), best.rows.size() - 1, "larger, or no better by a standard error", best);
      }
    } catch (const io::JobError& error) {  // too few samples for it
      best.rows.push_back({text_of(chain), std::nullopt, std::nan(""), 0, std::nullopt, error.what()});
    }
  }
}

// One reading, mixed or the own one, where it is as good as several and holds as still, with the rows of both; of fits as good the
// smaller.
JointFit better(JointFit several, JointFit one, const std::string& name) {
  const double tie = one.effective <= several.effective ? kAsGood : 0;
  const auto chosen = std::ranges::find(one.rows, true, &CandidateRow::chosen);
  const bool fewer = mean(one.fold_loss) <= (1 + tie) * (1 + tie) * mean(several.fold_loss) &&
                     one.hold_drift_deg <= std::max(kMostDrift_deg, several.hold_drift_deg) &&
                     chosen->refusal.empty();
  for (CandidateRow& row : one.rows) row.structure = name + ": " + row.structure;
  JointFit& other = fewer ? several : one;
  for (CandidateRow& row : other.rows) row.chosen = false;
  JointFit out = fewer ? std::move(one) : std::move(several);
  for (CandidateRow& row : other.rows) {
    explain(out.rows, row, fewer ? name + " is as good" : "its loss over the folds is larger");
    out.rows.push_back(row);
  }
  out.untried += other.untried;
  out.baseline_models.clear();  // of one sensor
  return out;
}

JointFit fit_one_chain(const Chain& chain, const Task& task, const std::optional<Initial>& initial) {
  JointFit out = fit_chain(chain, task, initial);
  if (const std::string refusal = chain_refusal(out); !refusal.empty())
    throw io::JobError("{}: {} cannot be worn: {}; try fewer poles, or a sum of curves", task.joint.joint,
                       text_of(chain), refusal);
  out.rows = {out.row()};
  out.rows.front().refusal = imprecision_of(out.model);
  return out;
}

// All sensors' readings in one, whose weights are fitted first, about where the own one is.
struct Mix {
  explicit Mix(const Task& task)
      : joint(task.joint),
        model(own_inputs(task.inputs, joint)),
        one(model),
        map{joint.joint, {joint.joint + " mix"}, joint.reference},
        sessions(task.sessions) {
    const Stack stack(sessions);
    Eigen::VectorXd weight = mix_of(stack, model.sample_period_s);
    std::ranges::sort(model.inputs, {}, [&](const model::Input& input) {
      return std::ranges::find(joint.sensors, input.name);
    });
    std::vector<model::Interval> readings;
    for (model::Input& input : model.inputs) {
      gains.push_back(scale_to_counts(input));
      readings.push_back({input.valid_min, input.valid_max});
    }
    require_moving(sessions, joint);
    weight *= gains.front();
    const Eigen::MatrixXd used = stack.input(stack.used, Eigen::all);
    sum.offset = (gains.front() * used.col(0) - used * weight).mean();
    for (std::size_t s = 0; s < gains.size(); ++s)
      sum.weights.push_back(weight(static_cast<Eigen::Index>(s)) / gains[s]);
    const auto [least, most] =
        model::meet(sum.values(readings, model.sample_period_s), {-kMostCounts, kMostCounts});
    one.inputs = {model.inputs.front()};
    one.inputs.front().name = map.sensors.front();
    one.inputs.front().valid_min = least;
    one.inputs.front().valid_max = most;
    for (Session& session : sessions)
      session.input = ((session.input * weight).array() + sum.offset).matrix().eval();
  }

  // Behind the sensors what was fitted behind their mix.
  model::Model whole(const model::Model& fitted) const {
    model::Model out = model;
    out.blocks = {{joint.sensors, map.sensors.front(), sum}};
    append(fitted, out);
    for (std::size_t s = 0; s < gains.size(); ++s)
      if (gains[s] != 1) out = model::corrected(std::move(out), s, {gains[s], 0});
    return out;
  }

  const JointMap& joint;
  model::Model model;  // of the sensors, the own one first
  model::Model one;    // of their mix
  JointMap map;
  std::vector<double> gains;
  model::Sum sum;
  std::vector<Session> sessions;
};

// Then the structure as of one sensor.
JointFit fit_mixed(const Task& task, const std::string& structure, const std::optional<Initial>& initial) {
  const std::vector<std::string>& sensors = task.joint.sensors;
  const Mix mix(task);
  JointFit out =
      fit_joint({mix.sessions, mix.one, mix.map, task.step, task.room, task.most}, structure, initial);
  out.model = mix.whole(out.model);
  out.sensors = sensors;
  out.structure = "mixed: " + out.structure;
  out.text = "mix > " + out.text;
  out.baseline_models.clear();  // of the mix
  out.effective += static_cast<double>(sensors.size() - 1);
  for (std::size_t s = 0; s < sensors.size(); ++s)
    out.parameters.push_back(
        {"weight of " + sensors[s], mix.sum.weights[s] * mix.gains[s] / mix.gains[0], 0, true});
  const auto all = std::ssize(out.parameters);
  out.covariance.conservativeResizeLike(Eigen::MatrixXd::Zero(all, all));
  CandidateRow& row = *std::ranges::find(out.rows, true, &CandidateRow::chosen);
  row.parameters = out.effective;
  row.refusal = refusal_of(out.model);
  if (row.refusal.empty()) row.refusal = imprecision_of(out.model);
  return out;
}

}  // namespace

std::string creep_refusal(const JointFit& one, const JointFit& still, const std::vector<Session>& sessions) {
  const double wander = wander_deg(one.model, sessions, one.sensors);
  const double most_deg =
      kWandersAlike * std::max(wander_deg(still.model, sessions, still.sensors), kMostDrift_deg);
  if (wander > most_deg)
    return fmt::format(
        "while the finger holds still its error wanders by {0:.{2}f} degrees, at most {1:.{2}f} are allowed",
        wander, most_deg, std::clamp(1 - static_cast<int>(std::floor(std::log10(wander - most_deg))), 1, 9));
  Eigen::Index longest = 0;
  Eigen::Index rows = 0;
  for (const Session& session : sessions) {
    rows += session.angle_deg.size();
    for (const StillPart& held : holds_of(session, one.model.sample_period_s))
      longest = std::max(longest, held.to - held.from);
  }
  const double period_s = one.model.sample_period_s;
  const double memories = static_cast<double>(rows) * period_s / slowest_s(one.model);
  const double left = one.cross_validated_deg / still.cross_validated_deg;
  const bool is_certain = memories >= kManyMemories && left <= kHalved;
  const bool is_shown =
      static_cast<double>(longest) * period_s >= kShowsCreep_s || (memories >= kMemories && left <= kShown);
  const double most_drift_deg =
      std::min(is_shown ? HUGE_VAL : kUnseenDrift * still.cross_validated_deg, kMostCreep_deg);
  if (!is_certain && one.hold_drift_deg > most_drift_deg)
    return fmt::format(
        "held still, its angle drifts by {:.1f} degrees within a minute, {}", one.hold_drift_deg,
        is_shown ? "and its error is not halved" : "and the recording has no hold that shows it");
  const bool pays = one.cross_validated_deg <= (1 - kCreepPays) * still.cross_validated_deg;
  if (pays && gain_in_errors(one.fold_loss, still.fold_loss) > kSure) return "";
  return fmt::format("held still, its angle drifts by {:.1f} degrees within a minute, for too small a gain",
                     one.hold_drift_deg);
}

CandidateRow JointFit::row() const {
  CandidateRow out = row_of(structure, *this, cross_validated_deg, hold_drift_deg, fold_loss);
  out.chosen = true;
  return out;
}

std::string refusal_of(const model::Model& model, double drift_deg) {
  if (drift_deg > kMostDrift_deg)
    return fmt::format("held still, its angle drifts by {:.1f} degrees within a minute", drift_deg);
  const model::Model board = model::folded(model).model;
  if (!std::ranges::all_of(board.inputs, model::holds_readings)) return "";
  try {
    model::check_fixed(board);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

double scale_to_counts(model::Input& input, double share) {
  const double most = std::max(std::abs(input.valid_min), std::abs(input.valid_max));
  const bool counts = input.unit == "count";
  const bool is_held = !(most > 0) || (most >= (counts ? 0 : kFewCounts) && most <= kMostCounts) ||
                       (counts && most > kTwelveBits);
  const double gain = share * (is_held ? 1 : std::exp2(std::floor(std::log2(kMostCounts / most))));
  if (!counts) {
    input.valid_min *= gain;
    input.valid_max *= gain;
  }
  return gain;
}

model::Model own_inputs(model::Model inputs, const JointMap& joint) {
  std::erase_if(inputs.inputs, [&](const model::Input& input) {
    return std::ranges::find(joint.sensors, input.name) == joint.sensors.end();
  });
  return inputs;
}

model::Model joint_model(const model::Model& inputs, const Additive& fit, const JointMap& joint) {
  model::Model own = own_inputs(inputs, joint);
  Additive board = fit;
  std::vector<double> gains;
  for (model::Input& input : own.inputs) {
    const double gain = scale_to_counts(input);
    gains.push_back(gain);
    const auto s =
        static_cast<std::size_t>(std::ranges::find(joint.sensors, input.name) - joint.sensors.begin());
    for (double& knot : board.knots[s]) knot *= gain;
    for (double& radius : board.radii[s]) radius *= gain;
  }
  add_to(own, board, joint.sensors, joint.joint);
  for (std::size_t i = 0; i < gains.size(); ++i)
    if (gains[i] != 1) own = model::corrected(std::move(own), i, {gains[i], 0});
  return own;
}

void append(const model::Model& one, model::Model& model) {
  for (const model::Block& block : one.blocks)
    if (std::ranges::find(model.blocks, block.to, &model::Block::to) == model.blocks.end())
      model.blocks.push_back(block);
  model.joints.insert(model.joints.end(), one.joints.begin(), one.joints.end());
}

// A chain of several sensors stands behind their mix.
JointFit fit_baseline(const Task& task, const std::string& structure) {
  const WantedStructure wanted = parse_structure(structure, task.joint.sensors.size());
  const auto* chain = std::get_if<Chain>(&wanted);
  if (chain == nullptr) return fit_joint(task, structure);
  if (task.joint.sensors.size() == 1) return fit_chain(*chain, task);
  const Mix mix(task);
  JointFit out = fit_chain(*chain, {mix.sessions, mix.one, mix.map});
  out.model = mix.whole(out.model);
  return out;
}

JointFit fit_joint(const Task& task, const std::string& structure, const std::optional<Initial>& initial) {
  const JointMap& joint = task.joint;
  const WantedStructure wanted = parse_structure(structure, joint.sensors.size());
  const auto rest = behind_mix(structure);
  const auto* chain = std::get_if<Chain>(&wanted);
  if (joint.sensors.size() > 1 && (rest || chain != nullptr))
    return fit_mixed(task, std::string(rest.value_or(structure)), initial);
  if (chain != nullptr) return fit_one_chain(*chain, task, initial);
  if (initial)
    throw InputError(
        "{}: initial values are a chain's, a sum of curves has one best fit: --structure "
        "with a chain, as the initial model's",
        joint.joint);
  Candidates candidates = std::get<Candidates>(wanted);
  std::erase_if(candidates.branches, [&](const Branches& b) {
    return joint.sensors.size() * (b.still() + b.lags_s.size()) > model::kMaxTerms;
  });
  if (candidates.branches.empty())
    throw InputError("{}: {} of {} sensors has more than the {} curves and motions that a model holds",
                     joint.joint, structure, joint.sensors.size(), model::kMaxTerms);
  SumFit sum = fit_sum(candidates, task);
  JointFit out = sum.still;
  const bool has_chains = structure == "auto" && joint.sensors.size() == 1;
  if (has_chains) let_chains_compete(task, out, sum.creeping);
  let_creeping_compete(sum.creeping, task.sessions, sum.still, out);
  if (structure != "auto" || has_chains) return out;
  std::vector<Session> own = task.sessions;
  for (Session& session : own) session.input = session.input.leftCols(1).eval();
  const JointMap alone{joint.joint, {joint.sensors.front()}, joint.reference};
  out = better(std::move(out), fit_mixed(task, structure, {}), "mixed");
  return better(std::move(out),
                fit_joint({own, task.inputs, alone, task.step, task.room, task.most}, structure),
                joint.sensors.front() + " alone");
}

}  // namespace flexor::identify
