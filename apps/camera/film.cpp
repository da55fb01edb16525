#include "apps/camera/film.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/camera/tracker.hpp"
#include "host/io/io.hpp"
#include "host/study/builtin.hpp"
#include "host/twin/hand_view.hpp"
#include "host/twin/random.hpp"

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

class FilmedEngine : public Engine {
 public:
  explicit FilmedEngine(Engine* inner) : inner_(inner), joints_(paper_hand()) {}

  std::string name() const override {
    return (inner_ != nullptr ? inner_->name() : std::string("twin")) + ", rendered cameras";
  }

  int batch() const override { return 1; }

  void prepare(const twin::Setup& setup) override {
    if (inner_ != nullptr) inner_->prepare(setup);
  }

  std::vector<twin::Trial> simulate(const twin::Setup& setup, std::uint64_t first, int count) const override {
    twin::Setup exact = setup;
    exact.parameters.camera_noise_deg = 0;
    std::vector<twin::Trial> trials =
        inner_ != nullptr ? inner_->simulate(exact, first, count) : twin::simulate(exact, first, count);
    for (std::size_t t = 0; t < trials.size(); ++t) {
      const std::uint64_t seed = twin::seed_of(setup.seed, first + t, twin::seed_of(1, 'f'));
      HandFilm film(seed);
      track(film, trials[t].glove_deg, setup.parameters.camera_rate_hz, twin::kGreen);
      track(film, trials[t].hand_deg, setup.parameters.camera_rate_hz, twin::kBlue);
    }
    return trials;
  }

 private:
  void track(HandFilm& film, std::array<std::vector<float>, kFingers>& angles, double rate_hz,
             twin::Bgr paint) const {
    camera::Tracker tracker(joints_, std::nullopt, HandFilm::kWidth, HandFilm::kHeight);
    std::array<std::size_t, kFingers> column{};
    for (std::size_t i = 0; i < kFingers; ++i) {
      const auto it = std::ranges::find(tracker.angles(), model::finger_names()[i] + "_mcp");
      column[i] = static_cast<std::size_t>(it - tracker.angles().begin());
    }
    std::size_t out = 0;
    const auto take = [&](const std::vector<camera::FilteredRow>& rows) {
      for (const camera::FilteredRow& row : rows) {
        for (std::size_t i = 0; i < kFingers; ++i) {
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
      for (std::size_t i = 0; i < kFingers; ++i) pose[i] = static_cast<double>(angles[i][k]);
      take(tracker.push(film.shoot(pose, k, paint), static_cast<double>(k) / rate_hz));
    }
    take(tracker.flush());
  }

  Engine* inner_;
  camera::Joints joints_;
};

}  // namespace

HandFilm::HandFilm(std::uint64_t seed)
    : renderer_(film_view(), film_look(), seed), picture_(kWidth, kHeight) {}

const camera::Picture& HandFilm::shoot(const twin::PerFinger& mcp_deg, std::uint64_t frame, twin::Bgr paint) {
  renderer_.draw(twin::draw_spread(mcp_deg, paint).scene, frame, picture_.bgr);
  return picture_;
}

camera::Joints paper_hand() {
  camera::Joints out = camera::joints_from_json(builtin("joints/paper_hand.json"), "joints/paper_hand.json");
  constexpr double kMeasured = 0.1;  // the twin draws exactly these lengths
  for (camera::Skeleton& s : out.skeletons) s.length_tolerance = kMeasured;
  return out;
}

std::unique_ptr<Engine> filmed(Engine* inner) { return std::make_unique<FilmedEngine>(inner); }

}  // namespace flexor::filming
