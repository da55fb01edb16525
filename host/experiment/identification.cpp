#include "host/experiment/identification.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/QR>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>

#include "host/io/json.hpp"
#include "host/model/simulation.hpp"
#include "host/recording/csv.hpp"

namespace flexor::experiment {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kAdcTop = 1023;
constexpr double kRangeMargin = 0.25;
constexpr double kMuchWorse = 1.5;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// A finger named in either column, else index.
std::string guess_channel(const SourceFiles& files) {
  for (std::string column : {files.input, files.output}) {
    std::ranges::transform(column, column.begin(), [](unsigned char c) { return std::tolower(c); });
    for (const char* name : {"thumb", "index", "pointer", "middle", "ring", "pinky", "little"}) {
      if (column.find(name) != std::string::npos) return model::finger(name);
    }
  }
  return "index";
}

identify::Structure requested_structure(const Request& r) {
  const identify::Family family = identify::family(r.structure);
  if (r.dead_zone) {
    if (family != identify::Family::hw) throw io::InputError("a dead zone goes with structure hw only");
    if (r.knots) throw io::InputError("a dead zone replaces the input curve: leave out the number of knots");
    return identify::make_dead_zone_structure(r.order.value_or(1));
  }
  identify::Structure s = identify::make_structure(family, r.order.value_or(identify::kDefaultOrder),
                                                   r.knots.value_or(identify::kDefaultKnots),
                                                   r.plays.value_or(identify::kDefaultPlays));
  s.monotone = r.monotone && (s.input_knots > 0 || s.output_knots > 0);
  identify::check(s);
  return s;
}

// The range of readings that the compensator accepts: a 10-bit ADC without its rails, or what was seen and a
// quarter of its range on either side.
void set_input_range(const recording::Recording& sensor, const std::string& column, model::Channel& channel) {
  const auto [low, high] = std::ranges::minmax(sensor.column(column).value);
  if (low >= 0 && high <= kAdcTop && high > 1) {
    channel.valid_min = 1;
    channel.valid_max = kAdcTop - 1;
    channel.input_unit = "count";
    return;
  }
  const double margin = kRangeMargin * (high - low);
  channel.valid_min = low - margin;
  channel.valid_max = high + margin;
  channel.input_unit = "raw";
}

std::vector<double> simulate(const model::Model& model, const std::vector<double>& input) {
  model::Simulation<model::DoubleArithmetic> simulation(model);
  std::vector<double> out;
  out.reserve(input.size());
  for (const double u : input) out.push_back(simulation.step(0, u).angle_deg);
  return out;
}

model::Model make_model(const identify::Summary& fit, const Request& request, const Aligned& aligned) {
  model::Model m;
  m.name = io::to_utf8(request.files.sensor.stem().string());
  m.description = fmt::format("{} fitted to {} against {}", identify::describe(fit.structure),
                              request.files.input, request.files.output);
  m.written_by = "flexor " FLEXOR_VERSION;
  m.sample_period_s = 1 / request.rate_hz;
  model::Channel channel = fit.channel;
  channel.input_column = request.files.input;
  set_input_range(aligned.sensor, request.files.input, channel);
  m.channels = {std::move(channel)};
  return m;
}

class Scorer {
 public:
  Scorer(const Aligned& aligned, std::size_t begin)
      : angle_(aligned.angle_deg), gap_(aligned.gap), begin_(begin) {
    for (std::size_t k = begin; k < aligned.grid.size; ++k) t_.push_back(aligned.grid.time(k));
  }

  score::Score all(const std::vector<double>& estimate) const {
    const std::span measured(angle_.begin() + static_cast<std::ptrdiff_t>(begin_), angle_.end());
    const std::span estimated(estimate.begin() + static_cast<std::ptrdiff_t>(begin_), estimate.end());
    return score::score(t_, measured, estimated);
  }

  score::Score without_gaps(const std::vector<double>& estimate) const {
    std::vector<double> t;
    std::vector<double> measured;
    std::vector<double> estimated;
    for (std::size_t k = begin_; k < angle_.size(); ++k) {
      if (gap_[k]) continue;
      t.push_back(t_[k - begin_]);
      measured.push_back(angle_[k]);
      estimated.push_back(estimate[k]);
    }
    return score::score(t, measured, estimated);
  }

