// A compensator over a stream of readings: what apply runs on a log as it comes, and what identify scores.
//
// Readings -> recording::Resampler on the grid of the model's period -> runtime/compensator. In fixed point a sensor's
// correction comes before the integers, as in a board's table of counts. Past readings only; what is kept does not grow with the log. In a pause the last reading is held, and the angle with it;
// after ten seconds without a reading the grid starts again at the next one.
#pragma once

#include <optional>
#include <span>
#include <type_traits>
#include <vector>

#include "host/model/compensator.hpp"
#include "host/model/correction.hpp"
#include "host/model/model.hpp"
#include "host/model/tracking.hpp"
#include "host/recording/resample.hpp"

namespace flexor::identify {

// An angle's status: that of the runtime, and this for a pause of the log.
inline constexpr int kPause = 4;

struct Estimate {
  double t_s = 0;
  std::vector<double> angle_deg;  // of each joint
  std::vector<int> status;        // core::Status, or kPause where that is ok
  std::vector<double> reading;    // of each input
};

template <class Arithmetic>
class Estimator {
 public:
  // Throws io::InputError when the model does not fit the arithmetic.
  explicit Estimator(const model::Model& model)
      : board_(kFixed ? model::folded(model) : model::Folded{model, {}}),
        compensator_(board_.model),
        resampler_(ranges(model), model.sample_period_s, max_gap_s(model)),
        out_{0, std::vector<double>(model.joints.size()), std::vector<int>(model.joints.size()), {}} {}

  // From now on each sensor is followed while it is worn (runtime/sensor/tracker.hpp); watched: see model::tracked_ranges.
  void track(const model::TrackingPrior& prior, bool watched = false) {
    trackers_.emplace(board_.model, prior, watched);
  }
  const std::optional<model::Trackers<Arithmetic>>& trackers() const { return trackers_; }

  // One reading of each input, t_s never decreasing. Calls sink(const Estimate&) for each grid point that
  // it completes.
  template <class Sink>
  void push(double t_s, std::span<const double> reading, Sink&& sink) {
    resampler_.push(t_s, reading, [&](const recording::Sample& sample) {
      out_.t_s = sample.t_s;
      out_.reading.assign(sample.value.begin(), sample.value.end());
      reading_ = out_.reading;
      for (std::size_t i = 0; i < board_.correction.size(); ++i)
        reading_[i] = board_.correction[i](reading_[i]);
      const auto steps = compensator_.step(trackers_ ? trackers_->step(reading_, sample.pause) : reading_);
      for (std::size_t i = 0; i < out_.angle_deg.size(); ++i) {
        const auto& step = steps[i];
        out_.angle_deg[i] = step.angle_deg;
        out_.status[i] =
            step.status == core::Status::ok && sample.pause ? kPause : static_cast<int>(step.status);
      }
      sink(out_);
    });
  }

  // A reading older than this is a pause: what the log that the model was fitted to stated.
  static double max_gap_s(const model::Model& model) {
    return model.max_gap_s > 0 ? model.max_gap_s : std::max(0.3, 5 * model.sample_period_s);
  }

 private:
  static constexpr bool kFixed = std::is_same_v<Arithmetic, model::FixedArithmetic>;

  static std::vector<recording::Range> ranges(const model::Model& model) {
    std::vector<recording::Range> out;
    for (const model::Input& input : model.inputs) out.push_back({input.valid_min, input.valid_max});
    return out;
  }

  model::Folded board_;
  model::Compensator<Arithmetic> compensator_;
  std::optional<model::Trackers<Arithmetic>> trackers_;
  recording::Resampler resampler_;
  std::vector<double> reading_;
  Estimate out_;
};

}  // namespace flexor::identify
