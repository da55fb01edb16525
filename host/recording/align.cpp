#include "host/recording/align.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <numbers>
#include <numeric>
#include <unsupported/Eigen/FFT>

#include "host/io/io.hpp"
#include "host/recording/resample.hpp"
#include "host/recording/sensor_lag.hpp"

namespace flexor::recording {
namespace {

constexpr double kRate_hz = 20;  // of both while they are compared
constexpr double kExplainedRate_hz = 5;
constexpr double kMinOverlap_s = 2;
constexpr double kMinOverlapShare = 0.4;
constexpr double kMinEtaSquared = 0.4;
constexpr double kMinVelocityCorrelation = 0.3;
constexpr double kRelated = 0.7;      // velocities that correlate less are hardly of one motion
constexpr double kLeastError = 1e-6;  // of what is left unexplained
constexpr double kMinDriftOverlap_s = 20;
constexpr double kLeastJump_s = 0.2;
constexpr double kBesideJump = 0.3;  // of it, from piece to piece before and after
constexpr double kQuarterError_s = 0.1;
constexpr double kMinPieceEnergy = 0.08;      // of the mean
constexpr double kMinMismatchOverlap_s = 60;  // quarters of less tell the offset too badly to refuse by it
// RC oscillators stay within 10000 ppm, ceramic resonators within 5000, crystals within 100; a fifth more for
// the error of the measurement.
constexpr double kMaxDrift_ppm = 12000;
constexpr double kRight_s = 0.15;
constexpr double kDisagreement_s = 0.15;   // and
constexpr double kDisagreementErrors = 4;  // standard errors
constexpr double kTapped_s = 0.5;          // from the taps' offset to that of all motion
constexpr double kTappedWorse = 0.15;      // in eta^2, than the best offset
constexpr double kTappedGain = 3;          // Evidence::gain of taps that agree, at least
constexpr double kNoGain = 0.12;           // an offset whose gain is less explains almost as much
constexpr double kGainError = 0.1;         // of a second alone, standard error
constexpr double kValley = 0.3;            // as a gain, of what lies between two answers
constexpr double kOverlap = 9.1;           // of the log odds, for the overlap's share
constexpr double kMostAnyway = 1e6;        // samples of a log, and
constexpr double kMostPerReading = 60;
constexpr int kMaxBins = 12;

// Of taps:
constexpr double kOutliers = 0.02;  // share of the readings beyond either end of the range
constexpr double kSwing = 0.25;     // least, of the range
constexpr double kRests = 0.1;      // most, of the range
constexpr double kRest_s = 1;
constexpr double kNear_s = 0.8;  // from the first and the last bend to the rest beside it
constexpr double kLeastApart_s = 0.3;
constexpr double kMostApart_s = 1.5;
constexpr double kUneven = 1.6;

// What short recordings need otherwise: all constant from half a minute on.
struct Scales {
  double smoothing_s;
  double reach_s;  // of the fine search
  double min_overlap_s;
  int bins;

  explicit Scales(double shorter_s)
      : smoothing_s(recording::smoothing_s(shorter_s)),
        reach_s(3 * smoothing_s),
        min_overlap_s(std::max(kMinOverlap_s, kMinOverlapShare * shorter_s)),
        bins(std::clamp(static_cast<int>(std::sqrt(5 * shorter_s)), 4, kMaxBins)) {}
};

// A signal evenly sampled on its own clock, with a weight of zero in gaps.
struct Sampled {
  double period_s = 0;
  std::vector<double> value;
  std::vector<std::uint8_t> good;

