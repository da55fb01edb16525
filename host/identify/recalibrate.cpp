#include "host/identify/recalibrate.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "host/identify/line_estimate.hpp"
#include "host/identify/robust.hpp"
#include "host/io/io.hpp"
#include "host/io/json.hpp"

namespace flexor::identify {
namespace {

constexpr int kWholeCycle = 3;         // turns
constexpr double kThereAndBack = 0.7;  // of the span, both ways: one turn is enough
constexpr double kTurn_deg = 30;
constexpr double kMoves_deg = 10;
constexpr double kMostTurn = 0.5;      // of the span, where the joint moves little
constexpr double kLeastCovered = 0.6;  // of the span
constexpr double kMostCovered = 1.7;
constexpr double kNotOpened = 0.1;  // of the span: how far from it an open hand may turn
constexpr double kFistStayed = 0.04;
constexpr double kStandsStill = 0.01;
constexpr double kSlipped = 0.3;
constexpr double kSignificant = 0.7;  // standard errors
constexpr double kSureErrors = 1.3;   // standard errors
constexpr double kFarthest = 3;       // of the prior's standard deviations
constexpr std::size_t kLeastReadings = 20;
constexpr const char* kTellsGain =
    "a camera (--pair) would tell it";  // poses: as well as they are held alike

constexpr const char* kPriorSchema = "flexor-donning-prior";
constexpr int kPriorVersion = 1;
constexpr std::pair<const char*, double Prior::*> kDeviations[] = {{"shift_sd", &Prior::shift_sd},
                                                                   {"log_gain_sd", &Prior::log_gain_sd},
                                                                   {"motion_sd", &Prior::motion_sd},
                                                                   {"reach_sd", &Prior::reach_sd},
                                                                   {"density_sd", &Prior::density_sd}};
constexpr double kLeastSd = 1e-4;
constexpr double kMostSd = 10;

double pooled(double general, double own, int recordings) {
  const double freedom = recordings - 1;
  return std::sqrt((kGeneralWeight * general * general + freedom * own * own) / (kGeneralWeight + freedom));
}

std::string moves_too_far(const std::string& name, double times) {
  return fmt::format(
      "{}: it moves {:.1f} times as far as where the model was made: another sensor or hand, or another "
      "unit?",
      name, times);
}

std::string stands_still(const std::string& name, double at) {
  return fmt::format("{}: it stands still at {:.4g}: is it plugged in, is it whole, was it bent?", name, at);
}

// What is wrong with one sensor by one log, or wanted of it; neither: the log tells it.
struct Verdict {
  std::string misfit;
  std::string wanted;
  bool tells() const { return misfit.empty() && wanted.empty(); }
};

// From then on all inputs of the model say what they read.
std::vector<Case> cases_of(model::Model& model, const Prior& prior) {
  std::vector<Case> out;
  for (model::Input& input : model.inputs) {
    if (!input.readings && !input.poses)
      throw io::InputError(
          "{}: the model does not say what this sensor read where it was made: identify it again "
          "with this version",
          input.name);
    if (!input.readings) input.readings = spread_of(*input.poses);
  }
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    const model::Input& input = model.inputs[i];
    Case& one = out.emplace_back();
    one.name = input.name;
    one.prior = prior_of(input, prior);
    one.made = *input.readings;
    one.poses = input.poses;
    one.reach = reach_of(model, i);
    one.turn = one.made.span() * std::min(kMostTurn, kTurn_deg / std::abs(one.reach.most_deg));
  }
  return out;
}

Verdict judge(const Case& one, const Window& window, std::span<const double> readings) {
  const double covered = window.span() / one.made.span();
  Verdict out;
  if (window.turns.count >= kWholeCycle || window.turns.there_and_back >= kThereAndBack * one.made.span()) {
    if (covered < kLeastCovered)
      out.wanted = fmt::format("{}: bend it from one end to the other: {:.0f} % of its range was seen",
                               one.name, 100 * covered);
    if (covered > kMostCovered) out.misfit = moves_too_far(one.name, covered);
    return out;
  }
  const double little = std::max(one.turn / 5, kStandsStill * one.made.span());
  if (covered < kStandsStill) {
    out.misfit = stands_still(one.name, window.middle());
  } else if (covered < kSlipped && turns_of(readings, little).count >= 2 * kWholeCycle) {
    out.misfit = fmt::format(
        "{}: it moves between {:.4g} and {:.4g} only, {:.0f} % of what it did: has it slipped or "
        "broken?",
        one.name, window.reading.front(), window.reading.back(), 100 * covered);
  }
  out.wanted = fmt::format("{}: open and close it once more: {} of {} turns of {:g} degrees were seen",
                           one.name, window.turns.count, kWholeCycle, kTurn_deg);
  return out;
}

// Each log by itself; the one that shows most gives what is wrong or wanted, unless one determines a line.
void check_motion_of(const RecalibrationRequest& request, std::size_t i, Case& one) {
  const model::Input& input = request.model.inputs[i];
  for (const Motion& motion : request.motion) {
    const std::vector<double>& readings = motion.reading[i];
    auto& kept = one.windows.emplace_back();
    if (readings.size() < kLeastReadings) continue;
    Window window = {spread_of(readings, one.made.share), turns_of(readings, one.turn)};
    const Verdict verdict = judge(one, window, readings);
    if (verdict.tells()) kept = window;
    const std::pair most(verdict.tells(), window.span());
    if (one.shown && most <= std::pair(one.informed, one.shown->span())) continue;
    one.informed = verdict.tells();
    one.misfit = verdict.misfit;
    one.wanted = verdict.wanted;
    one.shown = std::move(window);
  }
  if (one.shown || request.motion.empty()) return;
  one.misfit = fmt::format("{}: hardly any reading of it is valid: is it plugged in?", input.name);
  one.wanted = fmt::format("{}: readings within {:g} and {:g}", input.name, input.valid_min, input.valid_max);
}

// The fist is where it was, the open hand is not: of one sensor a donning may do that, of all of them it is the hand.
bool is_not_opened(const Window& window, const Case& one) {
  double open = (window.reading.front() - one.made.reading.front()) / one.made.span();
  double fist = (one.made.reading.back() - window.reading.back()) / one.made.span();
  if (one.reach.most_deg < 0) std::swap(open, fist);
  return open > kNotOpened && std::abs(fist) < kFistStayed;
}

// A log in which the hand was never opened tells no sensor.
void check_open_hand(std::size_t log, std::vector<Case>& cases) {
  std::vector<Case*> telling;
  for (Case& one : cases)
    if (one.windows[log]) telling.push_back(&one);
  const auto is_closed = [&](const Case* one) { return is_not_opened(*one->windows[log], *one); };
  if (telling.size() < 2 || !std::ranges::all_of(telling, is_closed)) return;
  for (Case* one : telling) {
    one->windows[log].reset();
    one->wanted = fmt::format(
        "{}: open the hand wholly: each finger closes to where it did and none opens to where it did",
        one->name);
  }
}

void check_motion(const RecalibrationRequest& request, std::vector<Case>& cases) {
  for (std::size_t i = 0; i < cases.size(); ++i) check_motion_of(request, i, cases[i]);
  for (std::size_t log = 0; log < request.motion.size(); ++log) check_open_hand(log, cases);
  for (Case& one : cases)
    one.informed = std::ranges::any_of(one.windows, [](const auto& w) { return w.has_value(); });
}

bool significant(const Case& one) {
  if (std::abs(one.fit.line.shift) > kSignificant * std::sqrt(one.fit.shift_variance)) return true;
  return one.fit.gain_is_determined &&
         std::abs(one.fit.line.log_gain) > kSignificant * std::sqrt(one.fit.log_gain_variance);
}

// What a stretch of motion alone says where the hand reached as far as it did where the model was made: the sensor has the
// gain. The estimate holds a hand that reached less far for likelier; motion cannot distinguish the two. None: it is determined.
std::optional<Line> other_line(const RecalibrationRequest& request, const Case& one) {
  if (one.held.both() || request.seen || one.fit.gain_is_determined || !one.informed || !one.shown) return {};
  const double gain = one.made.span() / one.shown->span();
  return Line{gain * (one.made.middle() - one.shown->middle()) / one.made.span(), std::log(gain)};
}

// In spans, of a reading so far from the middle.
double moved_by(const Line& line, double place) { return line.shift + place * std::expm1(line.log_gain); }

// Mean square of what one line makes of readings against what the other does, in spans.
double distance2(const Line& a, const Line& b) {
  return std::pow(a.shift - b.shift, 2) + std::pow(std::exp(a.log_gain) - std::exp(b.log_gain), 2) / 12;
}

// The old angles are right to a thirtieth of the range, by the estimate's error and by the other explanation.
bool is_known_unchanged(const Case& one) {
  constexpr double kSame = 1.0 / 30;
  const double left2 = one.fit.shift_variance + one.fit.log_gain_variance / 12 + distance2(one.fit.line, {});
  return std::max(left2, one.other ? distance2({}, *one.other) : 0) < kSame * kSame;
}

// By how many standard errors the mean square of the angles becomes smaller by what was found of some sensors, m, with the
// covariance C that is left: the true lines x are nearer to m than to none where 2 m'Wx > m'Wm, of which the left side is
// normal with mean 2 m'Wm and variance 4 m'WCWm. W weighs shift and gain by what they move the angles.
double surely_better(const std::vector<Case>& cases, const std::vector<std::size_t>& found,
                     const Eigen::MatrixXd& covariance) {
  Eigen::VectorXd weighed = Eigen::VectorXd::Zero(covariance.rows());
  double square = 0;
  for (const std::size_t i : found) {
    const Case& one = cases[i];
    double weight = 0;
    for (const double range_deg : one.reach.range_deg) weight += range_deg * range_deg;
    const Eigen::Index at = column(i);
    weighed(at) = weight * one.fit.line.shift;
    weighed(at + 1) = weight * one.fit.line.log_gain / 12;  // the variance of places in a span
    square += weighed(at) * one.fit.line.shift + weighed(at + 1) * one.fit.line.log_gain;
  }
  const double variance = weighed.dot(covariance * weighed);
  return variance > 0 ? square / 2 / std::sqrt(variance) : 0;
}

// A wearer holds poses as well as he does; motion says by itself how well it repeats. Of what poses alone tell the surest are
// corrected, as many as are more than chance together: one that tells little takes nothing from the others. True: some is chance.
bool keep_what_may_be_chance(const Eigen::MatrixXd& covariance, std::vector<Case>& cases) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < cases.size(); ++i)
    if (cases[i].by_poses && cases[i].kept.empty()) found.push_back(i);
  const std::size_t all = found.size();
  std::ranges::sort(found, std::greater(),
                    [&](std::size_t i) { return surely_better(cases, {i}, covariance); });
  while (!found.empty() && surely_better(cases, found, covariance) <= kSureErrors) {
    Case& one = cases[found.back()];
    one.kept = fmt::format("{}: what was found may be chance: the old calibration is kept", one.name);
    found.pop_back();
  }
  return found.size() < all;
}

