// A sensor's offset and gain, followed while the glove is worn, from whole bends alone.
//
//   corrected = x + shift + stretch (x - M)            M: middle of the model's two poses, H: half their distance
// observe() is called kTicks_hz times a second. A level follows the reading, at most H/8 behind it and by a quarter
// of what is left a tick, and turns where it has come back by 5/16 of the range. Two turns in a row, both of which
// were rested at, low l and high h, are a bend:
//   d = M - corrected((l + h) / 2)                     what the shift lacks
//   e = H - (1 + stretch) (h - l) / 2                  what the stretch lacks at the ends; above 0: a short bend
// A short bend may have stopped short at one end, which moves its middle by e: only what of d is beyond e, of the
// stretch in use, counts.
// A bend counts as whole, and is used, where (h - l) / 2 >= 27/32 H: two standard deviations of the gain
// between donnings. A finger that goes half way, however often, changes nothing. Two scalar Kalman filters, p being
// variances in units of one bend's, N^2:
//   K = p / (p + 1),   shift += K d,   p = K
// Between bends the p of the shift grows by the drift's variance, which moves nothing until there is a bend: time
// forgets nothing. A bend with |d| > b, b between 1 and 2 N sqrt(p + 1), is a surprise: the first moves nothing, those
// that follow it to the same side move the shift by b, and the third raises the alarm: the sensor drifts more quickly
// than it is followed. Short bends stretch an eighth as quickly as long ones, which no finger can feign. What is in
// use goes to what was found by at most `max_step` or, the stretch, kStretchStep a tick; but stays none as long as
// what was found is no more than N, or 4 % of the range: a hand's own bends lie as far off from one minute to the next,
// and a glove that was not put on again is best left as it is.
//
// In int16 (readings Q5, stretch Q14, variances Q8), 24 bytes a sensor, and in floating point from the same lines.
#pragma once

#include "runtime/core/fixed_point.hpp"

namespace flexor {
namespace sensor {

constexpr uint8_t kTicks_hz = 10;

// Readings Q5, ratios Q14, variances Q8.
struct FixedTracking {
  using Reading = int16_t;
  using Ratio = int16_t;
  using Variance = uint16_t;
  using Growth = uint16_t;   // Q16, of a variance in a tick
  using Inverse = uint16_t;  // 2^21 / half
  static constexpr Ratio kMostStretch = 1 << 12;
  static constexpr Ratio kStretchStep = 41;
  static constexpr Ratio kStretchBand = 655;
  static constexpr Variance kOne = 256;
  static constexpr Variance kMostVariance = 64000;

  template <uint8_t kShift>
  static Reading part(Reading x) {
    return static_cast<Reading>((x >> kShift) + ((x >> (kShift - 1)) & 1));
  }
  static Reading stretched(Reading x, Ratio ratio) {
    const uint32_t product = static_cast<uint32_t>(core::multiply_signed(x, ratio));
    return static_cast<Reading>(core::upper_half(static_cast<int32_t>(product * 4 + 0x8000)));
  }
  static Ratio ratio(Reading x, Inverse per_half) {
    const uint16_t size = static_cast<uint16_t>(x < 0 ? -x : x);
    const uint32_t ratio = (static_cast<uint32_t>(core::multiply(size, per_half)) << 1) >> 8;
    const Ratio most = ratio > kMostStretch ? kMostStretch : static_cast<Ratio>(ratio);
    return x < 0 ? static_cast<Ratio>(-most) : most;
  }
  // 1 - 1 / (p + 1). The quotient has eight bits, for which the compiler's division takes sixteen steps.
  static Variance share(Variance p) {
    const uint16_t divisor = static_cast<uint16_t>(p + kOne);
    uint16_t rest = 255;
    uint8_t quotient = 0;
    for (uint8_t bit = 8; bit > 0; --bit) {
      const bool beyond = (rest & 0x8000) != 0;
      rest = static_cast<uint16_t>(rest << 1 | 1);
      quotient = static_cast<uint8_t>(quotient << 1);
      if (!beyond && rest < divisor) continue;
      rest = static_cast<uint16_t>(rest - divisor);
      ++quotient;
    }
    return static_cast<Variance>(kOne - quotient);
  }
  static Reading shared(Reading x, Variance share) {
    const int32_t product = core::multiply_signed(x, static_cast<int16_t>(share));
    return static_cast<Reading>((product + 128) >> 8);
  }
  static Variance grown(Variance p, uint16_t ticks, Growth growth) {
    const uint32_t sum = p + (static_cast<uint32_t>(core::multiply(ticks, growth)) >> 8);
    return sum > kMostVariance ? kMostVariance : static_cast<Variance>(sum);
  }
};

template <class Real>
struct RealTracking {
  using Reading = Real;
  using Ratio = Real;
  using Variance = Real;
  using Growth = Real;
  using Inverse = Real;
  static constexpr Real kMostStretch = Real(0.25);
  static constexpr Real kStretchStep = Real(41) / (1 << 14);
  static constexpr Real kStretchBand = Real(655) / (1 << 14);
  static constexpr Real kOne = 1;
  static constexpr Real kMostVariance = 250;