  double measured_s() const { return period_s * static_cast<double>(std::ranges::count(good, 1)); }
};

// The mean of the readings within half a period; where there are none, the straight line between their
// neighbours. It looks ahead, and must: what holds readings back would look like an offset of the clocks.
Sampled sample(const Series& series, double rate_hz) {
  const std::vector<double> t = since_start(series.t_s);
  const Range range = without_spikes(series.value);
  std::vector<double> x(series.value.begin(), series.value.end());
  for (double& value : x) value = std::clamp(value, range.min, range.max);
  const double max_gap_s = default_max_gap_s(t);
  Sampled out{1 / rate_hz, {}, {}};
  std::size_t next = 0;        // first reading at or after the instant
  std::size_t cell_begin = 0;  // first reading of the cell around it
  for (std::size_t k = 0; static_cast<double>(k) * out.period_s <= t.back(); ++k) {
    const double now = static_cast<double>(k) * out.period_s;
    while (next < t.size() && t[next] < now) ++next;
    while (cell_begin < t.size() && t[cell_begin] < now - out.period_s / 2) ++cell_begin;
    double sum = 0;
    std::size_t count = 0;
    for (std::size_t i = cell_begin; i < t.size() && t[i] < now + out.period_s / 2; ++i, ++count) sum += x[i];
    const std::size_t before = next > 0 ? next - 1 : 0;
    const std::size_t after = std::min(next, t.size() - 1);
    const double width = t[after] - t[before];
    const double share = width > 0 ? (now - t[before]) / width : 0;
    out.value.push_back(count > 0 ? sum / static_cast<double>(count)
                                  : x[before] + share * (x[after] - x[before]));
    out.good.push_back(width <= max_gap_s);
  }
  return out;
}

// Before memory is asked for: two clocks in one log, or a pause of days.
void check_span(const Series& series) {
  const auto t = series.t_s;
  const double readings = static_cast<double>(t.size());
  if ((t.back() - t.front()) * kRate_hz <= kMostAnyway + kMostPerReading * readings) return;
  std::size_t widest = 1;
  for (std::size_t i = 1; i < t.size(); ++i)
    if (t[i] - t[i - 1] > t[widest] - t[widest - 1]) widest = i;
  throw io::JobError("a log pauses from {:.1f} s to {:.1f} s, far longer than it runs: cut it there",
                     t[widest - 1], t[widest]);
}

// Of each value of the sensor that is good its bin, of so many of equal count.
std::vector<int> bins_of(const Sampled& sensor, int bins) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < sensor.value.size(); ++i)
    if (sensor.good[i]) order.push_back(i);
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return sensor.value[i]; });
  std::vector<int> out(sensor.value.size(), -1);
  for (std::size_t rank = 0; rank < order.size(); ++rank) {
    // Equal values share a bin: a sensor at rest must not be split by the order of its samples.
    const bool tie = rank > 0 && sensor.value[order[rank]] == sensor.value[order[rank - 1]];
    out[order[rank]] =
        tie ? out[order[rank - 1]] : static_cast<int>(rank * static_cast<std::size_t>(bins) / order.size());
  }
  return out;
}

// Sensor sample i lies on reference sample i + lag.
struct Overlap {
  std::ptrdiff_t begin;
  std::ptrdiff_t end;
  std::ptrdiff_t lag;
  Overlap(const Sampled& sensor, const Sampled& reference, std::ptrdiff_t shift)
      : begin(std::max<std::ptrdiff_t>(0, -shift)),
        end(std::min(std::ssize(sensor.value), std::ssize(reference.value) - shift)),
        lag(shift) {}
};

struct Scan {
  std::vector<std::ptrdiff_t> lag;
  std::vector<double> eta_squared;
  std::vector<double> score;
  std::vector<double> share;  // that overlaps, of the shorter recording
  double seconds = 0;         // of the shorter recording
};

// c[lag] = sum_i a[i] b[i + lag] for all lags at once, by discrete Fourier transforms of zero-padded signals:
// O(n log n), where the sums one by one would be O(n^2). Negative lags are counted from the
// end.
class CrossCorrelator {
 public:
  using Spectrum = std::vector<std::complex<double>>;

  explicit CrossCorrelator(std::size_t samples) : size_(std::bit_ceil(samples)) {
    fft_.SetFlag(Eigen::FFT<double>::HalfSpectrum);
  }
  Spectrum spectrum(std::vector<double> signal) {
    signal.resize(size_);
    Spectrum out;
    fft_.fwd(out, signal);
    return out;
  }
  std::vector<double> correlate(const Spectrum& a, const Spectrum& b) {
    Spectrum product(a.size());
    std::ranges::transform(a, b, product.begin(), [](auto x, auto y) { return std::conj(x) * y; });
    std::vector<double> out;
    fft_.inv(out, product, static_cast<Eigen::Index>(size_));
    return out;
  }
  std::size_t index(std::ptrdiff_t lag) const { return static_cast<std::size_t>(lag) & (size_ - 1); }
  std::size_t size() const { return size_; }

