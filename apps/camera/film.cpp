#include "apps/camera/film.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/camera/tracker.hpp"
#include "host/io/io.hpp"
#include "host/model/model.hpp"
#include "host/twin/hand_view.hpp"

namespace flexor::filming {
namespace {

twin::View film_view() {
  twin::View view;
  view.width = HandFilm::kWidth;
  view.height = HandFilm::kHeight;
  view.focal_px = 1000;
  view.distance_mm = 541;  // the fifths of the picture are the columns of draw_spread
  view.centre_px = {(HandFilm::kWidth - 1) / 2.0, (HandFilm::kHeight - 1) / 2.0};
  return view;
}

twin::Look film_look() {
  twin::Look look;
  look.gradient = 0.3;
  look.noise = 2;
  return look;
}

void track_drawn(const camera::Joints& joints, HandFilm& film, FingerAngles& angles, double rate_hz,
                 twin::Bgr paint) {
  camera::Tracker tracker(joints, std::nullopt, HandFilm::kWidth, HandFilm::kHeight);
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
          throw io::JobError(fmt::format("the rendered camera lost the {} finger at {:.2f} s",
                                         model::finger_names()[i], row.t_s));
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
    take(tracker.push(film.shoot(pose, k, paint), static_cast<double>(k) / rate_hz));
  }
  take(tracker.flush());
}

}  // namespace

HandFilm::HandFilm(std::uint64_t seed)
    : renderer_(film_view(), film_look(), seed), picture_(kWidth, kHeight) {}

const camera::Picture& HandFilm::shoot(const twin::PerFinger& mcp_deg, std::uint64_t frame, twin::Bgr paint) {
  renderer_.draw(twin::draw_spread(mcp_deg, paint).scene, frame, picture_.bgr);
  return picture_;
}

camera::Joints drawn_hand(camera::Joints joints) {
  constexpr double kMeasured = 0.1;  // the twin draws exactly these lengths
  for (camera::Skeleton& s : joints.skeletons) s.length_tolerance = kMeasured;
  return joints;
}

Sight see(const camera::Joints& joints, Sight exact, double rate_hz, std::uint64_t seed) {
  HandFilm film(seed);
  track_drawn(joints, film, exact.glove_deg, rate_hz, twin::kGreen);
  track_drawn(joints, film, exact.hand_deg, rate_hz, twin::kBlue);
  return exact;
}

}  // namespace flexor::filming