  template <uint8_t kShift>
  static Real part(Real x) {
    return x / static_cast<Real>(1 << kShift);
  }
  static Real stretched(Real x, Real ratio) { return x * ratio; }
  static Real ratio(Real x, Real per_half) { return x * per_half; }
  static Real share(Real p) { return p / (p + 1); }
  static Real shared(Real x, Real share) { return x * share; }
  static Real grown(Real p, uint16_t ticks, Real growth) {
    const Real sum = p + static_cast<Real>(ticks) * growth;
    return sum > kMostVariance ? kMostVariance : sum;
  }
};

// The same for all sensors.
template <class A>
struct TrackerSettings {
  typename A::Variance shift;    // before the first bend
  typename A::Variance stretch;  // likewise
  typename A::Growth growth;     // of the shift's variance in a tick
};

// Of one sensor, in its unit; half 0: it is not tracked.
template <class A>
struct TrackedSensor {
  typename A::Reading middle;
  typename A::Reading half;      // in int16 33 to 16383
  typename A::Reading noise;     // N, standard deviation of a whole bend's middle, above 0, in int16 to 511
  typename A::Reading max_step;  // of the shift in a tick, above 0
  typename A::Inverse per_half;
};

template <class A>
class Tracker {
 public:
  using Reading = typename A::Reading;

  void reset(const TrackerSettings<A>& c) {
    *this = Tracker();
    shift_variance_ = c.shift;
    stretch_variance_ = c.stretch;
  }

  // Any reading, at any rate.
  FLEXOR_SHARED Reading corrected(const TrackedSensor<A>& sensor, Reading x) const {
    return moved(sensor, x, shift_, stretch_);
  }

  // A tick, with a reading of a living sensor. What a bend shows is worked out over the ticks after it, so that none
  // takes long.
  void observe(const TrackerSettings<A>& c, const TrackedSensor<A>& sensor, Reading x) {
    if (since_ < UINT16_MAX) ++since_;
    if (stage_ != Stage::follow) return work(c, sensor, x);
    follow(sensor, x);
    const Reading back = has(kFalling) ? core::subtract(level_, peak_) : core::subtract(peak_, level_);
    const bool rests = held_ >= kHeld;
    // A rest takes the place of what was farther by less than the band but only passed.
    if (back <= 0 || (rests && !has(kPeakHeld) && back < A::template part<3>(sensor.half))) {
      peak_ = level_;
      put(kPeakHeld, rests);
    } else if (back > A::template part<1>(sensor.half) + A::template part<3>(sensor.half)) {
      return turn();
    }
    use(sensor);
  }

  Reading shift() const { return shift_; }
  typename A::Ratio stretch() const { return stretch_; }
  typename A::Variance shift_variance() const { return shift_variance_; }
  // A whole bend has just been seen: where its middle lies, and half its reach.
  bool has_bend() const { return stage_ == Stage::measure; }
  Reading bend_middle() const {
    return has(kFalling) ? core::subtract(turn_, peak_) : core::add(turn_, peak_);
  }
  Reading bend_half() const { return peak_; }
  bool alarm() const { return surprises_ >= kAlarm || surprises_ <= -kAlarm; }

 private:
  static constexpr uint8_t kHeld = 5;  // ticks within the band: a turn that was rested at
  static constexpr int8_t kAlarm = 3;
  enum Flag : uint8_t { kFalling = 1, kPeakHeld = 2, kTurnHeld = 4, kStarted = 8, kTurned = 16, kBent = 32 };
  enum class Stage : uint8_t {
    follow,
    weigh,
    measure,
    doubt,
    compare,
    surprise,
    sharpen_shift,
    move_shift,
    weigh_stretch,
    sharpen_stretch,
    share_stretch,
    move_stretch
  };