 private:
  std::size_t size_;
  Eigen::FFT<double> fft_;
};

// For every lag: the good samples that overlap, the sums of the reference and of its square over them, and
// the squared sums of the bins over their counts.
struct Sums {
  std::vector<double> n;
  std::vector<double> sum;
  std::vector<double> sum_squares;
  std::vector<double> between;
};

Sums sums_over_lags(CrossCorrelator& correlator, const Sampled& sensor, int bins,
                    const std::vector<double>& y, const std::vector<std::uint8_t>& good) {
  const std::size_t size = correlator.size();
  Sums out{std::vector<double>(size), std::vector<double>(size), {}, std::vector<double>(size)};
  std::vector<double> square(y.size());
  std::ranges::transform(y, square.begin(), [](double v) { return v * v; });
  const auto y_spectrum = correlator.spectrum(y);
  const auto good_spectrum = correlator.spectrum({good.begin(), good.end()});
  const std::vector<int> bin_of = bins_of(sensor, bins);
  for (int bin = 0; bin < bins; ++bin) {
    std::vector<double> member(sensor.value.size());
    for (std::size_t i = 0; i < member.size(); ++i) member[i] = bin_of[i] == bin ? 1 : 0;
    const auto spectrum = correlator.spectrum(std::move(member));
    const auto count = correlator.correlate(spectrum, good_spectrum);
    const auto sum = correlator.correlate(spectrum, y_spectrum);
    for (std::size_t i = 0; i < size; ++i) {
      const double whole = std::round(count[i]);
      if (whole < 1) continue;
      out.n[i] += whole;
      out.sum[i] += sum[i];
      out.between[i] += sum[i] * sum[i] / whole;
    }
  }
  out.sum_squares = correlator.correlate(correlator.spectrum({sensor.good.begin(), sensor.good.end()}),
                                         correlator.spectrum(std::move(square)));
  return out;
}

Scan scan(const Sampled& sensor, int bins, const Sampled& reference, double least) {
  const auto n = std::ssize(sensor.value);
  const auto m = std::ssize(reference.value);
  const auto needed = static_cast<std::ptrdiff_t>(least);
  const double mean = std::accumulate(reference.value.begin(), reference.value.end(), 0.0) /
                      static_cast<double>(std::max<std::ptrdiff_t>(m, 1));
  std::vector<double> y(reference.value.size());  // about its mean, zero in gaps
  for (std::size_t i = 0; i < y.size(); ++i) y[i] = reference.good[i] ? reference.value[i] - mean : 0;
  const double energy = std::inner_product(y.begin(), y.end(), y.begin(), 0.0);
  CrossCorrelator correlator(static_cast<std::size_t>(n + m));
  const Sums sums = sums_over_lags(correlator, sensor, bins, y, reference.good);
  Scan result;
  result.seconds = std::min(sensor.measured_s(), reference.measured_s());
  for (std::ptrdiff_t lag = needed - n; lag <= m - needed; ++lag) {
    const Overlap overlap(sensor, reference, lag);
    if (overlap.end - overlap.begin < needed) continue;
    const std::size_t i = correlator.index(lag);
    if (sums.n[i] < std::max(2.0, 0.5 * static_cast<double>(needed))) continue;  // mostly pauses
    const double mean_term = sums.sum[i] * sums.sum[i] / sums.n[i];
    const double total = sums.sum_squares[i] - mean_term;
    // A reference at rest has nothing to explain; below the threshold only rounding is left.
    const bool at_rest = total <= 1e-10 * energy;
    const double eta_squared = at_rest ? 0 : std::clamp((sums.between[i] - mean_term) / total, 0.0, 1.0);
    result.lag.push_back(lag);
    result.eta_squared.push_back(eta_squared);
    result.share.push_back(sums.n[i] * sensor.period_s / result.seconds);
    result.score.push_back(-sums.n[i] * std::log(std::max(1 - eta_squared, 1e-9)));
  }
  return result;
}

