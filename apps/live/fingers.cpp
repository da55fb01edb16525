#include "apps/live/fingers.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "host/io/io.hpp"
#include "host/io/numbers.hpp"
#include "host/model/standard_error.hpp"
#include "host/recording/unit.hpp"

namespace flexor::live {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kSilent_s = 1;
constexpr double kUncertain_deg = 5;
constexpr double kVeryUncertain_deg = 10;
constexpr double kBeyond = 0.1;  // of the span, beyond what the model was made from

// Of a converter of ten bits or twelve.
bool is_at_an_end(double counts) { return counts <= 1 || counts == 1023 || counts == 4095; }

void at_best_fair(FingerView& view) {
  if (view.quality != "poor") view.quality = "fair";
}

}  // namespace

Fingers::Fingers(std::vector<std::string> columns) : names_(std::move(columns)) {
  for (const std::string& name : names_) {
    Column column;
    column.name = recording::cut_name(name).name;  // as models name their joints
    if (column.name.empty()) column.name = name;
    column.unit = recording::unit_of(name);
    columns_.push_back(column);
  }
  take_off();
}

void Fingers::take_off() {
  model_.reset();
  estimator_.reset();
  watch_.reset();
  fingers_.clear();
  joints_deg_.clear();
  for (std::size_t c = 0; c < columns_.size(); ++c) fingers_.push_back({columns_[c].name, c, {}, {}});
}

std::size_t Fingers::column_of(const model::Input& input) const {
  const std::string& wanted = input.column.empty() ? input.name : input.column;
  for (std::size_t c = 0; c < names_.size(); ++c)
    if (names_[c] == wanted) return c;
  for (std::size_t c = 0; c < columns_.size(); ++c) {
    const bool same_unit = columns_[c].unit == input.unit || columns_[c].unit.empty() || input.unit.empty();
    if (same_unit && columns_[c].name == recording::cut_name(wanted).name) return c;
  }
  throw io::InputError(
      "the model reads \"{}\"{}, and this glove sends {}: choose the model that was made with it", wanted,
      input.unit.empty() ? "" : " in " + input.unit, fmt::join(names_, ", "));
}

void Fingers::wear(const model::Model& model, bool tracked) {
  std::vector<std::size_t> inputs;
  for (const model::Input& input : model.inputs) inputs.push_back(column_of(input));
  estimator_.emplace(model);
  watch_.reset();
  if (tracked && can_be_tracked(model)) {
    estimator_->track({});
  } else {
    watch_.emplace(model);
    watch_->track({}, true);
  }
  model_ = model;
  inputs_ = inputs;
  reading_.assign(inputs.size(), kNone);
  joints_deg_.assign(model.joints.size(), kNone);
  status_.assign(model.joints.size(), 0);
  clock_ = {};
  fingers_.clear();
  const model::Graph graph(model);
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    // Its own sensor: the one that is called like it, else its first.
    const std::vector<std::size_t>& of = graph.inputs[graph.joint[j]];
    const auto own = std::ranges::find_if(
        of, [&](std::size_t i) { return model.joints[j].name.starts_with(columns_[inputs[i]].name); });
    const std::size_t input = own != of.end() ? *own : of.front();
    fingers_.push_back({model.joints[j].name, inputs[input], j, input});
  }
  for (std::size_t c = 0; c < columns_.size(); ++c) {
    if (std::ranges::find(inputs, c) == inputs.end()) fingers_.push_back({columns_[c].name, c, {}, {}});
  }
}

void Fingers::remember(Column& column, double reading) {
  column.now = reading;
  if (std::isnan(reading)) return;
  column.last = {reading, column.last[0], column.last[1]};
  if (++column.count < 3) return;
  const double middle = io::median({column.last.begin(), column.last.end()});
  const bool first = column.count == 3;
  column.least = first ? middle : std::min(column.least, middle);
  column.most = first ? middle : std::max(column.most, middle);
}

void Fingers::add(const listen::Sample& sample) {
  newest_s_ = sample.host_s;
  for (std::size_t c = 0; c < columns_.size() && c < sample.value.size(); ++c) {
    remember(columns_[c], sample.value[c]);
    columns_[c].remark = c < sample.remark.size() ? sample.remark[c] : "";
  }
  if (!estimator_) return;
  for (std::size_t i = 0; i < inputs_.size(); ++i) reading_[i] = columns_[inputs_[i]].now;
  const double t_s = clock_.time_s(sample);
  if (watch_) watch_->push(t_s, reading_, [](const identify::Estimate&) {});
  estimator_->push(t_s, reading_, [this](const identify::Estimate& estimate) {
    joints_deg_ = estimate.angle_deg;
    status_ = estimate.status;
  });
}

