#include "host/donning/sessions.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <random>

#include "host/donning/window.hpp"
#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/recording/csv.hpp"

namespace flexor::donning {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array kSessionShares = {0.02, 0.1, 0.5, 0.9, 0.98};
constexpr std::size_t kLeastSessions = 3;
constexpr std::size_t kParts = 10;
constexpr int kResamples = 200;
constexpr std::size_t kLeastRows = 10 * kParts;

std::vector<double> quantiles_of(std::vector<double> readings) {
  std::ranges::sort(readings);
  std::vector<double> out;
  for (const double share : kSessionShares) out.push_back(quantile_of(readings, share));
  return out;
}

double span(const std::vector<double>& quantiles) { return quantiles.back() - quantiles.front(); }
double middle(const std::vector<double>& quantiles) { return (quantiles.back() + quantiles.front()) / 2; }

std::vector<double> mean_of(const std::vector<std::vector<double>>& all) {
  std::vector<double> out(all.front().size(), 0);
  for (const auto& one : all) {
    for (std::size_t i = 0; i < out.size(); ++i) out[i] += one[i] / static_cast<double>(all.size());
  }
  return out;
}

struct ShiftAndGain {
  double shift;
  double log_gain;
};

ShiftAndGain against(const std::vector<double>& quantiles, const std::vector<double>& mean) {
  return {(middle(quantiles) - middle(mean)) / span(mean), std::log(span(quantiles) / span(mean))};
}

double shape_of(const std::vector<double>& quantiles, const std::vector<double>& mean) {
  double sum = 0;
  for (std::size_t i = 0; i < mean.size(); ++i) {
    const double place = (quantiles[i] - middle(quantiles)) / span(quantiles);
    const double at = (mean[i] - middle(mean)) / span(mean);
    sum += (place - at) * (place - at) / static_cast<double>(mean.size());
  }
  return std::sqrt(sum);
}

// 1.4826 times the median of what a reading is off the line through its neighbours, of which white noise has sqrt(3/2) times
// its own deviation.
double noise_of(const std::vector<double>& readings) {
  std::vector<double> off;
  for (std::size_t k = 1; k + 1 < readings.size(); ++k)
    off.push_back(std::abs(readings[k] - (readings[k - 1] + readings[k + 1]) / 2));
  std::ranges::sort(off);
  return off.empty() ? 0 : 1.4826 * quantile_of(off, 0.5) / std::sqrt(1.5);
}

Change interval(double value, std::vector<double> resampled) {
  std::ranges::sort(resampled);
  return {value, quantile_of(resampled, 0.025), quantile_of(resampled, 0.975)};
}

SensorChange change_of(const std::string& sensor, const std::vector<double>& readings,
                       const std::vector<double>& mean, std::mt19937& random) {
  const std::vector<double> quantiles = quantiles_of(readings);
  const ShiftAndGain all = against(quantiles, mean);
  std::vector<double> shift;
  std::vector<double> log_gain;
  std::uniform_int_distribution<std::size_t> part(0, kParts - 1);
  for (int r = 0; r < kResamples; ++r) {
    std::vector<double> drawn;
    for (std::size_t p = 0; p < kParts; ++p) {
      const std::size_t at = part(random);
      const auto begin = readings.begin() + static_cast<std::ptrdiff_t>(at * readings.size() / kParts);
      const auto end = readings.begin() + static_cast<std::ptrdiff_t>((at + 1) * readings.size() / kParts);
      drawn.insert(drawn.end(), begin, end);
    }
    const std::vector<double> again = quantiles_of(std::move(drawn));
    if (!(span(again) > 0)) continue;
    const ShiftAndGain one = against(again, mean);
    shift.push_back(one.shift);
    log_gain.push_back(one.log_gain);
  }
  return {sensor, interval(all.shift, shift), interval(all.log_gain, log_gain), shape_of(quantiles, mean),
          noise_of(readings) / span(mean)};
}

// Over the sessions in which each sensor was read.
double deviation(const Sessions& all, const std::vector<std::string>& sensors, Change SensorChange::*which) {
  double squares = 0;
  double freedom = 0;
  for (const std::string& sensor : sensors) {
    std::vector<double> values;
    for (const auto& session : all.sessions) {
      for (const SensorChange& s : session.sensors) {
        if (s.sensor == sensor) values.push_back((s.*which).value);
      }
    }
    const auto n = static_cast<double>(values.size());
    double mean = 0;
    for (const double v : values) mean += v / n;
    for (const double v : values) squares += (v - mean) * (v - mean);
    freedom += n - 1;
  }
  return std::sqrt(squares / freedom);
}

// How the shifts of two sensors correlate, over all pairs; of few sessions drawn towards `general`.
double alike_of(const Sessions& all, double general) {
  const auto freedom = static_cast<double>(all.sessions.size() - 1);
  double products = 0;  // of all pairs, each in both orders
  double squares = 0;   // what they would be, were all alike
  for (const SessionChange& session : all.sessions) {
    double sum = 0;
    double own = 0;
    for (const SensorChange& s : session.sensors) {
      sum += s.shift.value;
      own += s.shift.value * s.shift.value;
    }
    products += sum * sum - own;
    squares += own * (static_cast<double>(session.sensors.size()) - 1);
  }
  if (!(squares > 0)) return general;
  const double here = std::clamp(products / squares, 0.0, kMostAlike);
  return (kGeneralWeight * general + freedom * here) / (kGeneralWeight + freedom);
}

// Put on anew a glove reaches a few times as far at most.
void refuse_other_units(const std::string& sensor, const std::vector<std::string>& sessions,
                        const std::vector<std::vector<double>>& quantiles) {
  constexpr double kTimes = 10;
  std::vector<double> spans;
  for (const auto& one : quantiles) spans.push_back(span(one));
  std::vector<double> sorted = spans;
  std::ranges::sort(sorted);
  const double usual = quantile_of(sorted, 0.5);
  for (std::size_t i = 0; i < spans.size(); ++i) {
    if (spans[i] * kTimes > usual && spans[i] < kTimes * usual) continue;
    throw io::InputError(
        fmt::format("{}: {} spans {:.3g}, in most sessions {:.3g}: is it in another unit, or hardly moved? "
                    "Leave the session out",
                    sessions[i], sensor, spans[i], usual));
  }
}

// A file may hold many trials, each on a clock of its own: only the order of its rows counts.
Log read_session(const std::filesystem::path& path, const std::vector<std::string>& sensors,
                 const std::string& time_unit) {
  io::require_readable(path);
  std::ifstream file(path, std::ios::binary);
  recording::CsvReader reader(file, path.string(), {sensors, time_unit, true});
  Log out{path.stem().string(), {}, std::vector<std::vector<double>>(sensors.size()), reader.units()};
  recording::Row row;
  double last_s = 0;
  for (double clock_s = 0; reader.next(row); last_s = row.t_s) {
    const double step_s = row.t_s - last_s;
    if (!out.t_s.empty() && step_s > 0 && step_s < recording::kJump_s) clock_s += step_s;
    out.t_s.push_back(clock_s);
    for (std::size_t i = 0; i < sensors.size(); ++i) out.reading[i].push_back(row.value[i]);
  }
  if (out.t_s.size() < kLeastRows)
    throw io::InputError(fmt::format("{}: {} row(s) with a reading of every sensor: at least {} are needed",
                                     path.string(), out.t_s.size(), kLeastRows));
  return out;
}

Json change_json(const Change& change) {
  return {{"value", change.value}, {"low", change.low}, {"high", change.high}};
}

}  // namespace