// The offsets beside the best one that are another answer: local maxima behind an offset that explains clearly less.
struct Rivals {
  std::optional<std::size_t> strongest;  // explains most
  double gain = 0;                       // log of what it leaves unexplained over what the best one does
  double as_good = 0;  // how many explain as much, each by how likely its overlap is beside that of the best
};

// What the offset leaves unexplained, at the top of the parabola through it and its neighbours.
double unexplained(const Scan& scan, std::size_t i) {
  double out = 1 - scan.eta_squared[i];
  if (i > 0 && i + 1 < scan.eta_squared.size()) {
    const double before = scan.eta_squared[i - 1];
    const double after = scan.eta_squared[i + 1];
    const double curvature = before - 2 * scan.eta_squared[i] + after;
    if (curvature < 0) out += (after - before) * (after - before) / (8 * curvature);
  }
  return std::max(out, kLeastError);
}

Rivals rivals_of(const Scan& scan, std::size_t best) {
  const double least = unexplained(scan, best);
  Rivals out{{}, -std::log(least), 0};
  for (const int way : {-1, 1}) {
    double between = 0;  // the most that is left unexplained on the way
    for (std::ptrdiff_t k = static_cast<std::ptrdiff_t>(best) + way; k > 0 && k + 1 < std::ssize(scan.lag);
         k += way) {
      const auto i = static_cast<std::size_t>(k);
      between = std::max(between, 1 - scan.eta_squared[i]);
      const double left = unexplained(scan, i);
      const bool is_top =
          scan.eta_squared[i] >= scan.eta_squared[i - 1] && scan.eta_squared[i] >= scan.eta_squared[i + 1];
      if (!is_top || std::log(between / std::max(left, least)) < kValley) continue;
      const double gain = std::max(0.0, std::log(left / least));
      const double deviations = gain / kGainError * std::sqrt(scan.seconds);
      out.as_good += std::exp(kOverlap * (scan.share[i] - scan.share[best]) - deviations * deviations / 2);
      if (out.strongest && gain >= out.gain) continue;
      out.strongest = i;
      out.gain = gain;
    }
  }
  return out;
}

// Smoothed velocity; not good within three standard deviations of a gap or an end.
Sampled velocity(const Sampled& signal, double smoothing_s) {
  const std::vector<double> kernel = derivative_kernel(smoothing_s / signal.period_s);
  const std::ptrdiff_t reach = std::ssize(kernel) / 2;
  Sampled out{signal.period_s, std::vector<double>(signal.value.size(), 0.0),
              std::vector<std::uint8_t>(signal.value.size(), 0)};
  for (std::ptrdiff_t i = reach; i + reach < std::ssize(signal.value); ++i) {
    double sum = 0;
    bool good = true;
    for (std::ptrdiff_t k = -reach; k <= reach; ++k) {
      const auto at = static_cast<std::size_t>(i + k);
      sum += kernel[static_cast<std::size_t>(k + reach)] * signal.value[at];
      good = good && signal.good[at];
    }
    out.value[static_cast<std::size_t>(i)] = sum;
    out.good[static_cast<std::size_t>(i)] = good;
  }
  return out;
}

// |r|: a sensor may fall where the angle rises.
double correlation(const Sampled& a, const Sampled& b, std::ptrdiff_t lag, std::ptrdiff_t begin,
                   std::ptrdiff_t end) {
  const Overlap overlap(a, b, lag);
  double aa = 0;
  double bb = 0;
  double ab = 0;
  for (std::ptrdiff_t i = std::max(begin, overlap.begin); i < std::min(end, overlap.end); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const auto r = static_cast<std::size_t>(i + lag);
    if (!a.good[k] || !b.good[r]) continue;
    aa += a.value[k] * a.value[k];
    bb += b.value[r] * b.value[r];
    ab += a.value[k] * b.value[r];
  }
  return aa > 0 && bb > 0 ? std::abs(ab) / std::sqrt(aa * bb) : 0;
}

struct Peak {
  double lag;          // in samples, with fraction
  double correlation;  // of the velocities there
};