// Why a sensor stays as it is; empty: it is corrected.
std::string reason_to_keep(Case& one) {
  const std::string& name = one.name;
  if (!one.misfit.empty()) return one.misfit;
  if (!one.informed && !one.wanted.empty()) return one.wanted;
  if (!one.informed) return fmt::format("{}: nothing that was given tells it", name);
  if (!significant(one)) {
    if (is_known_unchanged(one)) return fmt::format("{}: it reads as it did where the model was made", name);
    return fmt::format("{}: no change was found that is larger than {:g} of its standard errors{}", name,
                       kSignificant,
                       one.other ? "; its gain is not determined: " + std::string(kTellsGain) : "");
  }
  constexpr double kClearly = 0.5;  // the other explanation is itself known from one stretch alone
  if (one.other && distance2(one.fit.line, *one.other) > kClearly * distance2({}, *one.other)) {
    one.wanted = fmt::format("{}: {}", name, kTellsGain);
    return fmt::format(
        "{}: motion alone does not tell a sensor of another gain from a hand that reached less far: {}", name,
        kTellsGain);
  }
  return {};
}

// What a joint's angles change by, and the standard error that is left, over the parts of each sensor's spread.
std::vector<RecalibratedJoint> joints_of(const model::Model& old, const std::vector<Case>& cases) {
  std::vector<RecalibratedJoint> out(old.joints.size());
  for (std::size_t j = 0; j < out.size(); ++j) {
    out[j].name = old.joints[j].name;
    double square = 0;
    double change_square = 0;
    for (std::size_t i = 0; i < cases.size(); ++i) {
      const Case& one = cases[i];
      const Line taken = one.applied ? one.fit.line : Line{};  // the other is still there
      const std::vector<double>& slopes = one.reach.slopes[j];
      const auto parts = static_cast<double>(slopes.size());
      for (std::size_t k = 0; k < slopes.size(); ++k) {
        const double place = (static_cast<double>(k) + 0.5) / parts - 0.5;
        const double slope = slopes[k] * one.made.span();
        const double variance = one.fit.shift_variance + 2 * place * one.fit.covariance +
                                place * place * one.fit.log_gain_variance;
        const double change = moved_by(taken, place);
        const double left = moved_by(one.fit.line, place) - change;
        const double off = one.other ? moved_by(*one.other, place) - change : 0;
        square += slope * slope * std::max(variance + left * left, off * off) / parts;
        const double change_deg = slope * change;
        out[j].change_deg += change_deg / parts;
        change_square += change_deg * change_deg / parts;
      }
    }
    out[j].se_deg = std::sqrt(square);
    out[j].change_rms_deg = std::sqrt(change_square);
  }
  return out;
}

