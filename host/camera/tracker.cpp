#include "host/camera/tracker.hpp"

#include <algorithm>

namespace flexor::camera {

std::vector<std::string> angle_names(const Joints& joints) {
  std::vector<std::string> out;
  for (const Skeleton& s : joints.skeletons) {
    for (const AngleRule& rule : s.angles) out.push_back(rule.name);
  }
  return out;
}

Tracker::Tracker(const Joints& joints, const std::optional<Lens>& lens, int width, int height)
    : joints_(joints), names_(angle_names(joints)), seen_(joints.skeletons.size()), filter_(names_.size()) {
  for (const Skeleton& s : joints.skeletons) {
    found_.emplace_back(s.marks.size());
    if (s.kind == MarkKind::colour) {
      trackers_.emplace_back(std::in_place_type<ColourTracker>, s, lens);
    } else {
      trackers_.emplace_back(std::in_place_type<PrintedTracker>, s,
                             lens.value_or(ordinary_lens(width, height)));
    }
  }
  for (const std::string& name : names_) summary_.angles.push_back({.name = name});
}

std::vector<FilteredRow> Tracker::push(const Picture& picture, double t_s) {
  std::vector<Measurement> measurements;
  bool labelled = true;
  for (std::size_t i = 0; i < trackers_.size(); ++i) {
    seen_[i] = std::visit([&](auto& tracker) { return tracker.step(picture, t_s); }, trackers_[i]);
    labelled = labelled && seen_[i].labelled();
    for (std::size_t m = 0; m < seen_[i].marks.size(); ++m) {
      if (seen_[i].marks[m].measured) found_[i][m] = true;
    }
    measurements.insert(measurements.end(), seen_[i].measurements.begin(), seen_[i].measurements.end());
  }
  if (summary_.frames == 0) summary_.from_s = t_s;
  summary_.to_s = t_s;
  ++summary_.frames;
  if (labelled) ++summary_.labelled;
  drops_.add(t_s);
  std::vector<FilteredRow> out;
  if (auto row = filter_.push(t_s, std::move(measurements))) {
    count(*row);
    out.push_back(std::move(*row));
  }
  return out;
}

std::vector<FilteredRow> Tracker::flush() {
  std::vector<FilteredRow> out = filter_.flush();
  for (const FilteredRow& row : out) count(row);
  return out;
}

void Tracker::count(const FilteredRow& row) {
  Quality worst = Quality::good;
  for (std::size_t k = 0; k < row.angles.size(); ++k) {
    const FilteredAngle& a = row.angles[k];
    AngleSummary& s = summary_.angles[k];
    worst = std::max(worst, a.quality);
    ++s.frames[static_cast<std::size_t>(a.quality)];
    if (a.quality == Quality::lost) continue;
    const auto known = static_cast<double>(s.frames[0] + s.frames[1] + s.frames[2]);
    s.mean_se_deg += (a.se_deg - s.mean_se_deg) / known;
    s.min_deg = known > 1 ? std::min(s.min_deg, a.deg) : a.deg;
    s.max_deg = known > 1 ? std::max(s.max_deg, a.deg) : a.deg;
  }
  const bool unsure = worst != Quality::good;
  if (unsure && !unsure_now_) {
    ++summary_.unsure_stretches;
    if (summary_.unsure.size() < kMaxUnsure) summary_.unsure.push_back({row.t_s, row.t_s, 0, worst});
  }
  if (unsure && summary_.unsure_stretches <= kMaxUnsure) {
    Unsure& u = summary_.unsure.back();
    u.to_s = row.t_s;
    u.quality = std::max(u.quality, worst);
    ++u.frames;
  }
  unsure_now_ = unsure;
}

Summary Tracker::summary() const {
  Summary out = summary_;
  out.dropped = drops_.dropped();
  for (std::size_t i = 0; i < trackers_.size(); ++i) {
    const Skeleton& skeleton = joints_.skeletons[i];
    out.marks += skeleton.marks.size();
    for (std::size_t m = 0; m < skeleton.marks.size(); ++m) {
      if (!found_[i][m]) out.never_found.push_back(skeleton.name + ": " + skeleton.marks[m]);
    }
    if (std::ranges::find(found_[i], true) != found_[i].end()) continue;
    const std::string& why =
        std::visit([](const auto& t) -> const std::string& { return t.trouble(); }, trackers_[i]);
    out.trouble.push_back(skeleton.name + ": " + why);
  }
  return out;
}

}  // namespace flexor::camera