// The velocities' largest correlation near `around`, over sensor samples [begin, end); none when it lies at
// the edge of the search or is weak.
std::optional<Peak> refine(const Sampled& a, const Sampled& b, double around, double reach_s,
                           std::ptrdiff_t begin, std::ptrdiff_t end) {
  const auto centre = static_cast<std::ptrdiff_t>(std::lround(around));
  const auto reach = static_cast<std::ptrdiff_t>(reach_s * kRate_hz);
  std::vector<double> r;
  for (std::ptrdiff_t d = -reach; d <= reach; ++d) r.push_back(correlation(a, b, centre + d, begin, end));
  const auto peak = std::ranges::max_element(r) - r.begin();
  if (peak == 0 || peak + 1 == std::ssize(r)) return std::nullopt;
  const auto p = static_cast<std::size_t>(peak);
  if (r[p] < kMinVelocityCorrelation) return std::nullopt;
  const double curvature = r[p - 1] - 2 * r[p] + r[p + 1];
  const double fraction = curvature < 0 ? (r[p - 1] - r[p + 1]) / (2 * curvature) : 0;
  return Peak{static_cast<double>(centre - reach + peak) + fraction, r[p]};
}

// Straight line through the quarters' offsets: drift. Throws io::JobError when it is clear and larger than any clock's.
void check_drift(Alignment& result) {
  std::vector<double> x;
  std::vector<double> y;
  for (std::size_t q = 0; q < 4; ++q) {
    if (!result.quarter_offset_s[q]) continue;
    x.push_back((static_cast<double>(q) - 1.5) / 4 * result.overlap_s);
    y.push_back(*result.quarter_offset_s[q]);
  }
  if (x.size() < 3) return;
  Eigen::MatrixXd a(static_cast<Eigen::Index>(x.size()), 2);
  a.col(0).setOnes();
  a.col(1) = Eigen::Map<const Eigen::VectorXd>(x.data(), a.rows());
  const Eigen::Map<const Eigen::VectorXd> b(y.data(), a.rows());
  const Eigen::Vector2d line = a.colPivHouseholderQr().solve(b);
  const Eigen::VectorXd residual = b - a * line;
  const double scatter = residual.cwiseAbs().maxCoeff();
  const double ppm = line(1) * 1e6;
  const bool clear = std::abs(line(1) * result.overlap_s) > 3 * scatter;
  const double error_ppm = 2e6 * std::max(scatter, kQuarterError_s) / result.overlap_s;
  const bool enough = x.size() == 4 && result.overlap_s >= kMinMismatchOverlap_s;
  if (enough && clear && std::abs(ppm) - error_ppm > kMaxDrift_ppm) {
    throw io::JobError(
        "the recordings do not belong together: one clock would have to run {:.1f} % {} than the "
        "other ({:+.0f} ppm), real ones stay within 1 %; are they of the same take and is each time "
        "column in the right unit?",
        std::abs(ppm) / 1e4, ppm > 0 ? "faster" : "slower", ppm);
  }
  if (std::abs(ppm) > kMaxDrift_ppm) {  // no clock, and too short or too unclear to refuse it
    if (clear) {
      result.warnings.push_back(fmt::format(
          "the offset wanders by {:+.2f} s over {:.0f} s, more than any clock: are the recordings "
          "of the same take?",
          line(1) * result.overlap_s, result.overlap_s));
    }
    return;
  }
  result.drift_ppm = ppm;
}

double energy(const Sampled& reference, std::ptrdiff_t begin, std::ptrdiff_t end, std::ptrdiff_t lag) {
  double sum = 0;
  for (std::ptrdiff_t i = begin; i < end; ++i) {
    const auto r = static_cast<std::size_t>(i + lag);
    if (reference.good[r]) sum += reference.value[r] * reference.value[r];
  }
  return sum;
}

// The offset in a part of the overlap, in the middle of which the sensor's clock is at `at_s`.
struct Piece {
  double at_s;
  double offset_s;
};