// Poses that most sensors read the other way round were swapped.
bool turn_round(std::vector<Case>& cases) {
  int turned = 0;
  for (const Case& one : cases) turned += one.held.share < -kUnmoved ? 1 : one.held.share > 0 ? -1 : 0;
  if (turned <= 0) return false;
  for (Case& one : cases) one.held = {one.held.fist, one.held.open, -one.held.share};
  return true;
}

// A sensor that no donning explains, where most others moved from pose to pose.
std::string misfit_of(const Case& one) {
  const PosesHeld& held = one.held;
  if (std::isnan(held.open) && std::isnan(held.fist))
    return fmt::format("{}: no reading of it is valid in the poses: is it plugged in?", one.name);
  if (!held.both() || (held.share >= kUnmoved && held.share <= kMostCovered)) return {};
  if (held.share > kMostCovered) return moves_too_far(one.name, held.share);
  if (held.share < -kUnmoved)
    return fmt::format("{}: it moves the other way than where the model was made: is it turned?", one.name);
  return stands_still(one.name, held.open);
}

// Where no more than half of the sensors moved from one pose to the other, nothing: these were not the poses.
void check_poses(const Held& held, std::vector<Case>& cases, Recalibration& out) {
  const auto reading = [](const std::vector<double>& of) { return of.empty() ? std::nan("") : mean(of); };
  for (std::size_t i = 0; i < cases.size(); ++i) {
    Case& one = cases[i];
    if (!one.poses) continue;
    one.held.open = reading(readings_in(held.open, i));
    one.held.fist = reading(readings_in(held.fist, i));
    one.held.share = (one.held.fist - one.held.open) / (one.poses->fist - one.poses->open);
  }
  if (turn_round(cases)) out.notes.emplace_back("open hand and fist were held the other way round: taken so");
  const auto live = std::ranges::count_if(cases, [](const Case& one) { return one.held.both(); });
  const auto moved = std::ranges::count_if(cases, [](const Case& one) { return one.held.moved(); });
  const bool are_poses = live == 0 || 2 * moved > live;
  if (!are_poses)
    out.wanted.push_back(fmt::format(
        "open hand and fist with all fingers: {} of {} sensors moved from one to the other", moved, live));
  for (Case& one : cases) {
    std::string misfit = one.poses && are_poses ? misfit_of(one) : "";
    const bool counts = one.poses && are_poses && misfit.empty();
    if (counts && !one.informed) {
      one.by_poses = one.informed = true;
      if (one.held.both()) one.misfit.clear();  // it moved from one to the other
    } else if (!one.poses && !one.informed) {
      one.wanted =
          fmt::format("{}: motion or a camera: the model does not say what it reads at the poses", one.name);
    } else if (!misfit.empty() && one.informed) {
      out.notes.push_back(std::move(misfit));  // motion tells it all the same
    } else if (!misfit.empty()) {
      one.misfit = std::move(misfit);
    }
    if (!counts) one.held = {};
  }
}