  static Reading moved(const TrackedSensor<A>& sensor, Reading x, Reading shift, typename A::Ratio stretch) {
    const Reading shifted = core::add(x, shift);
    if (stretch == 0) return shifted;
    return core::add(shifted, A::stretched(core::subtract(x, sensor.middle), stretch));
  }

  bool has(uint8_t flag) const { return (flags_ & flag) != 0; }
  void put(uint8_t flag, bool on) {
    flags_ = static_cast<uint8_t>(on ? flags_ | flag : flags_ & static_cast<uint8_t>(~flag));
  }

  template <class Number>
  static Number nearer(Number from, Number to, Number step) {
    return core::add(from, core::clamp(core::subtract(to, from), static_cast<Number>(-step), step));
  }

  void use(const TrackedSensor<A>& sensor) {
    if (shift_ != shift_found_ && (shift_ != 0 || is_beyond(shift_found_, sensor.noise))) {
      shift_ = nearer(shift_, shift_found_, sensor.max_step);
    } else if (stretch_ != stretch_found_ && (stretch_ != 0 || is_beyond(stretch_found_, A::kStretchBand))) {
      stretch_ = nearer(stretch_, stretch_found_, A::kStretchStep);
    }
  }

  // From none, what was found is taken only beyond what a hand's own bends lie off by from one minute to the next.
  template <class Number>
  static bool is_beyond(Number found, Number band) {
    return found > band || found < -band;
  }
  void follow(const TrackedSensor<A>& sensor, Reading x) {
    if (!has(kStarted)) {
      put(kStarted, true);
      level_ = peak_ = x;
    }
    const Reading band = A::template part<3>(sensor.half);
    const Reading ahead = core::subtract(x, level_);
    const Reading within = core::clamp(ahead, static_cast<Reading>(-band), band);
    if (ahead != within) {
      held_ = 0;
    } else if (held_ < kHeld) {
      ++held_;
    }
    level_ = core::add(core::subtract(x, within), A::template part<2>(within));
  }

  // The first turn was none: where the finger was at the start.
  void turn() {
    const bool is_bend = has(kBent) && has(kPeakHeld) && has(kTurnHeld);
    const Reading before = turn_;
    turn_ = peak_;
    peak_ = is_bend ? before : level_;
    if (is_bend) stage_ = Stage::weigh;
    put(kBent, has(kTurned));
    put(kTurned, true);
    put(kTurnHeld, has(kPeakHeld));
    put(kFalling, !has(kFalling));
    put(kPeakHeld, false);
  }

  // A bend, from peak_ to turn_: nothing is followed meanwhile, and what it needs lies in peak_ and level_. A stage
  // holds one division or some products.
  FLEXOR_SHARED void work(const TrackerSettings<A>& c, const TrackedSensor<A>& sensor, Reading x) {
    switch (stage_) {
      case Stage::weigh:
        stage_ = weigh(c, sensor);
        break;
      case Stage::measure:
        measure(sensor);
        stage_ = Stage::doubt;
        break;
      case Stage::doubt:
        level_ = beyond(level_, lacks_reach(sensor, stretch_));
        stage_ = Stage::compare;
        break;
      case Stage::compare:
        stage_ = compare(sensor);
        break;
      case Stage::surprise:
        surprise(sensor);
        stage_ = Stage::weigh_stretch;
        break;
      case Stage::sharpen_shift:
        shift_variance_ = A::share(shift_variance_);
        stage_ = Stage::move_shift;
        break;
      case Stage::move_shift:
        shift_found_ = core::add(shift_found_, A::shared(level_, shift_variance_));
        stage_ = Stage::weigh_stretch;
        break;
      case Stage::weigh_stretch:
        level_ = lacks_reach(sensor, stretch_found_);
        stage_ = level_ < 0 ? Stage::sharpen_stretch : Stage::share_stretch;
        break;
      case Stage::sharpen_stretch:
        stretch_variance_ = A::share(stretch_variance_);
        stage_ = Stage::share_stretch;
        break;
      case Stage::share_stretch:
        level_ = share_stretch(sensor);
        stage_ = Stage::move_stretch;
        break;
      default:
        stretch_found_ = core::clamp(core::add(stretch_found_, A::ratio(level_, sensor.per_half)),
                                     static_cast<typename A::Ratio>(-A::kMostStretch), A::kMostStretch);
        stage_ = Stage::follow;
    }
    if (stage_ != Stage::follow) return;
    level_ = peak_ = x;
    held_ = 0;
  }