 private:
  const std::vector<double>& angle_;
  const std::vector<std::uint8_t>& gap_;
  std::size_t begin_;
  std::vector<double> t_;
};

Row make_row(const identify::Candidate& candidate, const Request& request, const Aligned& aligned,
             const Scorer& scorer) {
  Row row;
  row.name = identify::describe(candidate.structure);
  row.refusal = candidate.refusal;
  if (!row.refusal.empty()) return row;
  row.parameters = candidate.summary.free_parameters;
  row.fitted_rmse_deg = candidate.summary.rmse_deg;
  if (candidate.cross_validated_deg > 0) row.cross_validated_deg = candidate.cross_validated_deg;
  row.holdout = scorer.all(simulate(make_model(candidate.summary, request, aligned), aligned.input));
  return row;
}

std::vector<double> straight_line(const Aligned& aligned, const std::vector<std::uint8_t>& use) {
  Eigen::Index n = 0;
  Eigen::MatrixXd a(std::ranges::count(use, 1), 2);
  Eigen::VectorXd b(a.rows());
  for (std::size_t k = 0; k < use.size(); ++k) {
    if (!use[k]) continue;
    a.row(n) << 1, aligned.input[k];
    b(n++) = aligned.angle_deg[k];
  }
  const Eigen::Vector2d line = a.colPivHouseholderQr().solve(b);
  std::vector<double> out;
  for (const double u : aligned.input) out.push_back(line(0) + line(1) * u);
  return out;
}

// What a refusal means to somebody who only wants to use the compensator; the refusal itself follows in
// brackets.
std::string in_plain_words(const std::string& refusal) {
  const auto starts = [&](const char* what) { return refusal.starts_with(what); };
  const char* meaning = "part of the curve could not be learnt from this recording";
  if (starts("saturation")) {
    meaning =
        "the finger never reached an end stop there, so that this limit of the output is a safe one, not a "
        "measured one";
  } else if (starts("pole") || starts("tap")) {
    meaning =
        "one detail of how the sensor lags could not be learnt from this recording and keeps a usual value";
  } else if (starts("radius") || starts("weight")) {
    meaning =
        "one detail of the sensor's hysteresis could not be learnt from this recording and keeps a usual "
        "value";
  }
  return fmt::format("{} ({})", meaning, refusal);
}

void add_warnings(Identification& r) {
  auto& warnings = r.warnings;
  warnings = r.aligned.warnings;
  for (const std::string& refusal : r.fit.refusals) {
    warnings.push_back(in_plain_words(refusal));
  }
  if (r.fit.status == identify::Status::iteration_limit) {
    warnings.emplace_back(
        "the fit was still improving when it was stopped: try a simpler structure or a longer recording");
  }
  if (r.holdout.rmse_deg >= r.baseline.rmse_deg) {
    warnings.push_back(
        fmt::format("on data it never saw the compensator ({:.2f} deg) is no better than a straight "
                    "line ({:.2f} deg)",
                    r.holdout.rmse_deg, r.baseline.rmse_deg));
  }
  if (r.holdout_without_gaps.rmse_deg > kMuchWorse * r.fit.rmse_deg) {
    warnings.push_back(
        fmt::format("the error on unseen data is {:.1f} times the error on the fitted part: the glove "
                    "changed during the recording, or the motion did",
                    r.holdout_without_gaps.rmse_deg / r.fit.rmse_deg));
  }
  if (r.holdout.rmse_deg > kMuchWorse * r.holdout_without_gaps.rmse_deg) {
    warnings.push_back(
        fmt::format("most of the error falls into pauses of a log, where there is nothing to compensate: "
                    "without them it is {:.2f} deg; log without pauses",
                    r.holdout_without_gaps.rmse_deg));
  }
  const auto split = r.aligned.input.begin() + static_cast<std::ptrdiff_t>(r.holdout_begin);
  const auto range = std::minmax_element(r.aligned.input.begin(), split);
  const double low = *range.first;
  const double high = *range.second;
  const auto outside =
      std::count_if(split, r.aligned.input.end(), [&](double u) { return u < low || u > high; });
  const double share = static_cast<double>(outside) / static_cast<double>(r.aligned.input.end() - split);
  if (share > 0.01) {
    warnings.push_back(
        fmt::format("{:.0f} % of the held-out readings lie outside the range seen in the fitted part "
                    "({:.0f} to {:.0f})",
                    100 * share, low, high));
  }
  const auto& raw = r.aligned.sensor.column(r.request.files.input).value;
  const model::Channel& channel = r.model.channels.front();
  const auto refused =
      std::ranges::count_if(raw, [&](double u) { return u < channel.valid_min || u > channel.valid_max; });
  if (refused > 0) {
    warnings.push_back(
        fmt::format("{} reading(s) lie at a rail of the ADC: was the sensor unplugged or shorted? The "
                    "compensator holds its angle there",
                    refused));
  }
}

// The measured angle without what a tracker says it lost: NAME_deg has NAME_quality beside it.
recording::Recording read_reference(const SourceFiles& files) {
  constexpr std::string_view kUnit = "_deg";
  constexpr double kLost = 3;
  std::string quality;
  if (files.output.ends_with(kUnit))
    quality = files.output.substr(0, files.output.size() - kUnit.size()) + "_quality";
  io::require_readable(files.reference);
  std::ifstream stream(files.reference, std::ios::binary);
  const std::vector<std::string> columns =
      recording::CsvReader(stream, files.reference.string(), {}).columns();
  if (quality.empty() || std::ranges::find(columns, quality) == columns.end()) {
    return recording::read_csv(files.reference, {files.output});
  }
  recording::Recording all = recording::read_csv(files.reference, {files.output, quality});
  recording::Recording out = all;
  out.t_s.clear();
  out.columns = {{files.output, {}}};
  const std::vector<double>& q = all.column(quality).value;
  for (std::size_t k = 0; k < q.size(); ++k) {
    if (q[k] >= kLost) continue;
    out.t_s.push_back(all.t_s[k]);
    out.columns[0].value.push_back(all.columns[0].value[k]);
  }
  const std::size_t lost = q.size() - out.t_s.size();
  if (out.t_s.empty()) {
    throw io::JobError(fmt::format("{}: {} is lost in every row", files.reference.string(), files.output));
  }
  if (lost > 0) {
    out.warnings.push_back(fmt::format("{}: {} of {} rows of {} are lost and left out",
                                       files.reference.string(), lost, q.size(), files.output));
  }
  return out;
}

}  // namespace