// The sensors of a joint that the camera saw move are judged by it.
void check_seen(const model::Model& model, const Seen& seen, std::vector<Case>& cases) {
  const model::Graph graph(model);
  for (const Seen::Angles& one : seen.joints) {
    double low = HUGE_VAL;
    double high = -HUGE_VAL;
    for (std::size_t k = 0; k < one.use.size(); ++k) {
      if (one.use[k] == 0) continue;
      low = std::min(low, one.angle_deg[k]);
      high = std::max(high, one.angle_deg[k]);
    }
    if (high - low < kMoves_deg) continue;
    for (const std::size_t sensor : graph.inputs[graph.joint[one.joint]]) {
      cases[sensor].informed = true;
      cases[sensor].by_poses = false;
    }
  }
}

void decide(const RecalibrationRequest& request, Case& one) {
  one.shift_se = std::sqrt(one.fit.shift_variance) * one.made.span();
  one.gain_se = std::sqrt(one.fit.log_gain_variance) * std::exp(one.fit.line.log_gain);
  if (one.shown) one.reversals = one.shown->turns.count;
  if (one.shown) one.covered = one.shown->span() / one.made.span();
  // Poses that changed nothing may yet have been held otherwise: then the gain is as uncertain as they are.
  const bool is_doubted =
      !request.held.empty() && !request.seen && !one.kept.empty() && !is_known_unchanged(one);
  one.gain_is_known = !is_doubted && !one.other;
  one.applied = one.kept.empty();
  if (one.applied) one.correction = correction_of(one.fit.line, one.made);
}