Sessions compare(const std::vector<Log>& logs, const std::vector<std::string>& sensors, unsigned seed) {
  if (logs.size() < kLeastSessions)
    throw io::InputError(fmt::format("{} session(s): at least {} are needed to say how they differ",
                                     logs.size(), kLeastSessions));
  std::mt19937 random(seed);
  Sessions out;
  for (const Log& log : logs) out.sessions.push_back({log.name, log.t_s.back() - log.t_s.front(), {}});
  for (std::size_t s = 0; s < sensors.size(); ++s) {
    std::vector<std::size_t> read;
    std::vector<std::vector<double>> readings;
    std::vector<std::vector<double>> quantiles;
    for (std::size_t i = 0; i < logs.size(); ++i) {
      std::vector<double> known = logs[i].reading[s];
      std::erase_if(known, [](double u) { return std::isnan(u); });
      if (known.size() * 2 < logs[i].reading[s].size()) continue;  // it was not plugged in
      read.push_back(i);
      quantiles.push_back(quantiles_of(known));
      readings.push_back(std::move(known));
      if (!(span(quantiles.back()) > 0))
        throw io::InputError(fmt::format("{}: {} stands still: leave it out", logs[i].name, sensors[s]));
    }
    if (read.size() < kLeastSessions)
      throw io::InputError(
          fmt::format("{}: it was read in {} session(s), at least {} are needed: leave it out", sensors[s],
                      read.size(), kLeastSessions));
    std::vector<std::string> names;
    for (const std::size_t i : read) names.push_back(logs[i].name);
    refuse_other_units(sensors[s], names, quantiles);
    const std::vector<double> mean = mean_of(quantiles);
    for (std::size_t k = 0; k < read.size(); ++k)
      out.sessions[read[k]].sensors.push_back(change_of(sensors[s], readings[k], mean, random));
  }
  out.prior = shipped_prior();
  out.prior.sessions = static_cast<int>(logs.size());
  out.prior.shift_sd = std::max(1e-3, deviation(out, sensors, &SensorChange::shift));
  out.prior.log_gain_sd = std::max(1e-3, deviation(out, sensors, &SensorChange::log_gain));
  out.prior.alike = alike_of(out, shipped_prior().alike);
  return out;
}

