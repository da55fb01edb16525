#include "host/donning/recalibrate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "host/donning/camera_evidence.hpp"
#include "host/donning/pose_evidence.hpp"
#include "host/donning/still_map.hpp"
#include "host/io/io.hpp"

namespace flexor::donning {
namespace {

constexpr int kWholeCycle = 3;         // turns
constexpr double kBothEnds = 0.85;     // of the span: then one turn less is a whole cycle
constexpr double kThereAndBack = 0.7;  // of the span, both ways: one turn is enough
constexpr double kTurn_deg = 30;
constexpr double kMostTurn = 0.5;      // of the span, where the joint moves little
constexpr double kLeastCovered = 0.6;  // of the span
constexpr double kMostCovered = 1.7;
constexpr double kNotOpened = 0.1;  // of the span: how far from it an open hand may turn
constexpr double kFistStayed = 0.04;
constexpr double kStandsStill = 0.01;
constexpr double kSlipped = 0.3;
constexpr double kSignificant = 0.7;  // standard errors
constexpr double kSure = 1.3;         // standard errors
constexpr double kFarthest = 3;       // of the prior's standard deviations
constexpr std::size_t kLeastSamples = 20;
constexpr const char* kTellsGain =
    "a camera (--pair) would tell it";  // poses: as well as they are held alike

// What one log says of one sensor.
struct Verdict {
  bool tells = false;
  std::string misfit;
  std::string wanted;
};

// What is known of one sensor before the estimate.
struct Case {
  Prior prior;
  model::Spread made;
  double turn = 0;
  std::vector<std::optional<Window>> windows;  // of each log, where it tells
  std::optional<Window> shown;                 // of the log that shows most
  bool informed = false;
  std::string misfit;
  std::string wanted;
};

model::Spread spread_of(const model::Model& model, std::size_t i) {
  const model::Input& input = model.inputs[i];
  if (input.readings) return *input.readings;
  if (!input.poses) {
    throw io::InputError(
        fmt::format("{}: the model does not say what this sensor read where it was made: identify it anew "
                    "with this version",
                    input.name));
  }
  const auto [low, high] = std::minmax(input.poses->open, input.poses->fist);
  return {{0.05, 0.95}, {low, high}};
}

double turn_of(const model::Model& model, std::size_t i) {
  double most_deg = 0;
  for (const double range : ranges_deg(model, i)) most_deg = std::max(most_deg, range);
  const double span = model.inputs[i].readings->span();
  return span * (most_deg > kTurn_deg / kMostTurn ? kTurn_deg / most_deg : kMostTurn);
}

// How readings go as the joint that they tell most of bends: Stretch::bends.
int bends_of(const model::Model& model, std::size_t i) {
  double most_deg = 0;
  for (const auto& slope : slopes(model, i)) {
    double all = 0;
    for (const double one : slope) all += one;
    if (std::abs(all) > std::abs(most_deg)) most_deg = all;
  }
  return most_deg > 0 ? 1 : most_deg < 0 ? -1 : 0;
}

std::vector<Case> cases_of(model::Model& model, const Prior& prior) {
  std::vector<Case> out;
  for (std::size_t i = 0; i < model.inputs.size(); ++i) model.inputs[i].readings = spread_of(model, i);
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    Case& one = out.emplace_back();
    one.prior = prior_of(model.inputs[i], prior);
    one.made = *model.inputs[i].readings;
    one.turn = turn_of(model, i);
  }
  return out;
}

bool whole_cycle(const Window& w, const model::Spread& made) {
  if (w.turns.there_and_back >= kThereAndBack * made.span()) return true;
  return w.turns.count() >= kWholeCycle - (w.span() >= kBothEnds * made.span() ? 1 : 0);
}

// Whether the stretch tells this sensor; else what is wrong with it or what is wanted.
Verdict judge(const std::string& name, const Case& one, const Window& window,
              std::span<const double> readings) {
  const double covered = window.span() / one.made.span();
  if (!whole_cycle(window, one.made)) {
    Verdict out;
    const double little = std::max(one.turn / 5, kStandsStill * one.made.span());
    if (covered < kStandsStill) {
      out.misfit =
          fmt::format("{}: it stands still at {:.4g}: is it plugged in, is its strip whole, was it bent?",
                      name, window.middle());
    } else if (covered < kSlipped && turns_of(readings, little).count() >= 2 * kWholeCycle) {
      out.misfit = fmt::format(
          "{}: it moves between {:.4g} and {:.4g} only, {:.0f} % of what it did: has its strip slipped or "
          "broken?",
          name, window.quantile.front(), window.quantile.back(), 100 * covered);
    }
    out.wanted = fmt::format("{}: open and close it once more: {} of {} turns of {:g} degrees were seen",
                             name, window.turns.count(), kWholeCycle, kTurn_deg);
    return out;
  }
  if (covered < kLeastCovered) {
    return {false, "",
            fmt::format("{}: bend it from one end to the other: {:.0f} % of its range was seen", name,
                        100 * covered)};
  }
  if (covered > kMostCovered) {
    return {false,
            fmt::format("{}: it moves {:.1f} times as far as where the model was made: another strip or "
                        "another hand?",
                        name, covered),
            ""};
  }
  return {true, "", ""};
}

// Each log by itself; what is wrong or wanted is said by that which shows most, unless one tells.
void look_at_sensor(const Request& request, std::size_t i, Case& one) {
  const model::Input& input = request.model.inputs[i];
  for (const Motion& motion : request.motion) {
    const std::vector<double>& readings = motion.reading[i];
    auto& told = one.windows.emplace_back();
    if (readings.size() < kLeastSamples) continue;
    Window window = window_of(readings, one.made.share, one.turn);
    const Verdict verdict = judge(input.name, one, window, readings);
    if (verdict.tells) told = window;
    const bool most = !one.shown || (verdict.tells && !one.informed) ||
                      (verdict.tells == one.informed && window.span() > one.shown->span());
    one.informed = one.informed || verdict.tells;
    if (!most) continue;
    one.misfit = verdict.misfit;
    one.wanted = verdict.wanted;
    one.shown = std::move(window);
  }
  if (one.shown || request.motion.empty()) return;
  one.misfit = fmt::format("{}: hardly any reading of it is valid: is it plugged in?", input.name);
  one.wanted = fmt::format("{}: readings within {:g} and {:g}", input.name, input.valid_min, input.valid_max);
}

// The fist is where it was, the open hand is not: of one sensor a donning may do that, of all of them it is the hand.
bool is_not_opened(const Window& window, const model::Spread& made, int bends) {
  const double low = (window.quantile.front() - made.reading.front()) / made.span();
  const double high = (made.reading.back() - window.quantile.back()) / made.span();
  const double open = bends > 0 ? low : high;
  const double fist = bends > 0 ? high : low;
  return bends != 0 && open > kNotOpened && std::abs(fist) < kFistStayed;
}

// A log in which the hand was never opened tells no sensor.
void look_at_open_hand(const Request& request, std::size_t log, std::vector<Case>& cases) {
  int telling = 0;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const Case& one = cases[i];
    if (!one.windows[log]) continue;
    if (!is_not_opened(*one.windows[log], one.made, bends_of(request.model, i))) return;
    ++telling;
  }
  if (telling < 2) return;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    if (!cases[i].windows[log].has_value()) continue;
    cases[i].windows[log].reset();
    cases[i].wanted = fmt::format(
        "{}: open the hand wholly: each finger closes to where it did and none opens to where it did",
        request.model.inputs[i].name);
  }
}

