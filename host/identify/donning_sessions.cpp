#include "host/identify/donning_sessions.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "host/identify/joint_map.hpp"
#include "host/identify/line_estimate.hpp"
#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/recording/csv.hpp"

namespace flexor::identify {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array kInterval = {0.025, 0.975};
constexpr std::size_t kLeastSessions = 3;
constexpr std::size_t kParts = 10;
constexpr int kResamples = 200;
constexpr std::size_t kLeastRows = 10 * kParts;

Line against(const model::Spread& session, const model::Spread& mean) {
  return {(session.middle() - mean.middle()) / mean.span(), std::log(session.span() / mean.span())};
}

double shape_of(const model::Spread& session, const model::Spread& mean) {
  double sum = 0;
  for (std::size_t i = 0; i < mean.reading.size(); ++i) {
    const double place = (session.reading[i] - session.middle()) / session.span();
    const double at = (mean.reading[i] - mean.middle()) / mean.span();
    sum += (place - at) * (place - at) / static_cast<double>(mean.reading.size());
  }
  return std::sqrt(sum);
}

double middle_value(std::vector<double> values) {
  std::ranges::sort(values);
  return quantile_of(values, 0.5);
}

// 1.4826 times the median of what a reading is off the line through its neighbours, of which white noise has sqrt(3/2) times
// its own deviation.
double noise_of(const std::vector<double>& readings) {
  std::vector<double> off;
  for (std::size_t k = 1; k + 1 < readings.size(); ++k)
    off.push_back(std::abs(readings[k] - (readings[k - 1] + readings[k + 1]) / 2));
  return off.empty() ? 0 : 1.4826 * middle_value(std::move(off)) / std::sqrt(1.5);
}

Change interval(double value, std::vector<double> resampled) {
  const model::Spread ends = spread_of(std::move(resampled), kInterval);
  return {value, ends.reading.front(), ends.reading.back()};
}

SensorChange change_of(const std::string& sensor, const std::vector<double>& readings,
                       const model::Spread& session, const model::Spread& mean, std::mt19937& random) {
  std::vector<double> shift;
  std::vector<double> log_gain;
  std::uniform_int_distribution<std::size_t> part(0, kParts - 1);
  for (int r = 0; r < kResamples; ++r) {
    std::vector<double> drawn;
    for (std::size_t p = 0; p < kParts; ++p) {
      const std::size_t at = part(random);
      const double* const first = readings.data();
      drawn.insert(drawn.end(), first + at * readings.size() / kParts,
                   first + (at + 1) * readings.size() / kParts);
    }
    const model::Spread again = spread_of(std::move(drawn), kSpreadShares);
    if (!(again.span() > 0)) continue;
    const Line one = against(again, mean);
    shift.push_back(one.shift);
    log_gain.push_back(one.log_gain);
  }
  const Line all = against(session, mean);
  return {sensor, interval(all.shift, shift), interval(all.log_gain, log_gain), shape_of(session, mean),
          noise_of(readings) / mean.span()};
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

// Put on anew a glove reaches a few times as far at most. `read`: the sessions in which the sensor was.
void refuse_other_units(const std::string& sensor, const std::vector<Log>& logs,
                        const std::vector<std::size_t>& read, const std::vector<model::Spread>& sessions) {
  constexpr double kTimes = 10;
  std::vector<double> spans;
  for (const model::Spread& one : sessions) spans.push_back(one.span());
  const double usual = middle_value(spans);
  for (std::size_t i = 0; i < spans.size(); ++i) {
    if (spans[i] * kTimes > usual && spans[i] < kTimes * usual) continue;
    throw io::InputError(
        fmt::format("{}: {} spans {:.3g}, in most sessions {:.3g}: is it in another unit, or hardly moved? "
                    "Leave the session out",
                    logs[read[i]].name, sensor, spans[i], usual));
  }
}

// A file may hold many trials, each on a clock of its own: only the order of its rows counts.
Log read_session(const std::filesystem::path& path, const std::string& name,
                 const std::vector<std::string>& sensors, const recording::TimeOptions& time) {
  recording::CsvReader reader(path, {sensors, time, recording::Holes::all});
  Log out{std::filesystem::path(name).replace_extension().string(),
          {},
          std::vector<std::vector<double>>(sensors.size()),
          reader.units()};
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
  double shift_squares = 0;
  double log_gain_squares = 0;
  double freedom = 0;  // of both
  Sessions out;
  for (const Log& log : logs) out.sessions.push_back({log.name, log.t_s.back() - log.t_s.front(), {}});
  for (std::size_t s = 0; s < sensors.size(); ++s) {
    std::vector<std::size_t> read;
    std::vector<std::vector<double>> readings;
    std::vector<model::Spread> spreads;
    for (std::size_t i = 0; i < logs.size(); ++i) {
      std::vector<double> known = logs[i].reading[s];
      std::erase_if(known, [](double u) { return std::isnan(u); });
      if (known.size() * 2 < logs[i].reading[s].size()) continue;  // it was not plugged in
      read.push_back(i);
      if (!(spreads.emplace_back(spread_of(known, kSpreadShares)).span() > 0))
        throw io::InputError(fmt::format("{}: {} stands still: leave it out", logs[i].name, sensors[s]));
      readings.push_back(std::move(known));
    }
    if (read.size() < kLeastSessions)
      throw io::InputError(
          fmt::format("{}: it was read in {} session(s), at least {} are needed: leave it out", sensors[s],
                      read.size(), kLeastSessions));
    refuse_other_units(sensors[s], logs, read, spreads);
    const model::Spread mean = mean_of(spreads);
    std::vector<double> shift;
    std::vector<double> log_gain;
    for (std::size_t k = 0; k < read.size(); ++k) {
      const SensorChange change = change_of(sensors[s], readings[k], spreads[k], mean, random);
      shift.push_back(change.shift.value);
      log_gain.push_back(change.log_gain.value);
      out.sessions[read[k]].sensors.push_back(change);
    }
    shift_squares = add_squares(shift_squares, shift, 1);
    log_gain_squares = add_squares(log_gain_squares, log_gain, 1);
    freedom += static_cast<double>(read.size()) - 1;
  }
  out.prior = shipped_prior();
  out.prior.sessions = static_cast<int>(logs.size());
  out.prior.shift_sd = std::max(1e-3, std::sqrt(shift_squares / freedom));
  out.prior.log_gain_sd = std::max(1e-3, std::sqrt(log_gain_squares / freedom));
  out.prior.alike = alike_of(out, shipped_prior().alike);
  return out;
}

Sessions compare_files(const std::vector<std::filesystem::path>& files, std::vector<std::string> sensors,
                       const recording::TimeOptions& time) {
  if (sensors.empty()) {
    const recording::CsvReader first(files.at(0), {{}, time, recording::Holes::all});
    for (const std::string& column : first.columns()) {
      const std::string start = column.substr(0, column.find('_'));
      if (std::ranges::find(model::finger_names(), start) != model::finger_names().end())
        sensors.push_back(column);
    }
    if (sensors.empty())
      throw io::InputError(
          fmt::format("{}: no column is called like a finger: --sensors COLUMN,...", files[0].string()));
  }
  std::vector<Log> logs;
  const std::vector<std::string> names = short_names(files);
  for (const auto& file : files) {
    logs.push_back(read_session(file, names[logs.size()], sensors, time));
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

}  // namespace flexor::identify
