#include "host/recording/pair.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "host/io/io.hpp"
#include "host/io/numbers.hpp"
#include "host/io/pipe_json.hpp"
#include "host/recording/clock.hpp"
#include "host/recording/stream.hpp"
#include "host/recording/unit.hpp"

namespace flexor::recording {
namespace {

using io::InputError;
using io::JobError;

constexpr double kMostAngle_rad = 13;   // two turns: no joint of a hand makes them
constexpr double kMostOffset_s = 1e10;  // three centuries

// Grid points for each reading that a log may ask for; slower logs say nothing at this rate.
constexpr double kMostPerRow = 60;
constexpr double kMostSamples = 10000;

constexpr double kRangeMargin = 0.25;
constexpr double kBeyond = 0.01;  // share of the held-out readings

Series until(const Series& series, double end_s) {
  const auto end = std::ranges::lower_bound(series.t_s, end_s);
  const auto rows = static_cast<std::size_t>(end - series.t_s.begin());
  return {series.t_s.first(rows), series.value.first(rows)};
}

// Whether a converter's end is read as anything else: a glove that scales its fingers itself, and a divider that ends early, come to
// it in ordinary steps; what is unplugged jumps.
bool is_reading(std::span<const double> value, double rail, double other) {
  std::vector<double> to_rail, elsewhere;
  for (std::size_t k = 1; k < value.size(); ++k) {
    const double step = std::abs(value[k] - value[k - 1]);
    if (!(step > 0) || value[k] == other || value[k - 1] == other) continue;
    (value[k] == rail || value[k - 1] == rail ? to_rail : elsewhere).push_back(step);
  }
  if (to_rail.size() < 3 || elsewhere.empty()) return false;
  const auto nearly_all = elsewhere.begin() + std::ssize(elsewhere) * 99 / 100;
  std::ranges::nth_element(elsewhere, nearly_all);
  return io::median(std::move(to_rail)) <= *nearly_all;
}

// Of all counts of the log, which are one converter's; else what was read and a quarter of its range on either side.
Range valid_range(const Recording& log, const Column& column, double end_s) {
  const auto seen = [&](const Column& of) { return until({log.t_s, of.value}, end_s).value; };
  const auto [low, high] = without_spikes(seen(column));
  if (column.unit == "count" && low >= 0) {
    double top = adc_top(high);
    for (const Column& other : log.columns) {
      if (other.unit == "count" && std::ranges::any_of(seen(other), [&](double v) { return v > top; }))
        top = std::max(top, adc_top(without_spikes(seen(other)).max));
    }
    return counts_that_tell(seen(column), top);
  }
  const double margin = kRangeMargin * (high - low);
  return {low - margin, high + margin};
}

void refuse_other_unit(const Series& fitted, const Range& valid, const Recording& sensor,
                       const Column& column) {
  constexpr double kMost = 0.99;
  const auto outside = std::ranges::count_if(
      fitted.value, [&](double value) { return value < valid.min || value > valid.max; });
  if (static_cast<double>(outside) <= kMost * static_cast<double>(fitted.value.size())) return;
  const auto [low, high] = without_spikes(fitted.value);
  throw InputError(
      "{}: column \"{}\" reads {:g} to {:g}, outside of what counts can be ({:g} to {:g}): is it in "
      "another unit?",
      sensor.source, column.name, low, high, valid.min, valid.max);
}

// The reference at the sensor's instants; a gap where its neighbours are far apart or missing.
void sample_reference(const Series& reference, double shift_s, double max_gap_s, Aligned& a) {
  const auto t = reference.t_s;
  for (const double sensor_s : a.t_s) {
    const double now = sensor_s + shift_s;
    const auto next = std::ranges::lower_bound(t, now);
    a.angle_deg.push_back(io::interpolate(t, reference.value, now));
    a.unseen.push_back(next == t.begin() || next == t.end() || *next - *(next - 1) > max_gap_s);
  }
}

// Before memory is asked for it.
void check_size(const Recording& sensor, double rate_hz) {
  double seconds = 0;
  for (std::size_t i = 1; i < sensor.t_s.size(); ++i) {
    const double step = sensor.t_s[i] - sensor.t_s[i - 1];
    if (step <= kJump_s) seconds += step;
  }
  const auto rows = static_cast<double>(sensor.t_s.size());
  if (seconds * rate_hz <= kMostSamples + kMostPerRow * rows) return;
  throw InputError("{}: {} readings in {:.0f} s are far too few for {:g} samples a second; lower --rate",
                   sensor.source, sensor.t_s.size(), seconds, rate_hz);
}

std::string beside(const std::string& column, const Unknown& unknown) {
  return column.ends_with("_deg") ? without_unit(column) + unknown.ending : "";
}

void keep_rows(Recording& r, const std::function<bool(std::size_t)>& wanted) {
  const auto keep = [&](std::vector<double>& v) {
    std::size_t kept = 0;
    for (std::size_t k = 0; k < v.size(); ++k)
      if (wanted(k)) v[kept++] = v[k];
    v.resize(kept);
  };
  keep(r.t_s);
  for (Column& column : r.columns) keep(column.value);
}

void require_rows(const Recording& r, const std::string& column) {
  if (r.t_s.size() < 2) throw JobError("{}: {} has hardly any reading", r.source, column);
}

// Where the offset was given, the signals need not tell it; why they do not is a warning.
std::optional<Alignment> find_alignment(Pair& pair, bool given, std::vector<std::string>& warnings) {
  const Series sensor = pair.sensor.series(pair.input);
  try {
    if (given) return align(sensor, pair.reference.series(pair.output));
    std::vector<std::string> unused;  // the alignment has them, too
    Clock clock = find_clock({{0, sensor, &pair.reference, pair.output, ""}}, {}, false, unused);
    if (clock.surest->drift_ppm) *clock.surest->drift_ppm += clock.drift_ppm;
    return clock.surest;
  } catch (const JobError& error) {
    if (!given) throw;
    warnings.push_back(
        fmt::format("the signals do not confirm the clock offset that was given: {}", error.what()));
    return std::nullopt;
  }
}

// Of values within `moving`, both ends left out.
std::optional<Still> longest_still(const Series& signal, const Series& other, double offset_s,
                                   const Range& moving) {
  constexpr double kLeast_s = 3;
  constexpr double kSettles_s = 1;  // a sensor's lag behind a step to an end is no motion of its own
  constexpr double kMovesOn = 0.25;
  const auto [other_least, other_most] = without_spikes(other.value);
  const auto at = [&](double t_s) {
    return std::ranges::lower_bound(other.t_s, t_s + offset_s) - other.t_s.begin();
  };
  const auto [least, most] = std::ranges::minmax(signal.value);
  Still longest;
  for (std::size_t from = 0, to = 0; from < signal.value.size(); from = to) {
    for (to = from; to < signal.value.size() && signal.value[to] == signal.value[from];) ++to;
    const Still one{signal.t_s[from], signal.t_s[to - 1]};
    if (one.end_s - one.begin_s < std::max(kLeast_s, longest.end_s - longest.begin_s) ||
        signal.value[from] <= moving.min || signal.value[from] >= moving.max)
      continue;
    const bool stepped = from > 0 && (signal.value[from] == least || signal.value[from] == most);
    const auto [low, high] = std::minmax_element(other.value.begin() + at(one.begin_s + stepped * kSettles_s),
                                                 other.value.begin() + at(one.end_s));
    if (low != high && *high - *low >= kMovesOn * (other_most - other_least)) longest = one;
  }
  return longest.end_s > longest.begin_s ? std::optional(longest) : std::nullopt;
}

}  // namespace

double adc_top(double greatest) {
  double out = 1023;  // of 10 bits
  while (out < greatest) out = 4 * out + 3;
  return out;
}

Range counts_that_tell(std::span<const double> value, double top) {
  return {is_reading(value, 0, top) ? 0.0 : 1.0, is_reading(value, top, 0) ? top : top - 1};
}

void leave_out_lost(Recording& r, const std::string& name) {
  for (const Unknown& unknown : kUnknown) {
    const auto column = std::ranges::find(r.columns, beside(name, unknown), &Column::name);
    if (column == r.columns.end()) continue;
    const std::vector<double> says = std::move(column->value);
    r.columns.erase(column);
    keep_rows(r, [&](std::size_t k) { return says[k] < unknown.from; });
    require_rows(r, name);
    if (r.t_s.size() < says.size())
      r.warnings.push_back(fmt::format("{}: {} of {} rows of {} are {} and left out", r.source,
                                       says.size() - r.t_s.size(), says.size(), name, unknown.why));
  }
}

Recording without_holes(const Recording& r, const std::string& name) {
  const Column& read = r.column(name);
  Recording out{r.source, r.t_s, {read}, r.warnings, r.digest};
  keep_rows(out, [&](std::size_t k) { return !std::isnan(read.value[k]); });
  require_rows(out, name);
  return out;
}

void leave_out_spikes(Recording& r, const std::string& name) {
  const std::vector<double> seen = r.column(name).value;
  const Range range = without_spikes(seen);
  std::vector<std::uint8_t> keep = without_jumps({r.t_s, seen});
  for (std::size_t k = 0; k < seen.size(); ++k)
    keep[k] = keep[k] && !(seen[k] < range.min || seen[k] > range.max);
  const auto first = static_cast<std::size_t>(std::ranges::find(keep, 0) - keep.begin());
  if (first == keep.size()) return;
  r.warnings.push_back(
      fmt::format("{}: {} angle(s) of {} lie far from all others or from those just before and after, the "
                  "first is {:g} at {:.2f} s: left out",
                  r.source, std::ranges::count(keep, 0), name, seen[first], r.t_s[first]));
  keep_rows(r, [&](std::size_t k) { return keep[k] != 0; });
}

std::optional<Still> frozen(const Series& reading, const Series& angle, double offset_s) {
  const auto [least, most] = std::ranges::minmax(reading.value);
  return longest_still(reading, angle, offset_s, {least, most});
}

std::string in_words(const Still& still) {
  return fmt::format("does not change from {:.1f} to {:.1f} s ({:.0f} s)", still.begin_s, still.end_s,
                     still.end_s - still.begin_s);
}

bool leave_out_frozen(Recording& angle, const std::string& column, const Series& reading,
                      double clock_offset_s, std::vector<std::string>& warnings) {
  bool any = false;
  while (const auto still = longest_still(angle.series(column), reading, -clock_offset_s, {})) {
    any = true;
    warnings.push_back(
        fmt::format("{}: column \"{}\" {} while the sensor moves: left out; was the finger lost from sight?",
                    angle.source, column, in_words(*still)));
    const std::vector<double> t_s = angle.t_s;
    keep_rows(angle, [&](std::size_t k) { return t_s[k] < still->begin_s || t_s[k] > still->end_s; });
    require_rows(angle, column);
  }
  return any;
}

std::vector<Recording> angle_segments(const Log& log, const std::string& column, const TimeOptions& time) {
  const std::unique_ptr<LogReader> reader = open_log(log, {{column}, time});
  std::vector<std::string> columns = {column};
  for (const Unknown& unknown : kUnknown)
    if (reader->has(beside(column, unknown))) columns.push_back(beside(column, unknown));
  reader->choose(columns);
  std::vector<Recording> out = read_segments(*reader, time);
  for (Recording& r : out) {
    leave_out_lost(r, column);
    leave_out_spikes(r, column);
  }
  return out;
}

Recording read_angle(const Log& log, const std::string& column, const TimeOptions& time) {
  return std::move(angle_segments(log, column, time).front());
}

void to_degrees(Recording& recording, const std::string& name, const std::string& stated) {
  Column& column = recording.column(name);
  const auto wanted = known_unit(stated);
  if (!stated.empty() && wanted != "deg" && wanted != "rad")
    throw InputError("unit \"{}\" of the angle: deg or rad", stated);
  if (const std::string other = unknown_angle_unit(name); column.unit.empty() && !other.empty()) {
    const bool grad = lower(other) == "grad";
    if (!grad || !wanted)
      throw InputError(
          "{}: column \"{}\" is in \"{}\" by its name: an angle in deg or rad is needed{}", recording.source,
          name, other,
          grad ? "; degrees in German, gon in English: --output-unit deg where the command has it, or "
                 "rename the column to end in _deg"
               : "");
  }
  if (column.unit.empty() && !wanted) {
    const auto [low, high] = std::ranges::minmax(column.value);
    recording.warnings.push_back(fmt::format(
        "{}: column \"{}\" states no unit and is taken as degrees{}", recording.source, name,
        high - low < 3.5   ? "; it spans so little: are these radians? Then let its name end in _rad"
        : high - low > 360 ? "; it spans more than a turn: is this the measured angle?"
                           : ""));
  }
  state_unit(recording, name, stated);
  if (!column.unit.empty() && column.unit != "deg" && column.unit != "rad")
    throw InputError("{}: column \"{}\" is in {}: an angle in deg or rad is needed", recording.source, name,
                     column.unit);
  if (std::exchange(column.unit, "deg") == "rad") {
    if (std::ranges::any_of(column.value, [](double v) { return std::abs(v) > kMostAngle_rad; }))
      throw InputError(
          "{}: column \"{}\" has more than two turns in radians: are these degrees? An OpenSim file then "
          "says inDegrees=yes above its columns",
          recording.source, name);
    for (double& v : column.value) v *= 180 / std::numbers::pi;
    recording.warnings.push_back(
        fmt::format("{}: column \"{}\" is in radians and was converted to degrees", recording.source, name));
  }
  unwrap(recording, name);
}

void unwrap(Recording& recording, const std::string& name) {
  constexpr double kWrap = 0.75;  // of a turn
  Column& column = recording.column(name);
  if (column.unit != "deg" && column.unit != "rad") return;
  const double turn = column.unit == "deg" ? 360 : 2 * std::numbers::pi;
  std::vector<double>& angle = column.value;
  std::vector<std::size_t> seen;
  for (std::size_t k = 0; k < angle.size(); ++k)
    if (!std::isnan(angle[k])) seen.push_back(k);
  const auto at = [&](std::size_t k) { return angle[k]; };
  const auto jump = std::ranges::adjacent_find(
      seen, [&](std::size_t a, std::size_t b) { return std::abs(angle[b] - angle[a]) >= kWrap * turn; });
  if (jump == seen.end()) return;
  const auto [low, high] = std::ranges::minmax(seen, {}, at);
  if (angle[high] - angle[low] > turn) return;
  const double seam = angle[low] < 0 ? turn / 2 : 0;
  for (std::size_t i = 1; i < seen.size(); ++i)
    angle[seen[i]] -= turn * std::round((angle[seen[i]] - angle[seen[i - 1]]) / turn);
  const auto [least, most] = std::ranges::minmax(seen, {}, at);
  const double off = turn * std::round(((angle[least] + angle[most]) / 2 - seam) / turn);
  for (double& v : angle) v -= off;
  recording.warnings.push_back(fmt::format(
      "{}: column \"{}\" jumps by a turn, first at {:.2f} s: it is taken to go on there, from {:.4g} to "
      "{:.4g} {}",
      recording.source, name, recording.t_s[*(jump + 1)], angle[least], angle[most], column.unit));
}

void state_unit(Recording& recording, const std::string& column, const std::string& stated) {
  if (stated.empty()) return;
  const auto asked = known_unit(stated);
  if (!asked) throw InputError("unknown unit \"{}\"; known: count, V, mV, ohm, kohm, deg, rad", stated);
  std::string& unit = recording.column(column).unit;
  if (!unit.empty() && unit != *asked)
    throw InputError("{}: column \"{}\" is in {} by {}, in {} by the option: which?", recording.source,
                     column, unit, unit_of(column).empty() ? "the lines above the rows" : "its name", *asked);
  unit = *asked;
}

void check_clock(double rate_hz, std::optional<double> clock_offset_s, double lead_s) {
  if (!(rate_hz > 0) || !std::isfinite(rate_hz)) throw InputError("the rate must be positive");
  if (!(lead_s >= 0 && lead_s <= 1)) throw InputError("the lead must lie between 0 and 1 s");
  if (clock_offset_s && !(std::abs(*clock_offset_s) < kMostOffset_s))
    throw InputError("the clock offset must be a number of seconds");
}

Aligned align_pair(Pair pair, double rate_hz, std::optional<double> clock_offset_s) {
  check_clock(rate_hz, clock_offset_s, 0);
  require_change(pair.sensor, pair.input, "is the sensor plugged in?");
  require_change(pair.reference, pair.output, "does the camera see the marks?");
  Aligned a;
  a.warnings = pair.sensor.warnings;
  std::ranges::copy(pair.reference.warnings, std::back_inserter(a.warnings));
  if (share_a_clock(pair.sensor, pair.reference) && !clock_offset_s) {
    clock_offset_s = 0;
    a.warnings.emplace_back(
        "readings and angles have one clock, of one file or host_s of both: no offset is searched for");
  } else if ((a.alignment = find_alignment(pair, clock_offset_s.has_value(), a.warnings))) {
    std::ranges::copy(a.alignment->warnings, std::back_inserter(a.warnings));
    if (const auto warning = clock_offset_s ? disagreement(*clock_offset_s, *a.alignment) : std::nullopt)
      a.warnings.push_back(*warning);
  }
  sample_pair(pair, rate_hz, clock_offset_s ? *clock_offset_s : a.alignment->clock_offset_s, 0, 1, a);
  return a;
}

void sample_pair(const Pair& pair, double rate_hz, double clock_offset_s, double lead_s, double split,
                 Aligned& a) {
  const Series sensor = pair.sensor.series(pair.input);
  const Series reference = pair.reference.series(pair.output);
  a.clock_offset_s = clock_offset_s;
  a.period_s = 1 / rate_hz;
  check_size(pair.sensor, rate_hz);
  a.t_s = resample(sensor, a.period_s, kJump_s).t_s;
  const double shift_s = a.clock_offset_s + lead_s;
  const auto first = std::ranges::lower_bound(a.t_s, reference.t_s.front() - shift_s);
  const auto last = std::ranges::upper_bound(a.t_s, reference.t_s.back() - shift_s);
  if (last - first < 2 || !(*(last - 1) - *first > 1))
    throw JobError(
        "with a clock offset of {:+.2f} s the recordings do not overlap for a second: is it right, are there "
        "angles for longer?",
        a.clock_offset_s);
  a.overlap_begin = static_cast<std::size_t>(first - a.t_s.begin());
  const auto size = static_cast<std::size_t>(last - a.t_s.begin());
  a.t_s.resize(size);
  const double fitted = split * static_cast<double>(size - a.overlap_begin);
  a.holdout_begin = a.overlap_begin + static_cast<std::size_t>(fitted);
  const double end_s = a.holdout_begin < size ? a.t_s[a.holdout_begin] - Resampler::kTolerance_s
                                              : std::numeric_limits<double>::infinity();
  const Series seen = until(sensor, end_s);
  if (seen.t_s.empty()) throw InputError("the split leaves nothing to fit");
  a.max_gap_s = default_max_gap_s(seen.t_s);
  const Column& column = pair.sensor.column(pair.input);
  a.valid = valid_range(pair.sensor, column, end_s);
  refuse_other_unit(seen, a.valid, pair.sensor, column);
  Samples samples = resample(sensor, a.period_s, a.max_gap_s, a.valid);
  samples.value.resize(size);
  a.input = std::move(samples.value);
  sample_reference(reference, shift_s, default_max_gap_s(until(reference, end_s + shift_s).t_s), a);
  a.gap = a.unseen;
  for (std::size_t k = 0; k < size; ++k) a.gap[k] = a.gap[k] || samples.pause[k] || std::isnan(a.input[k]);
  a.input = held_over(std::move(a.input), 0);
}

Recording to_recording(const Aligned& a, const Pair& pair) {
  const auto part = [&](const auto& v) {
    return std::vector<double>(v.begin() + static_cast<std::ptrdiff_t>(a.overlap_begin), v.end());
  };
  Recording r;
  r.t_s = part(a.t_s);
  // A column in radians was converted, so its name must not say so any longer.
  const std::string angle = unit_of(pair.output) == "deg" ? pair.output : without_unit(pair.output) + "_deg";
  r.columns = {{pair.input, part(a.input)}, {angle, part(a.angle_deg)}, {"gap", part(a.gap)}};
  return r;
}

nlohmann::ordered_json to_json(const Aligned& aligned) {
  const Alignment a = aligned.alignment.value_or(Alignment());
  return {{"clock_offset_s", aligned.clock_offset_s},
          {"clock_offset_se_s", a.clock_offset_se_s},
          {"sensor_lag_s", a.sensor_lag_s},
          {"alignment_confidence", aligned.alignment ? Json(a.confidence) : Json(nullptr)},
          {"angle_explained", aligned.alignment ? Json(a.eta_squared) : Json(nullptr)},
          {"overlap_s", aligned.t_s.back() - aligned.t_s[aligned.overlap_begin]},
          {"rival_offset_s", a.rival_offset_s},
          {"tapped", a.tapped},
          {"quarter_offset_s", a.quarter_offset_s},
          {"drift_ppm", a.drift_ppm},
          {"drift_se_ppm", a.drift_se_ppm},
          {"version", FLEXOR_VERSION},
          {"warnings", aligned.warnings}};
}

std::optional<std::string> beyond_fitted(const std::vector<Halves>& recordings) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (const Halves& one : recordings) {
    const Range range = without_spikes(one.fitted);
    low = std::min(low, range.min);
    high = std::max(high, range.max);
  }
  double outside = 0;
  double held = 0;
  for (const Halves& one : recordings) {
    for (const double u : one.held) outside += u < low || u > high ? 1 : 0;
    held += static_cast<double>(one.held.size());
  }
  const double share = outside / std::max(held, 1.0);
  if (share <= kBeyond) return std::nullopt;
  return fmt::format(
      "{:.0f} % of the held-out readings lie outside the range seen in the fitted part ({:g} to {:g}): "
      "record the whole range in both parts",
      100 * share, low, high);
}

}  // namespace flexor::recording