void look_at_motion(const Request& request, std::vector<Case>& cases) {
  for (std::size_t i = 0; i < cases.size(); ++i) look_at_sensor(request, i, cases[i]);
  for (std::size_t log = 0; log < request.motion.size(); ++log) look_at_open_hand(request, log, cases);
  for (Case& one : cases)
    one.informed = std::ranges::any_of(one.windows, [](const auto& w) { return w.has_value(); });
}

struct Variances {
  double shift;
  double log_gain;
  double both;

  // Of what a reading so far from the middle is taken for; in spans.
  double at(double place) const { return shift + 2 * place * both + place * place * log_gain; }
};

Variances variances(const Estimate& e, std::size_t i) {
  const auto at = 2 * static_cast<Eigen::Index>(i);
  return {e.covariance(at, at), e.covariance(at + 1, at + 1), e.covariance(at, at + 1)};
}

bool significant(const Estimate& e, std::size_t i) {
  const Variances v = variances(e, i);
  const Line& line = e.line[i];
  if (std::abs(line.shift) > kSignificant * std::sqrt(v.shift)) return true;
  return e.gain_told[i] && std::abs(line.log_gain) > kSignificant * std::sqrt(v.log_gain);
}

// What a stretch of motion alone says where the hand reached as far as it did where the model was made: the sensor has the
// gain. The estimate holds a hand that reached less far for likelier; motion cannot tell the two apart. None: it is told.
std::optional<Line> other_line(const Request& request, const Estimate& e, const Case& one, std::size_t i) {
  if (!request.holds.empty() || request.seen || e.gain_told[i] || !one.informed || !one.shown) return {};
  const double gain = one.made.span() / one.shown->span();
  return Line{gain * (one.made.middle() - one.shown->middle()) / one.made.span(), std::log(gain)};
}