// A camera whose angles are others than the model's: no line of a sensor explains them.
void check_camera(const model::Model& model, const Seen& seen, const std::vector<Case>& cases,
                  std::vector<std::string>& notes) {
  constexpr double kAgainst = -0.5;
  constexpr double kFar = 1.5;
  const std::vector<SeenFit> fits = fits_of(model, seen, cases);
  for (std::size_t s = 0; s < fits.size(); ++s) {
    const SeenFit& fit = fits[s];
    const std::string& joint = model.joints[seen.joints[s].joint].name;
    if (fit.alike < kAgainst)
      throw io::InputError(
          "{}: the camera's angle falls where the model's rises (correlation {:.2f}): is its 180 straight?",
          joint, fit.alike);
    if (fit.rmse_deg > kFar * fit.expected_deg)
      notes.push_back(fmt::format(
          "{}: its angles still differ from the camera's by {:.1f} deg where {:.1f} are expected: is the "
          "camera's the angle that the model was made from, from the same zero?",
          joint, fit.rmse_deg, fit.expected_deg));
  }
}

// Where nothing was applied though no sensor has a wish.
std::string wanted_instead(const Recalibration& r, bool has_motion, bool may_be_chance) {
  if (!r.misfits.empty())
    return "sensors as they were where the model was made: see what does not fit; or identify a model again";
  const std::string tells = has_motion
                                ? "a camera (--pair): "
                                : "thirty seconds of ordinary motion (--recording) or a camera (--pair): ";
  if (may_be_chance) return tells + "what the poses tell may be chance";
  return "nothing where the angles are right; else " + tells +
         "no change that was found is larger than 0.7 of its standard errors";
}

}  // namespace