  // Half the bend's reach goes to peak_.
  Stage weigh(const TrackerSettings<A>& c, const TrackedSensor<A>& sensor) {
    const Reading reach = has(kFalling) ? core::subtract(turn_, peak_) : core::subtract(peak_, turn_);
    peak_ = A::template part<1>(reach);
    const Reading tolerance = A::template part<3>(sensor.half) + A::template part<5>(sensor.half);
    if (core::subtract(sensor.half, peak_) > tolerance) return Stage::follow;
    shift_variance_ = A::grown(shift_variance_, since_, c.growth);
    since_ = 0;
    return Stage::measure;
  }

  // What the shift lacks goes to level_.
  void measure(const TrackedSensor<A>& sensor) {
    level_ = core::subtract(sensor.middle, moved(sensor, bend_middle(), shift_found_, stretch_found_));
  }

  // Of half the range, by the bend in peak_; below 0: it went farther.
  Reading lacks_reach(const TrackedSensor<A>& sensor, typename A::Ratio stretch) const {
    return core::subtract(sensor.half, core::add(peak_, A::stretched(peak_, stretch)));
  }

  // What of x lies more than `doubt` away from 0.
  static Reading beyond(Reading x, Reading doubt) {
    if (doubt <= 0) return x;
    if (x > 0) return x > doubt ? static_cast<Reading>(x - doubt) : Reading(0);
    return -x > doubt ? static_cast<Reading>(x + doubt) : Reading(0);
  }

  Stage compare(const TrackedSensor<A>& sensor) {
    const Reading bound = reach(sensor.noise, shift_variance_);
    if (level_ > bound || level_ < -bound) return Stage::surprise;
    surprises_ = 0;
    return Stage::sharpen_shift;
  }

  // The second to one side is believed, up to the bound.
  void surprise(const TrackedSensor<A>& sensor) {
    const bool again = level_ > 0 ? surprises_ > 0 : surprises_ < 0;
    if (!again) surprises_ = 0;
    if (!alarm()) surprises_ = static_cast<int8_t>(level_ > 0 ? surprises_ + 1 : surprises_ - 1);
    if (!again) return;
    const Reading bound = reach(sensor.noise, shift_variance_);
    shift_found_ = core::add(shift_found_, level_ > 0 ? bound : static_cast<Reading>(-bound));
  }

  Reading share_stretch(const TrackedSensor<A>& sensor) const {
    const Reading bound = 3 * sensor.noise;
    const Reading lacks = core::clamp(level_, static_cast<Reading>(-bound), bound);
    const typename A::Variance share = stretch_variance_ < A::kOne ? stretch_variance_ : A::kOne;
    return A::shared(lacks > 0 ? A::template part<3>(lacks) : lacks, share);
  }

  // N sqrt(p + 1) to 2 N sqrt(p + 1).
  static Reading reach(Reading noise, typename A::Variance p) {
    typename A::Variance q = static_cast<typename A::Variance>(p + A::kOne);
    Reading out = 2 * noise;
    for (; q >= 4 * A::kOne; out = static_cast<Reading>(2 * out))
      q = static_cast<typename A::Variance>(q / 4);
    return out;
  }

  Reading level_ = 0;
  Reading peak_ = 0;   // farthest level since the last turn
  Reading turn_ = 0;   // the last one
  Reading shift_ = 0;  // in use
  Reading shift_found_ = 0;
  typename A::Ratio stretch_ = 0;
  typename A::Ratio stretch_found_ = 0;
  typename A::Variance shift_variance_ = 0;
  typename A::Variance stretch_variance_ = 0;
  uint16_t since_ = 0;  // ticks since the shift was last learnt
  Stage stage_ = Stage::follow;
  uint8_t held_ = 0;
  uint8_t flags_ = 0;
  int8_t surprises_ = 0;  // in a row; below 0: downwards
};

}  // namespace sensor
}  // namespace flexor