// Mean square of what one line makes of readings against what the other does, in spans.
double distance2(const Line& a, const Line& b) {
  return std::pow(a.shift - b.shift, 2) + std::pow(std::exp(a.log_gain) - std::exp(b.log_gain), 2) / 12;
}

// The old angles are right to a thirtieth of the range, by the estimate's error and by the other explanation.
bool is_known_unchanged(const Estimate& e, std::size_t i, const std::optional<Line>& other) {
  constexpr double kSame = 1.0 / 30;
  const Variances v = variances(e, i);
  const double left2 = v.shift + v.log_gain / 12 + distance2(e.line[i], {});
  return std::max(left2, other ? distance2({}, *other) : 0) < kSame * kSame;
}

// By how many standard errors the mean square of the angles becomes smaller by what was found of some sensors, m, with the
// covariance C that is left: the true lines x are nearer to m than to none where 2 m'Wx > m'Wm, of which the left side is
// normal with mean 2 m'Wm and variance 4 m'WCWm. W weighs shift and gain by what they move the angles.
double surely_better(const model::Model& model, const Estimate& e, const std::vector<bool>& of) {
  Eigen::VectorXd weighed = Eigen::VectorXd::Zero(e.covariance.rows());
  double square = 0;
  for (std::size_t i = 0; i < of.size(); ++i) {
    if (!of[i]) continue;
    double weight = 0;
    for (const double range : ranges_deg(model, i)) weight += range * range;
    const auto at = 2 * static_cast<Eigen::Index>(i);
    weighed(at) = weight * e.line[i].shift;
    weighed(at + 1) = weight * e.line[i].log_gain / 12;  // the variance of places in a span
    square += weighed(at) * e.line[i].shift + weighed(at + 1) * e.line[i].log_gain;
  }
  const double variance = weighed.dot(e.covariance * weighed);
  return variance > 0 ? square / 2 / std::sqrt(variance) : 0;
}