Sessions compare_files(const std::vector<std::filesystem::path>& files, std::vector<std::string> sensors,
                       const std::string& time_unit) {
  if (sensors.empty()) {
    for (const std::string& column : recording::columns_of(files.at(0), time_unit, true)) {
      const std::string start = column.substr(0, column.find('_'));
      if (std::ranges::find(model::finger_names(), start) != model::finger_names().end())
        sensors.push_back(column);
    }
    if (sensors.empty())
      throw io::InputError(
          fmt::format("{}: no column is called like a finger: --sensors COLUMN,...", files[0].string()));
  }
  std::vector<Log> logs;
  for (const auto& file : files) {
    logs.push_back(read_session(file, sensors, time_unit));
    for (std::size_t s = 0; s < sensors.size(); ++s) {
      const std::string& first = logs.front().unit[s];
      const std::string& unit = logs.back().unit[s];
      if (first.empty() || unit.empty() || unit == first) continue;
      throw io::InputError(fmt::format("{}: {} is in {}, in {} it is in {}: leave the session out",
                                       file.string(), sensors[s], unit, files[0].string(), first));
    }
  }
  return compare(logs, sensors, 1);
}

Json to_json(const Sessions& all) {
  Json sessions = Json::array();
  for (const SessionChange& one : all.sessions) {
    Json sensors = Json::object();
    for (const SensorChange& s : one.sensors) {
      sensors[s.sensor] = {{"shift", change_json(s.shift)},
                           {"log_gain", change_json(s.log_gain)},
                           {"shape", s.shape},
                           {"noise", s.noise}};
    }
    sessions.push_back({{"name", one.name}, {"seconds", one.seconds}, {"sensors", std::move(sensors)}});
  }
  return {{"sessions", std::move(sessions)},
          {"prior",
           {{"shift_sd", all.prior.shift_sd},
            {"log_gain_sd", all.prior.log_gain_sd},
            {"alike", all.prior.alike}}},
          {"version", FLEXOR_VERSION}};
}

void save_results(const Sessions& sessions, const std::filesystem::path& folder) {
  Json json = {{"kind", "donning"}};
  json.update(to_json(sessions));
  io::make_folder(folder);
  io::write_file(folder / "results.json", io::dump(json));
}

}  // namespace flexor::donning
