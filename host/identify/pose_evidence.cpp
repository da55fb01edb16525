#include "host/identify/pose_evidence.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/identify/poses.hpp"
#include "host/identify/robust.hpp"
#include "host/identify/window.hpp"

namespace flexor::identify {
namespace {

constexpr double kPose_deg = 5;
constexpr double kMostPoseError = 0.3;    // of the span, where the joint hardly moves
constexpr double kNotReached = 0.5;       // of what the poses were apart, by one sensor
constexpr double kUsuallyReached = 0.75;  // by most
constexpr double kUnmoved = 0.15;

double between(const model::Poses& poses) { return poses.fist - poses.open; }

// What one sensor reads in either pose; NaN: nothing.
struct Ends {
  double open = std::numeric_limits<double>::quiet_NaN();
  double fist = open;
  double share = open;  // of what the poses were apart where the model was made

  bool both() const { return !std::isnan(share); }
  bool moved() const { return std::abs(share) > kUnmoved; }
};

std::vector<Ends> ends_of(const model::Model& model, const std::vector<Hold>& holds) {
  std::vector<Ends> out(model.inputs.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (!model.inputs[i].poses) continue;
    for (const Hold& hold : holds) {
      if (!std::isnan(hold.reading[i])) (hold.fist ? out[i].fist : out[i].open) = hold.reading[i];
    }
    out[i].share = (out[i].fist - out[i].open) / between(*model.inputs[i].poses);
  }
  return out;
}

// Where more sensors read the two poses the other way round than not, they were swapped.
bool turn_round(std::vector<Ends>& all) {
  int turned = 0;
  for (const Ends& one : all) turned += one.share < -kUnmoved ? 1 : one.share > 0 ? -1 : 0;
  if (turned <= 0) return false;
  for (Ends& one : all) one = {one.fist, one.open, -one.share};
  return true;
}

// Most sensors that were held in both poses and moved: how far they went.
double usual_share(const std::vector<Ends>& all) {
  std::vector<double> shares;
  for (const Ends& one : all) {
    if (one.moved()) shares.push_back(one.share);
  }
  return shares.empty() ? 0 : median(std::move(shares));
}

// The end that was not reached is the one that fits worse, all sensors together.
bool fist_was_reached(const model::Model& model, const std::vector<Ends>& all) {
  double nearer = 0;  // the fist than the open hand
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!all[i].moved()) continue;
    const model::Poses& made = *model.inputs[i].poses;
    nearer +=
        (std::abs(all[i].open - made.open) - std::abs(all[i].fist - made.fist)) / std::abs(between(made));
  }
  return nearer > 0;
}

// A strip that no donning explains, where most others moved from pose to pose.
std::string misfit_of(const model::Input& input, const Ends& ends) {
  if (!ends.both()) return {};
  if (ends.share < -kUnmoved) {
    return fmt::format("{}: it moves the other way than where the model was made: is its strip turned?",
                       input.name);
  }
  if (ends.share < kUnmoved) {
    return fmt::format(
        "{}: it stands still at {:.4g} where the others moved: is it plugged in, is its strip whole, "
        "was it bent?",
        input.name, ends.open);
  }
  return {};
}

void read_sensor(const model::Model& model, std::size_t i, const Ends& ends, bool fist_counts,
                 PoseReading& out, std::vector<std::string>& notes) {
  const model::Input& input = model.inputs[i];
  if (!input.poses) return;
  if (std::string misfit = misfit_of(input, ends); !misfit.empty()) {
    out.misfits.emplace_back(i, std::move(misfit));
    return;
  }
  const double most_deg = reach_of(model, i).most_deg;
  const double error = most_deg > 0 ? std::min(kMostPoseError, kPose_deg / most_deg) : kMostPoseError;
  const double pose = between(*input.poses) / input.readings->span();
  if (!std::isnan(ends.open)) out.sightings.push_back({i, ends.open, input.poses->open, error, pose, false});
  if (std::isnan(ends.fist)) return;
  if (!fist_counts || (ends.both() && ends.share < kNotReached)) {
    notes.push_back(fmt::format("{}: its fist was not reached and does not count", input.name));
    return;
  }
  out.sightings.push_back({i, ends.fist, input.poses->fist, error, pose, true});
}

}  // namespace

PoseReading read_poses(const RecalibrationRequest& request, Recalibration& said) {
  const model::Model& model = request.model;
  PoseReading out;
  std::vector<Ends> all = ends_of(model, request.holds);
  if (turn_round(all)) said.notes.emplace_back("open hand and fist were held the other way round: taken so");
  const auto live = std::ranges::count_if(all, &Ends::both);
  const auto moved = std::ranges::count_if(all, &Ends::moved);
  if (live > 0 && 2 * moved <= live) {
    said.wanted.push_back(fmt::format(
        "open hand and fist with all fingers: {} of {} sensors moved from one to the other", moved, live));
    return out;
  }
  const bool closed = live == 0 || usual_share(all) >= kUsuallyReached;
  if (!closed && fist_was_reached(model, all)) {
    said.wanted.emplace_back(
        "open hand and fist once more, the hand wholly open and wholly closed: they lie too near to each "
        "other to say which of them was not reached");
    return out;
  }
  if (!closed)
    said.wanted.emplace_back("the fist once more, wholly closed: it was not reached and does not count");
  for (std::size_t i = 0; i < model.inputs.size(); ++i)
    read_sensor(model, i, all[i], closed, out, said.notes);
  return out;
}

std::vector<Hold> holds_in(const std::vector<std::vector<double>>& readings, double period_s,
                           const std::vector<model::Spread>& made, const std::vector<bool>& fist) {
  std::vector<Rest> rests = rests_in(readings, period_s, made);
  if (rests.size() < fist.size()) return {};
  // The longest ones, in their order in time.
  std::ranges::stable_sort(rests, std::ranges::greater(), &Rest::length);
  rests.resize(fist.size());
  std::ranges::sort(rests, {}, &Rest::begin);
  std::vector<Hold> out;
  for (std::size_t i = 0; i < fist.size(); ++i) out.push_back({fist[i], rests[i].reading});
  return out;
}

}  // namespace flexor::identify