// Why a sensor stays as it is; empty: it is corrected.
std::string reason_to_keep(const Request& request, const Estimate& e, Case& one, std::size_t i,
                           bool seen_helps) {
  const std::string& name = request.model.inputs[i].name;
  if (!one.misfit.empty()) return one.misfit;
  if (!one.informed && !one.wanted.empty()) return one.wanted;
  if (!one.informed) return fmt::format("{}: nothing that was given tells it", name);
  const Line& line = e.line[i];
  if (std::abs(line.shift) > kFarthest * one.prior.shift_sd ||
      std::abs(line.log_gain) > kFarthest * one.prior.log_gain_sd) {
    one.misfit = fmt::format(
        "{}: it lies {:.0f} % of its range off, farther than putting on a glove moves it: has its strip "
        "moved, or is "
        "this another hand?",
        name, 100 * std::abs(line.shift));
    return one.misfit;
  }
  const std::optional<Line> other = other_line(request, e, one, i);
  if (!significant(e, i)) {
    if (is_known_unchanged(e, i, other))
      return fmt::format("{}: it reads as it did where the model was made", name);
    return fmt::format("{}: no change was found that is larger than its own error{}", name,
                       other ? "; its gain is not told: " + std::string(kTellsGain) : "");
  }
  constexpr double kClearly = 0.5;  // the other explanation is itself known from one stretch alone
  if (other && distance2(line, *other) > kClearly * distance2({}, *other)) {
    one.wanted = fmt::format("{}: {}", name, kTellsGain);
    return fmt::format(
        "{}: motion alone does not tell a sensor of another gain from a hand that reached less far: {}", name,
        kTellsGain);
  }
  if (!seen_helps)
    return fmt::format("{}: the old calibration is kept: on what was held back the new one is no better",
                       name);
  return {};
}

// What a joint's angles change by, and the standard error that is left, over the parts of each sensor's spread.
std::vector<JointResult> joints_of(const Request& request, const std::vector<Case>& cases, const Estimate& e,
                                   const std::vector<SensorResult>& sensors) {
  const model::Model& old = request.model;
  std::vector<JointResult> out(old.joints.size());
  std::vector<double> square(out.size(), 0);
  std::vector<double> change_square(out.size(), 0);
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const auto all = slopes(old, i);
    const Variances v = variances(e, i);
    const std::optional<Line> other = other_line(request, e, cases[i], i);
    const Line taken = sensors[i].applied ? e.line[i] : Line{};
    for (std::size_t j = 0; j < out.size(); ++j) {
      const auto parts = static_cast<double>(all[j].size());
      for (std::size_t k = 0; k < all[j].size(); ++k) {
        const double place = (static_cast<double>(k) + 0.5) / parts - 0.5;
        const double slope = all[j][k] * cases[i].made.span();
        // A line that was found and not taken is still there.
        const double left = sensors[i].applied ? 0 : e.line[i].shift + place * e.line[i].log_gain;
        const double off = other ? other->shift - taken.shift +
                                       place * (std::exp(other->log_gain) - std::exp(taken.log_gain))
                                 : 0;
        square[j] += slope * slope * std::max(v.at(place) + left * left, off * off) / parts;
        const double reading = cases[i].made.middle() + place * cases[i].made.span();
        const double change_deg = all[j][k] * (sensors[i].correction(reading) - reading);
        out[j].change_deg += change_deg / parts;
        change_square[j] += change_deg * change_deg / parts;
      }
    }
  }
  for (std::size_t j = 0; j < out.size(); ++j) {
    out[j].name = old.joints[j].name;
    out[j].se_deg = std::sqrt(square[j]);
    out[j].change_rms_deg = std::sqrt(change_square[j]);
  }
  return out;
}

using AllEvidence = std::vector<std::unique_ptr<Evidence>>;

void add_motion(const Request& request, const std::vector<Case>& cases, AllEvidence& all) {
  for (std::size_t m = 0; m < request.motion.size(); ++m) {
    std::vector<Stretch> stretches;
    for (std::size_t i = 0; i < cases.size(); ++i) {
      const Case& one = cases[i];
      if (one.windows[m])
        stretches.push_back({i, *one.windows[m], one.made, one.prior, bends_of(request.model, i)});
    }
    if (!stretches.empty()) all.push_back(std::make_unique<Quantiles>(std::move(stretches)));
  }
}