// Where the offset steps, by rows that were lost or a clock that was set, and hardly moves before and after: once in four pieces,
// of more as often as two pieces at least lie between.
std::optional<std::string> find_jump(const std::vector<Piece>& pieces) {
  const std::size_t least = pieces.size() > 4 ? 2 : 1;
  std::string jumps;
  double smallest_s = INFINITY;
  double beside_s = 0;
  std::size_t even = 1;  // pieces since the last step
  for (std::size_t i = 1; i < pieces.size(); ++i, ++even) {
    const double by_s = pieces[i].offset_s - pieces[i - 1].offset_s;
    if (std::abs(by_s) < kLeastJump_s) {
      beside_s = std::max(beside_s, std::abs(by_s));
      continue;
    }
    if (even < least || (least == 1 && !jumps.empty())) return std::nullopt;
    smallest_s = std::min(smallest_s, std::abs(by_s));
    jumps += fmt::format("{}{:+.2f} s between {:.0f} and {:.0f} s", jumps.empty() ? "" : ", ", by_s,
                         pieces[i - 1].at_s, pieces[i].at_s);
    even = 0;
  }
  if (jumps.empty() || pieces.size() < 4 || even < least || beside_s > kBesideJump * smallest_s)
    return std::nullopt;
  return "the clocks' offset jumps by " + jumps +
         " of the sensor's: were rows lost, or a clock set? Cut both logs there, and give each part as a "
         "--pair";
}

// The offset in each quarter of the overlap, and the jump or the drift that they show; a short overlap has no quarters.
void find_quarters(const Sampled& a, const Sampled& b, const Overlap& overlap, double lag, double reach_s,
                   double sensor_s, double reference_s, Alignment& result) {
  if (result.overlap_s < kMinDriftOverlap_s) return;
  const auto length = overlap.end - overlap.begin;
  const double whole = energy(b, overlap.begin, overlap.end, overlap.lag);
  for (const std::ptrdiff_t count : {4, 12}) {
    std::vector<Piece> pieces;
    for (std::ptrdiff_t q = 0; q < (result.overlap_s < 5 * static_cast<double>(count) ? 0 : count); ++q) {
      const auto begin = overlap.begin + length * q / count;
      const auto end = overlap.begin + length * (q + 1) / count;
      // Of a piece at rest only noise would vote.
      if (energy(b, begin, end, overlap.lag) * static_cast<double>(count) < kMinPieceEnergy * whole) continue;
      const auto peak = refine(a, b, lag, reach_s, begin, end);
      if (!peak) continue;
      pieces.push_back({sensor_s + static_cast<double>(begin + end) / 2 / kRate_hz,
                        reference_s - sensor_s + peak->lag / kRate_hz});
      if (count == 4) result.quarter_offset_s[static_cast<std::size_t>(q)] = pieces.back().offset_s;
    }
    if (const auto jump = find_jump(pieces)) result.jump = jump;
  }
  if (result.jump) return result.warnings.push_back(*result.jump);
  check_drift(result);
}

// That the offset is right. Of the overlap its share of the shorter recording.
double probability(const Alignment& found, double overlap_share, const Rivals& rivals) {
  const double r = found.velocity_correlation;
  const double log_odds = -12.7 + 5.5 * r * r + kOverlap * overlap_share + 1.6 * std::sqrt(rivals.gain);
  const double error_s = found.clock_offset_se_s.value_or(kVelocityError_s);
  return std::erf(kRight_s / (std::numbers::sqrt2 * 1.6 * error_s)) / (1 + std::exp(-log_odds)) /
         (1 + rivals.as_good);
}

std::string low_confidence(const Alignment& found, const Rivals& rivals) {
  if (rivals.as_good < 1 && found.velocity_correlation < kRelated)
    return fmt::format(
        "the two recordings hardly move together (their velocities correlate by {:.2f}): are they of the "
        "same take and finger?",
        found.velocity_correlation);
  return fmt::format(
      "the alignment is ambiguous: offset {:+.1f} s explains almost as much as {:+.1f} s; record a motion "
      "that does not repeat itself",
      found.rival_offset_s.value_or(0), found.clock_offset_s);
}

double range_of(const Series& series) {
  std::vector<double> sorted(series.value.begin(), series.value.end());
  std::ranges::sort(sorted);
  const auto tail = static_cast<std::size_t>(kOutliers * static_cast<double>(sorted.size()));
  return sorted[sorted.size() - 1 - tail] - sorted[tail];
}