SourceFiles with_columns(SourceFiles files) {
  const auto only_column = [](const std::filesystem::path& path, const char* option) {
    io::require_readable(path);
    std::ifstream stream(path, std::ios::binary);
    const recording::CsvReader reader(stream, path.string(), {});
    if (reader.columns().size() == 1) return reader.columns().front();
    throw io::InputError(fmt::format("{}: which column? give {}; there are: {}", path.string(), option,
                                     fmt::join(reader.columns(), ", ")));
  };
  if (files.input.empty()) files.input = only_column(files.sensor, "--input");
  if (files.output.empty()) files.output = only_column(files.reference, "--output");
  return files;
}

Aligned align_files(const SourceFiles& files, double rate_hz, std::optional<double> clock_offset_s,
                    double lead_s) {
  if (!(rate_hz > 0) || !std::isfinite(rate_hz)) throw io::InputError("the rate must be positive");
  if (!(lead_s >= 0 && lead_s <= 1)) throw io::InputError("the lead must lie between 0 and 1 s");
  Aligned a;
  a.sensor = recording::read_csv(files.sensor, {files.input});
  a.reference = read_reference(files);
  recording::require_change(a.sensor, files.input, "is the sensor plugged in?");
  recording::require_change(a.reference, files.output, "does the camera see the marks?");
  const recording::Series sensor = a.sensor.series(files.input);
  const recording::Series reference = a.reference.series(files.output);
  a.alignment = recording::align(sensor, reference);
  a.clock_offset_s = clock_offset_s.value_or(a.alignment.clock_offset_s);

  a.warnings = a.sensor.warnings;
  a.warnings.insert(a.warnings.end(), a.reference.warnings.begin(), a.reference.warnings.end());
  a.warnings.insert(a.warnings.end(), a.alignment.warnings.begin(), a.alignment.warnings.end());
  if (clock_offset_s) {
    if (auto warning = recording::disagreement(*clock_offset_s, a.alignment)) a.warnings.push_back(*warning);
  }

  // On the sensor's clock, counted from its start.
  const std::vector<double> sensor_t = recording::since_start(sensor.t_s);
  std::vector<double> reference_t = recording::since_start(reference.t_s);
  const double ahead_s = a.clock_offset_s - (reference.t_s.front() - sensor.t_s.front());
  for (double& t : reference_t) t -= std::round((ahead_s + lead_s) * 1e6) / 1e6;
  const double begin = std::max(0.0, reference_t.front());
  const double end = std::min(sensor_t.back(), reference_t.back());
  if (!(end - begin > 1)) {
    throw io::JobError(
        fmt::format("with a clock offset of {:+.2f} s the recordings do not overlap; leave the offset "
                    "out to find it from the signals",
                    a.clock_offset_s));
  }
  a.grid = {begin, 1 / rate_hz, static_cast<std::size_t>((end - begin) * rate_hz)};
  auto u = recording::resample({sensor_t, sensor.value}, a.grid, recording::default_max_gap_s(sensor_t));
  auto y =
      recording::resample({reference_t, reference.value}, a.grid, recording::default_max_gap_s(reference_t));
  a.grid.start_s += sensor.t_s.front();
  a.input = std::move(u.value);
  a.angle_deg = std::move(y.value);
  a.gap = std::move(u.gap);
  for (std::size_t k = 0; k < a.gap.size(); ++k) a.gap[k] |= y.gap[k];
  return a;
}