// Of a sensor that the poses do not tell, where motion does not either.
void say_what_poses_lack(const Request& request, std::size_t i, Case& one) {
  const model::Input& input = request.model.inputs[i];
  if (!input.poses) {
    one.wanted =
        fmt::format("{}: motion or a camera: the model does not say what it reads at the poses", input.name);
    return;
  }
  const auto missing = [&](const Hold& hold) { return std::isnan(hold.reading[i]); };
  if (std::ranges::all_of(request.holds, missing))
    one.misfit = fmt::format("{}: no reading of it is valid in the poses: is it plugged in?", input.name);
}

void add_poses(const Request& request, const std::vector<model::Spread>& made, std::vector<Case>& cases,
               AllEvidence& all, Recalibration& out) {
  PoseReading poses = read_poses(request.model, request.holds);
  out.notes.insert(out.notes.end(), poses.notes.begin(), poses.notes.end());
  out.wanted.insert(out.wanted.end(), poses.wanted.begin(), poses.wanted.end());
  for (const auto& [sensor, text] : poses.misfits) {
    if (!cases[sensor].informed) {
      cases[sensor].misfit = text;
    } else {
      out.notes.push_back(text);  // motion tells it all the same
    }
  }
  std::vector<int> sighted(cases.size(), 0);
  for (const Sighting& s : poses.sightings) ++sighted[s.sensor];
  for (std::size_t i = 0; i < cases.size(); ++i) {
    if (sighted[i] > 1 && !cases[i].informed) cases[i].misfit.clear();  // it moved from one to the other
    if (sighted[i] == 0 && !cases[i].informed && cases[i].misfit.empty())
      say_what_poses_lack(request, i, cases[i]);
    cases[i].informed = cases[i].informed || sighted[i] > 0;
  }
  if (!poses.sightings.empty()) all.push_back(std::make_unique<Sightings>(std::move(poses.sightings), made));
}

AllEvidence evidence_of(const Request& request, std::vector<Case>& cases, Recalibration& out) {
  AllEvidence all;
  std::vector<model::Spread> made;
  for (const Case& one : cases) made.push_back(one.made);
  add_motion(request, cases, all);
  if (!request.holds.empty()) add_poses(request, made, cases, all, out);
  if (request.seen) {
    for (const std::size_t sensor : told_by_camera(request.model, *request.seen))
      cases[sensor].informed = true;
    all.push_back(std::make_unique<CameraEvidence>(request.model, *request.seen, made, 0, 1));
  }
  return all;
}

Estimate estimate_of(const std::vector<Case>& cases, const AllEvidence& evidence,
                     const Evidence* instead_of_last = nullptr) {
  std::vector<Prior> priors;
  for (const Case& one : cases) priors.push_back(one.prior);
  std::vector<const Evidence*> all;
  for (const auto& one : evidence) all.push_back(one.get());
  if (instead_of_last != nullptr) all.back() = instead_of_last;
  return estimate(priors, all);
}

// The second half of what the camera saw, by an estimate from its first.
bool camera_agrees(const Request& request, const std::vector<Case>& cases, const AllEvidence& evidence) {
  if (!request.seen) return true;
  std::vector<model::Spread> made;
  for (const Case& one : cases) made.push_back(one.made);
  const CameraEvidence first(request.model, *request.seen, made, 0, 0.5);
  const CameraEvidence second(request.model, *request.seen, made, 0.5, 1);
  const Estimate half = estimate_of(cases, evidence, &first);
  return second.mean_square_deg2(half.line) < second.mean_square_deg2(std::vector<Line>(cases.size()));
}

