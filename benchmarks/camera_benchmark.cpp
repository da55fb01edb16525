// Colour marks that are followed, beside what whole-frame code does with the same pictures: 720 lines, a hand
// 500 pixels long, eight marks, decoded already. One core.
#include <benchmark/benchmark.h>

#include <opencv2/core/utility.hpp>
#include <opencv2/imgproc.hpp>

#include "apps/camera/pinch_test.hpp"
#include "host/camera/tracker.hpp"

namespace {

using namespace flexor;

constexpr int kWidth = 1280;
constexpr int kHeight = 720;
constexpr int kFrames = 60;

// There and back, with a little noise, so that the loop has no jump.
const std::vector<camera::Picture>& film() {
  static const std::vector<camera::Picture> pictures = [] {
    cv::setNumThreads(1);
    filming::Look look;
    look.noise = 3;
    filming::Renderer renderer(filming::pinch_view(), look, 1);
    std::vector<camera::Picture> out;
    for (int k = 0; k < kFrames; ++k) {
      const double bend = 30.0 * (k < kFrames / 2 ? k : kFrames - k) / (kFrames / 2);
      const filming::PinchPose pose = {5 + bend, 8 + bend, 5 + bend, 52, 5 + bend / 2, 5 + bend / 2};
      out.push_back(renderer.draw(filming::draw_pinch(pose, {}), static_cast<std::uint64_t>(k)).clone());
    }
    return out;
  }();
  return pictures;
}

void camera_followed(benchmark::State& state) {
  const auto joints = camera::load_joints(FLEXOR_SOURCE_DIR "/models/joints/green_markers.json");
  camera::Tracker tracker(joints, std::nullopt, kWidth, kHeight);
  std::size_t k = 0;
  const auto push = [&] {
    benchmark::DoNotOptimize(tracker.push(film()[k % kFrames], static_cast<double>(k) / 30));
    ++k;
  };
  while (k < kFrames) push();
  for (auto _ : state) push();
  const auto summary = tracker.summary();
  if (summary.labelled != summary.frames) state.SkipWithError("marks were lost");
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(camera_followed)->Unit(benchmark::kMillisecond);

void camera_found(benchmark::State& state) {
  const camera::Window all = {0, 0, kWidth, kHeight};
  const camera::ColourModel colour = camera::colour_automatic(film()[0], all, 8);
  std::size_t k = 0;
  for (auto _ : state) benchmark::DoNotOptimize(camera::find_marks(film()[k++ % kFrames], colour, all, 20));
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(camera_found)->Unit(benchmark::kMillisecond);

// The usual recipe; its components are not even marks with names yet.
void opencv_whole_frame(benchmark::State& state) {
  cv::Mat hsv;
  cv::Mat mask;
  cv::Mat labels;
  cv::Mat stats;
  cv::Mat centres;
  std::size_t k = 0;
  int components = 0;
  for (auto _ : state) {
    cv::cvtColor(film()[k++ % kFrames], hsv, cv::COLOR_BGR2HSV);
    cv::inRange(hsv, cv::Scalar(45, 100, 60), cv::Scalar(75, 255, 255), mask);
    components = cv::connectedComponentsWithStats(mask, labels, stats, centres);
  }
  if (components < 9) state.SkipWithError("marks were missed");
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(opencv_whole_frame)->Unit(benchmark::kMillisecond);

}  // namespace