recording::Recording to_recording(const Aligned& aligned, const SourceFiles& files) {
  recording::Recording r;
  for (std::size_t k = 0; k < aligned.grid.size; ++k) r.t_s.push_back(aligned.grid.time(k));
  r.columns = {{files.input, aligned.input},
               {files.output + "_deg", aligned.angle_deg},
               {"gap", std::vector<double>(aligned.gap.begin(), aligned.gap.end())}};
  return r;
}

Identification identify_files(const Request& asked, const identify::Progress& progress) {
  Request request = asked;
  const bool automatic = request.structure == "auto";
  if (!automatic) (void)requested_structure(request);
  if (automatic && (request.order || request.knots || request.plays || request.dead_zone)) {
    throw io::InputError(
        "structure auto chooses order, knots, plays and dead zone itself: name a structure to set them");
  }
  if (!(request.split > 0 && request.split < 1)) throw io::InputError("the split must lie between 0 and 1");
  request.files = with_columns(request.files);
  const std::string channel =
      request.channel ? model::finger(*request.channel) : guess_channel(request.files);

  Identification r;
  r.request = request;
  r.aligned = align_files(request.files, request.rate_hz, request.clock_offset_s, request.lead_s);
  const Aligned& a = r.aligned;
  r.holdout_begin = static_cast<std::size_t>(request.split * static_cast<double>(a.grid.size));

  identify::Data data;
  data.channel = channel;
  data.period_s = a.grid.period_s;
  // The fitted part alone: what is held out is not even in memory here.
  const auto fitted = static_cast<Eigen::Index>(r.holdout_begin);
  data.input = Eigen::Map<const Eigen::VectorXd>(a.input.data(), fitted);
  data.angle_deg = Eigen::Map<const Eigen::VectorXd>(a.angle_deg.data(), fitted);
  data.use.resize(r.holdout_begin);
  for (std::size_t k = 0; k < data.use.size(); ++k) data.use[k] = !a.gap[k];

  const auto start = std::chrono::steady_clock::now();
  std::vector<identify::Candidate> candidates;
  std::size_t chosen = 0;
  if (automatic) {
    identify::Selection selection =
        identify::select(identify::auto_candidates(request.monotone), data, progress);
    candidates = std::move(selection.candidates);
    chosen = selection.chosen;
  } else {
    candidates.push_back({requested_structure(request), {}, 0, {}});
    candidates.back().summary = identify::fit(candidates.back().structure, data);
  }
  r.fit = candidates[chosen].summary;
  r.fit_seconds = seconds_since(start);

  if (!automatic) {
    // The other families at their usual size, so that the table compares.
    for (const identify::Family family : identify::families()) {
      if (family == r.fit.structure.family) continue;
      identify::Candidate other{identify::make_structure(family), {}, 0, {}};
      try {
        identify::Options quick;
        quick.max_starts = 2;
        other.summary = identify::fit(other.structure, data, quick);
      } catch (const io::JobError& error) {
        other.refusal = error.what();
      }
      candidates.push_back(std::move(other));
    }
  }

  std::vector<std::uint8_t> use = data.use;
  use.resize(a.grid.size, 0);
  const Scorer scorer(a, r.holdout_begin);
  r.baseline_deg = straight_line(a, use);
  r.baseline = scorer.all(r.baseline_deg);
  r.model = make_model(r.fit, request, a);
  r.estimated_deg = simulate(r.model, a.input);
  r.holdout = scorer.all(r.estimated_deg);
  r.holdout_without_gaps = scorer.without_gaps(r.estimated_deg);
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    r.rows.push_back(make_row(candidates[i], request, a, scorer));
    r.rows.back().chosen = i == chosen;
  }
  std::ranges::stable_sort(r.rows, {},
                           [](const Row& row) { return std::pair(!row.refusal.empty(), row.parameters); });

  r.model.training = {{"sensor", io::to_utf8(request.files.sensor.filename().string())},
                      {"sensor_digest", a.sensor.digest},
                      {"reference", io::to_utf8(request.files.reference.filename().string())},
                      {"reference_digest", a.reference.digest},
                      {"output_column", request.files.output},
                      {"clock_offset_s", a.clock_offset_s},
                      {"split", request.split},
                      {"lead_s", request.lead_s},
                      {"fitted_samples", r.fit.used_samples}};
  Json parameters = Json::array();
  for (const identify::Parameter& p : r.fit.parameters) {
    Json entry = {{"name", p.name}, {"value", p.value}};
    if (p.refused) {
      entry["refused"] = true;
    } else {
      entry["standard_error"] = p.standard_error;
    }
    parameters.push_back(std::move(entry));
  }
  r.model.fit = {{"structure", identify::describe(r.fit.structure)},
                 {"fitted_rmse_deg", r.fit.rmse_deg},
                 {"condition", r.fit.condition},
                 {"holdout", to_json(r.holdout)},
                 {"parameters", std::move(parameters)}};
  add_warnings(r);
  return r;
}