SensorResult result_of(const Request& request, const Estimate& e, const Case& one, std::size_t i) {
  const Variances v = variances(e, i);
  SensorResult s;
  s.name = request.model.inputs[i].name;
  s.shift_se = std::sqrt(v.shift) * one.made.span();
  s.gain_se = std::sqrt(v.log_gain) * std::exp(e.line[i].log_gain);
  if (one.shown) s.reversals = one.shown->turns.count();
  if (one.shown) s.covered = one.shown->span() / one.made.span();
  return s;
}

void check(const Request& request) {
  if (request.motion.empty() && request.holds.empty() && !request.seen && request.lacking.empty())
    throw io::InputError(
        "nothing to calibrate from: --recording SHORT, --poses open,fist LOG or --pair SHORT CAMERA");
}

// Where nothing was applied though no sensor said what it wants.
std::string wanted_instead(const Recalibration& r, bool sure, bool seen_helps) {
  if (!r.misfits.empty())
    return "strips as they were where the model was made: see what does not fit; or identify a model anew";
  if (!sure)
    return "open hand and fist once more, held as they were where the model was made, or a camera (--pair): "
           "what the poses tell may be chance";
  if (!seen_helps)
    return "a longer stretch with the camera: what was held back of this one is no better with a new "
           "calibration";
  return "nothing where the angles are right; else a camera (--pair): no change that was told is larger than "
         "its own error";
}

}  // namespace

Recalibration recalibrate(const Request& request) {
  check(request);
  Recalibration out;
  out.wanted = request.lacking;
  Request known = request;
  std::vector<Case> cases = cases_of(known.model, request.prior);
  look_at_motion(known, cases);
  const AllEvidence evidence = evidence_of(known, cases, out);
  const Estimate e = estimate_of(cases, evidence);
  const bool seen_helps = camera_agrees(known, cases, evidence);
  out.model = request.model;
  std::vector<bool> found;
  std::vector<std::string> kept;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    kept.push_back(reason_to_keep(known, e, cases[i], i, seen_helps));
    found.push_back(kept.back().empty());
  }
  // A wearer holds poses as well as he does; a stretch of motion says by itself how well it repeats.
  const bool sure = request.holds.empty() || surely_better(known.model, e, found) > kSure;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    SensorResult s = result_of(known, e, cases[i], i);
    s.kept = kept[i];
    if (s.kept.empty() && !sure)
      s.kept = fmt::format("{}: what was found may be chance: the old calibration is kept", s.name);
    if (!cases[i].misfit.empty()) out.misfits.push_back(cases[i].misfit);
    // Poses that changed nothing may yet have been held otherwise: then the gain is as uncertain as they are.
    const bool is_doubted = !known.holds.empty() && !known.seen && !s.kept.empty() &&
                            !is_known_unchanged(e, i, other_line(known, e, cases[i], i));
    s.gain_is_told = !is_doubted && !other_line(known, e, cases[i], i);
    if ((!cases[i].informed || !s.gain_is_told) && !cases[i].wanted.empty())
      out.wanted.push_back(cases[i].wanted);
    if (s.kept.empty()) {
      s.applied = out.applied = true;
      s.correction = correction_of(e.line[i], cases[i].made);
      out.model = model::corrected(std::move(out.model), i, s.correction);
    }
    out.sensors.push_back(std::move(s));
  }
  std::string shifted_alone;
  for (const SensorResult& sensor : out.sensors) {
    if (sensor.applied && !sensor.gain_is_told)
      shifted_alone += (shifted_alone.empty() ? "" : ", ") + sensor.name;
  }
  if (!shifted_alone.empty())
    out.notes.push_back(
        fmt::format("{}: shifted alone, the gain is not told: {}", shifted_alone, kTellsGain));
  const bool nothing_found = std::ranges::none_of(found, [](bool f) { return f; });
  if (!out.applied && out.wanted.empty())
    out.wanted.push_back(wanted_instead(out, sure || nothing_found, seen_helps));
  out.joints = joints_of(known, cases, e, out.sensors);
  return out;
}

}  // namespace flexor::donning