bool Fingers::has_slipped() const {
  const auto& watched = watch_ ? watch_ : estimator_;
  if (!watched || !watched->trackers()) return false;
  std::ptrdiff_t known = 0;
  std::ptrdiff_t slipped = 0;
  for (const model::Followed& f : watched->trackers()->followed()) {
    if (!f.is_tracked) continue;
    ++known;
    if (f.alarmed || std::abs(f.shift_deg) > 2 * f.standard_error_deg) ++slipped;
  }
  return slipped > 0 && slipped >= std::min<std::ptrdiff_t>(2, known);
}

bool Fingers::has_moved() const {
  constexpr double kMoves = 0.5;  // of the span
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    const Column& column = columns_[inputs_[i]];
    const auto& spread = model_->inputs[i].readings;
    if (spread && column.most - column.least >= kMoves * spread->span()) return true;
  }
  return false;
}

double Fingers::angle_of(const Finger& finger) const {
  if (finger.joint) return joints_deg_[*finger.joint];
  return columns_[finger.column].unit == "deg" ? columns_[finger.column].now : kNone;
}

FingerView Fingers::view_of(const Finger& finger, bool recent) const {
  FingerView out{finger.name, "", kNone, kNone, kNone, kNone, kNone, kNone, "none", "", ""};
  const Column& column = columns_[finger.column];
  out.unit = column.unit;
  out.raw = column.now;
  if (column.count >= 3) {
    out.least = column.least;
    out.most = column.most;
  }
  out.angle_deg = angle_of(finger);
  out.remark = column.remark;
  if (finger.joint) {
    const model::Ends ends = model::ends(*model_, model_->joints[*finger.joint]);
    out.open_deg = ends.open_deg;
    out.fist_deg = ends.fist_deg;
  }
  if (!recent) {
    out.remark = "nothing comes";
    return out;
  }
  if (std::isnan(out.raw) && out.remark.empty()) out.remark = "no reading";
  const bool stands = column.unit == "count" && column.most - column.least <= kMoves_counts;
  if (out.remark.empty() && stands && is_at_an_end(out.raw))
    out.remark = "stands at the end of what a board can read: is a wire loose?";
  out.quality = !out.remark.empty() ? "poor" : model_ || column.unit == "deg" ? "good" : "none";
  if (stands && out.remark.empty() && (!model_ || has_moved())) {
    out.remark = "has not moved yet";
    if (model_) at_best_fair(out);
  }
  if (!finger.joint) return out;
  const model::Joint& joint = model_->joints[*finger.joint];
  if (joint.accuracy && std::isfinite(out.angle_deg)) {
    std::vector<double> reading(model_->inputs.size(), std::numeric_limits<double>::quiet_NaN());
    reading[*finger.input] = out.raw;
    out.sd_deg = model::StandardErrors(*model_).of(*finger.joint, out.angle_deg, reading);
  }
  if (out.sd_deg > kUncertain_deg && out.remark.empty())
    out.quality = out.sd_deg > kVeryUncertain_deg ? "poor" : "fair";
  const auto& spread = model_->inputs[*finger.input].readings;
  if (spread && column.count >= 3) {
    const double span = spread->span();
    out.covered = std::clamp((column.most - column.least) / span, 0.0, 1.0);
    const double beyond = std::max(spread->reading.front() - out.raw, out.raw - spread->reading.back());
    if (beyond > kBeyond * span && out.remark.empty()) {
      at_best_fair(out);
      out.remark = "reads beyond what it was calibrated for: put on again?";
    }
  }
  if (status_[*finger.joint] != 0) {
    out.quality = "poor";
    out.remark = "no good reading: the last good angle is held";
  }
  return out;
}

void Fingers::add_tracking(const model::Followed& followed, FingerView& view) const {
  if (!followed.is_tracked) {
    view.tracked =
        "not tracked: the model does not state what its sensor reads at the open hand and at the fist";
    return;
  }
  view.tracked = fmt::format("tracked: shifted by {:+.1f} ± {:.1f} degrees", followed.shift_deg,
                             followed.standard_error_deg);
  if (!followed.alarmed) return;
  view.tracked += "; it drifted more quickly than it is tracked";
  if (!view.remark.empty()) return;
  at_best_fair(view);
  view.remark = "drifted more quickly than it is tracked: put on again?";
}

std::vector<FingerView> Fingers::view(double now_s) const {
  std::vector<FingerView> out;
  const bool recent = newest_s_ >= 0 && now_s - newest_s_ < kSilent_s;
  const bool tracked = estimator_ && estimator_->trackers();
  const std::vector<model::Followed> followed =
      tracked ? estimator_->trackers()->followed() : std::vector<model::Followed>();
  for (const Finger& finger : fingers_) {
    out.push_back(view_of(finger, recent));
    if (tracked && finger.input) add_tracking(followed[*finger.input], out.back());
  }
  return out;
}

bool can_be_tracked(const model::Model& model) {
  return std::ranges::any_of(model::tracked_ranges(model),
                             [](const auto& range) { return range.has_value(); });
}

}  // namespace flexor::live