Json to_json(const score::Score& s) {
  return {{"rmse_deg", s.rmse_deg},
          {"fit_percent", s.fit_percent},
          {"r2", s.r2},
          {"max_abs_deg", s.max_abs_deg},
          {"p95_abs_deg", s.p95_abs_deg},
          {"iae_deg_s", s.iae_deg_s},
          {"best_lag_s", s.best_lag_s},
          {"lag_removed_rmse_deg", s.lag_removed_rmse_deg},
          {"lag_removed_iae_deg_s", s.lag_removed_iae_deg_s},
          {"samples", s.samples}};
}

Json to_json(const Identification& r) {
  Json rows = Json::array();
  for (const Row& row : r.rows) {
    Json entry = {{"structure", row.name}, {"chosen", row.chosen}};
    if (!row.refusal.empty()) {
      entry["refusal"] = row.refusal;
    } else {
      entry["parameters"] = row.parameters;
      entry["fitted_rmse_deg"] = row.fitted_rmse_deg;
      if (row.cross_validated_deg) entry["cross_validated_rmse_deg"] = *row.cross_validated_deg;
      entry["holdout_rmse_deg"] = row.holdout.rmse_deg;
    }
    rows.push_back(std::move(entry));
  }
  return {{"clock_offset_s", r.aligned.clock_offset_s},
          {"alignment_confidence", r.aligned.alignment.confidence},
          {"channel", r.model.channels.front().name},
          {"structure", identify::name(r.fit.structure.family)},
          {"structure_detail", identify::describe(r.fit.structure)},
          {"holdout", to_json(r.holdout)},
          {"holdout_without_gaps", to_json(r.holdout_without_gaps)},
          {"baseline_linear", to_json(r.baseline)},
          {"fitted_rmse_deg", r.fit.rmse_deg},
          {"structures", std::move(rows)},
          {"parameters", r.model.fit.at("parameters")},
          {"fit_seconds", r.fit_seconds},
          {"version", FLEXOR_VERSION},
          {"warnings", r.warnings}};
}

}  // namespace flexor::experiment