// Whether the series keeps its place there, at least `swing` from where a bend turns back.
bool rests(const Series& series, double from_s, double to_s, double range, double bend) {
  const auto from = std::ranges::lower_bound(series.t_s, from_s) - series.t_s.begin();
  const auto to = std::ranges::upper_bound(series.t_s, to_s) - series.t_s.begin();
  if (to - from < 2) return false;
  const auto [low, high] = std::minmax_element(series.value.begin() + from, series.value.begin() + to);
  return *high - *low <= kRests * range &&
         std::min(std::abs(*high - bend), std::abs(*low - bend)) >= kSwing * range;
}

// The lag of the scan that both recordings' taps ask for, where it explains nearly as much as the best.
std::optional<std::size_t> tapped_lag(const Series& sensor, const Series& reference, const Scan& scan,
                                      std::size_t best) {
  const auto sensed = taps(sensor);
  const auto seen = sensed ? taps(reference) : std::nullopt;
  if (!seen) return std::nullopt;
  double lag_s = sensor.t_s.front() - reference.t_s.front();
  for (std::size_t i = 0; i < 3; ++i) lag_s += ((*seen)[i] - (*sensed)[i]) / 3;
  std::optional<std::size_t> out;
  for (std::size_t i = 0; i < scan.lag.size(); ++i) {
    if (std::abs(static_cast<double>(scan.lag[i]) / kRate_hz - lag_s) > kTapped_s) continue;
    if (scan.eta_squared[i] < scan.eta_squared[best] - kTappedWorse) continue;
    if (!out || scan.score[i] > scan.score[*out]) out = i;
  }
  return out;
}

// Stage 1: the lag that explains most, and what else it could be.
std::pair<double, Rivals> find_lag(const Series& sensor, const Series& reference, const Sampled& sensed,
                                   const Sampled& seen, const Scales& scales, Alignment& result) {
  const Scan scanned = scan(sensed, scales.bins, seen, scales.min_overlap_s * kRate_hz);
  if (scanned.score.empty()) {
    throw io::JobError(
        "overlap too short: the recordings last {:.1f} s and {:.1f} s, alignment needs "
        "{:.1f} s of common motion; record longer",
        sensed.measured_s(), seen.measured_s(), scales.min_overlap_s);
  }
  auto best = static_cast<std::size_t>(std::ranges::max_element(scanned.score) - scanned.score.begin());
  if (const auto tapped = tapped_lag(sensor, reference, scanned, best)) {
    result.tapped = true;
    best = *tapped;
  }
  result.eta_squared = scanned.eta_squared[best];
  if (result.eta_squared < kMinEtaSquared) {
    throw io::JobError(
        "the recordings do not correlate: at the best offset the sensor explains {:.0f} % of the reference, "
        "at least {:.0f} % are needed; are they of the same motion and finger?",
        100 * result.eta_squared, 100 * kMinEtaSquared);
  }
  Rivals rivals = rivals_of(scanned, best);
  if (rivals.strongest)
    result.rival_offset_s = reference.t_s.front() - sensor.t_s.front() +
                            static_cast<double>(scanned.lag[*rivals.strongest]) / kRate_hz;
  if (result.tapped) rivals = {{}, std::max(rivals.gain, kTappedGain), 0};
  return {static_cast<double>(scanned.lag[best]), rivals};
}

// Stage 3: what of the offset is the sensor's own.
void tell_lag(const Series& sensor, const Series& reference, Alignment& result) {
  std::optional<double> near_ppm = result.drift_ppm;
  if (result.overlap_s >= kMinDriftOverlap_s && !near_ppm && !result.jump) near_ppm = 0;
  const auto found = sensor_lag(sensor, {reference}, result.clock_offset_s, near_ppm);
  if (!found) return;
  for (auto& quarter : result.quarter_offset_s) {
    if (quarter) *quarter += found->clock_offset_s - result.clock_offset_s;
  }
  result.sensor_lag_s = found->clock_offset_s - result.clock_offset_s;
  result.clock_offset_s = found->clock_offset_s;
  result.clock_offset_se_s = found->standard_error_s;
  if (!near_ppm) return;
  result.drift_ppm = found->drift_ppm;
  result.drift_se_ppm = found->drift_se_ppm;
}

}  // namespace

