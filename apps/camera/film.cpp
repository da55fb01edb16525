#include "apps/camera/film.hpp"

#include <algorithm>

#include "host/camera/tracker.hpp"
#include "host/io/io.hpp"
#include "host/model/model.hpp"
#include "host/twin/simulation.hpp"

namespace flexor::filming {

Renderer hand_camera(std::uint64_t seed) {
  View view;
  view.lens = camera::ordinary_lens(kFilmWidth, kFilmHeight);
  view.lens.focal_px = {1000, 1000};
  view.distance_mm = 541;  // the fifths of the picture are the columns of hand_scene()
  return {view, {.gradient = 0.3, .noise = 2}, seed};
}

Scene hand_scene(const twin::PerFinger& mcp_deg, const Bgr& paint) {
  constexpr double kColumn_mm = 104;
  constexpr double kLeft_mm = 38;  // of the column's middle: bent fingers reach to the right
  constexpr double kBase_mm = 50;
  constexpr double kStraightThumb_deg = 90;
  Scene out;
  for (int i = 0; i < twin::kFingers; ++i) {
    const bool is_thumb = i == 0;
    const twin::Posture joints =
        twin::posture(i, mcp_deg[static_cast<std::size_t>(i)] - (is_thumb ? kStraightThumb_deg : 0));
    Chain chain(out, {(i - 2) * kColumn_mm - kLeft_mm, kBase_mm}, -90, paint);
    chain.mark();
    if (is_thumb)
      chain.marked_links({30, 32, 24}, {0, joints.mcp_deg, joints.pip_deg});
    else
      chain.marked_links({30, 40, 23, 20}, {0, joints.mcp_deg, joints.pip_deg, joints.dip_deg});
  }
  return out;
}

camera::Joints drawn_hand(camera::Joints joints) {
  constexpr double kMeasured = 0.1;  // the twin draws exactly these lengths
  for (camera::Skeleton& s : joints.skeletons) s.length_tolerance = kMeasured;
  return joints;
}

void track_drawn(const camera::Joints& joints, Renderer& film, FingerAngles& angles, double rate_hz,
                 const Bgr& paint) {
  camera::Tracker tracker(joints, std::nullopt, kFilmWidth, kFilmHeight);
  std::array<std::size_t, twin::kFingers> column{};
  for (std::size_t i = 0; i < twin::kFingers; ++i) {
    const auto it = std::ranges::find(tracker.angles(), model::finger_names()[i] + "_mcp");
    column[i] = static_cast<std::size_t>(it - tracker.angles().begin());
  }
  std::size_t out = 0;
  const auto take = [&](const std::vector<camera::FilteredRow>& rows) {
    for (const camera::FilteredRow& row : rows) {
      for (std::size_t i = 0; i < twin::kFingers; ++i) {
        const camera::FilteredAngle& a = row.angles[column[i]];
        if (a.quality == camera::Quality::lost) {
          throw io::JobError("the rendered camera lost the {} finger at {:.2f} s", model::finger_names()[i],
                             row.t_s);
        }
        angles[i][out] = static_cast<float>(a.deg);
      }
      ++out;
    }
  };
  const std::size_t frames = angles[0].size();
  for (std::size_t k = 0; k < frames; ++k) {
    twin::PerFinger pose{};
    for (std::size_t i = 0; i < twin::kFingers; ++i) pose[i] = static_cast<double>(angles[i][k]);
    take(tracker.push(film.draw(hand_scene(pose, paint), k), static_cast<double>(k) / rate_hz));
  }
  take(tracker.flush());
}

}  // namespace flexor::filming