Prior shipped_prior() { return {9, 0.18, 0.13, 0.8, 0.05, 0.08, 0.1}; }

Prior prior_from_json(const std::string& text, const std::string& source) {
  const auto json = io::parse_json(text, source);
  io::JsonReader reader(json, source);
  reader.schema(kPriorSchema, kPriorVersion);
  Prior out;
  out.sessions = reader.whole_within("sessions", 0, 1000000);
  for (const auto& [name, deviation] : kDeviations)
    out.*deviation = reader.number_within(name, kLeastSd, kMostSd);
  out.alike = shipped_prior().alike;
  if (reader.has("alike")) out.alike = reader.number_within("alike", 0, kMostAlike);
  reader.done();
  return out;
}

Prior prior_of(const model::Input& input, const Prior& general) {
  if (!input.donnings || !input.readings) return general;
  Prior out = general;
  const double span = input.readings->span();
  const int recordings = input.donnings->recordings;
  const double to_mean = std::sqrt(1 + 1. / recordings);  // from a new one to the mean of these
  out.shift_sd = pooled(general.shift_sd, to_mean * input.donnings->shift_sd / span, recordings);
  out.log_gain_sd = pooled(general.log_gain_sd, to_mean * input.donnings->log_gain_sd, recordings);
  return out;
}

Recalibration recalibrate(const RecalibrationRequest& request) {
  if (request.motion.empty() && request.held.empty() && !request.seen && request.lacking.empty())
    throw io::InputError(
        "nothing to calibrate from: --recording SHORT, --poses open,fist LOG or --pair SHORT CAMERA");
  Recalibration out;
  out.wanted = request.lacking;
  out.model = request.model;
  RecalibrationRequest known = request;  // whose inputs all say what they read
  std::vector<Case> cases = cases_of(known.model, request.prior);
  check_motion(known, cases);
  if (!known.held.empty()) check_poses(known.held, cases, out);
  if (known.seen) check_seen(known.model, *known.seen, cases);
  const Eigen::MatrixXd covariance = estimate(known.model, known.seen ? &*known.seen : nullptr, cases);
  if (known.seen) check_camera(known.model, *known.seen, cases, out.notes);
  for (Case& one : cases) {
    one.other = other_line(known, one);
    one.kept = reason_to_keep(one);
  }
  const bool may_be_chance = keep_what_may_be_chance(covariance, cases);
  std::vector<std::string> shifted_alone;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    Case& one = cases[i];
    decide(known, one);
    out.sensors.push_back(one);
    if (!one.misfit.empty()) out.misfits.push_back(one.misfit);
    if ((!one.informed || !one.gain_is_known) && !one.wanted.empty()) out.wanted.push_back(one.wanted);
    if (!one.applied) continue;
    out.applied = true;
    out.model = model::corrected(std::move(out.model), i, one.correction);
    if (std::abs(one.fit.line.shift) > kFarthest * one.prior.shift_sd ||
        std::abs(one.fit.line.log_gain) > kFarthest * one.prior.log_gain_sd)
      out.notes.push_back(
          fmt::format("{}: it lies {:.0f} % of its range off, farther than putting on a glove moves it: has "
                      "it moved, or is this another hand?",
                      one.name, 100 * std::abs(one.fit.line.shift)));
    if (!one.gain_is_known) shifted_alone.push_back(one.name);
  }
  if (!shifted_alone.empty())
    out.notes.push_back(fmt::format("{}: shifted alone, the gain is not determined: {}",
                                    fmt::join(shifted_alone, ", "), kTellsGain));
  if (!out.applied && out.wanted.empty())
    out.wanted.push_back(wanted_instead(out, !request.motion.empty(), may_be_chance));
  out.joints = joints_of(known.model, cases);
  return out;
}

}  // namespace flexor::identify