std::optional<std::array<double, 3>> taps(const Series& series) {
  const double range = range_of(series);
  if (!(range > 0)) return std::nullopt;
  const std::vector<std::size_t> ends = ends_of_ways(series.value, kSwing * range);
  std::optional<std::array<double, 3>> found;
  for (std::size_t i = 1; i + 5 < ends.size(); ++i) {
    const std::array<double, 3> t = {series.t_s[ends[i]], series.t_s[ends[i + 2]], series.t_s[ends[i + 4]]};
    const double first = t[1] - t[0];
    const double second = t[2] - t[1];
    const auto [shorter, longer] = std::minmax(first, second);
    if (shorter < kLeastApart_s || longer > kMostApart_s || longer > kUneven * shorter) continue;
    if (!rests(series, t[0] - kNear_s - kRest_s, t[0] - kNear_s, range, series.value[ends[i]])) continue;
    if (!rests(series, t[2] + kNear_s, t[2] + kNear_s + kRest_s, range, series.value[ends[i + 4]])) continue;
    if (found) return std::nullopt;
    found = t;
  }
  return found;
}

Alignment align(const Series& sensor, const Series& reference) {
  check_span(sensor);
  check_span(reference);
  const double start_difference = reference.t_s.front() - sensor.t_s.front();
  Alignment result;
  const Sampled sensed = sample(sensor, kRate_hz);
  const Sampled seen = sample(reference, kRate_hz);
  const double shorter_s = std::min(sensed.measured_s(), seen.measured_s());
  const Scales scales(shorter_s);
  const auto [coarse_lag, rivals] = find_lag(sensor, reference, sensed, seen, scales, result);
  const Sampled a = velocity(sensed, scales.smoothing_s);
  const Sampled b = velocity(seen, scales.smoothing_s);
  const auto refined = refine(a, b, coarse_lag, scales.reach_s, 0, std::ssize(a.value));
  if (!refined)
    result.warnings.emplace_back(
        "the velocities of the two recordings do not line up clearly: the offset is good to 0.2 s at best");
  const double lag = refined ? refined->lag : coarse_lag;
  result.velocity_correlation = refined ? refined->correlation : 0;
  result.clock_offset_s = start_difference + lag / kRate_hz;
  const auto whole_lag = static_cast<std::ptrdiff_t>(std::lround(lag));
  const Overlap overlap(a, b, whole_lag);
  const auto first = seen.good.begin() + overlap.begin + overlap.lag;
  result.overlap_s =
      static_cast<double>(std::count(first, first + (overlap.end - overlap.begin), 1)) / kRate_hz;

  find_quarters(a, b, overlap, lag, scales.reach_s, sensor.t_s.front(), reference.t_s.front(), result);
  if (refined) tell_lag(sensor, reference, result);

  result.confidence = probability(result, std::min(1.0, result.overlap_s / shorter_s), rivals);
  if (result.confidence < kUnsure || rivals.gain < kNoGain)
    result.warnings.push_back(low_confidence(result, rivals));
  return result;
}

double explained(const Series& sensor, const Series& reference, double clock_offset_s) {
  check_span(sensor);
  check_span(reference);
  const Sampled a = sample(sensor, kExplainedRate_hz);
  const auto lag = static_cast<std::ptrdiff_t>(
      std::lround((clock_offset_s + sensor.t_s.front() - reference.t_s.front()) * kExplainedRate_hz));
  const Scan all = scan(a, kMaxBins, sample(reference, kExplainedRate_hz), kMinOverlap_s * kExplainedRate_hz);
  const auto at = std::ranges::find(all.lag, lag);
  return at == all.lag.end() ? 0 : all.eta_squared[static_cast<std::size_t>(at - all.lag.begin())];
}

std::optional<std::string> disagreement(double user_offset_s, const Alignment& found) {
  const double difference = user_offset_s - found.clock_offset_s;
  const double error_s = found.clock_offset_se_s.value_or(kDisagreement_s);
  if (found.confidence < kUnsure) return std::nullopt;  // they say nothing
  if (std::abs(difference) <= std::max(kDisagreement_s, kDisagreementErrors * error_s)) return std::nullopt;
  return fmt::format(
      "the given clock offset {:+.2f} s disagrees with the signals by {:+.2f} s: they say {:+.2f} s "
      "(confidence {:.2f})",
      user_offset_s, difference, found.clock_offset_s, found.confidence);
}

}  // namespace flexor::recording
