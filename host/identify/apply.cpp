#include "host/identify/apply.hpp"

#include <fmt/format.h>

#include "host/identify/map_check.hpp"
#include "host/identify/readings.hpp"
#include "host/io/io.hpp"
#include "host/io/numbers.hpp"

namespace flexor::identify {
namespace {

constexpr double kSlow = 3;  // of a model's periods: a row's
constexpr std::size_t kMostSteps = 10'000;

template <class Arithmetic>
void start_tracking(Estimator<Arithmetic>& estimator, const std::string& source) {
  estimator.track({});
  if (estimator.trackers()->any()) return;
  throw io::InputError(
      "{}: no joint has one sensor whose readings at the open hand and at the fist are known: identify it "
      "again, each joint with its own sensor, or leave out --track",
      source);
}

}  // namespace

AnyEstimator estimator_of(const model::Model& model, const std::string& arithmetic) {
  if (arithmetic == "double") return Estimator<model::DoubleArithmetic>(model);
  if (arithmetic == "float") return Estimator<model::FloatArithmetic>(model);
  if (arithmetic == "fixed") return Estimator<model::FixedArithmetic>(model);
  throw io::InputError("arithmetic \"{}\": double, float or fixed", arithmetic);
}

Applied apply(const model::Model& model, recording::LogReader& log, const ApplyOptions& o,
              const std::function<void(const Estimate&)>& sink) {
  for (const model::Joint& joint : model.joints)
    if (o.intervals && !joint.accuracy)
      throw io::InputError(
          "{}: {} does not say how accurate it is: identify it with --pair, or leave out --intervals",
          o.source, joint.name);
  for (std::size_t i = 0; i < model.inputs.size(); ++i)
    if (const auto note = unit_note(model.inputs[i], log.name(), log.columns()[i], log.units()[i]))
      o.note(*note);
  recording::Stream stream(log, recording::Resets::follow);
  Applied out{{}, model::RangeCount(model), 0};
  const auto run = [&](auto& estimator) {
    if (o.track) start_tracking(estimator, o.source);
    recording::Row row;
    std::size_t rows = 0;
    double last_s = 0;
    std::vector<double> steps_s;
    for (; stream.next(row); ++rows) {
      if (o.progress) o.progress(rows);
      if (rows > 0 && row.t_s > last_s && steps_s.size() < kMostSteps) steps_s.push_back(row.t_s - last_s);
      last_s = row.t_s;
      turn_into_range(model, row.value);
      out.ranges.add(row.value);
      estimator.push(row.t_s, row.value, sink);
    }
    if (rows == 0) throw io::InputError("{}: no row with a reading of any input", log.name());
    if (!steps_s.empty()) out.row_period_s = io::median(steps_s);
    if (estimator.trackers()) out.followed = estimator.trackers()->followed();
  };
  AnyEstimator estimator = estimator_of(model, o.arithmetic);
  std::visit(run, estimator);
  for (const std::string& note : stream.notes()) o.note(note);
  return out;
}

void check_ranges(const model::Model& model, const std::string& file, const std::vector<std::string>& columns,
                  const model::RangeCount& ranges, const std::function<void(const std::string&)>& warn,
                  double row_period_s) {
  if (row_period_s > kSlow * model.sample_period_s)
    warn(
        fmt::format("{}: about {:.3g} rows a second, the model takes {:g}: its angles are late and coarse; "
                    "record faster, or identify with --rate {:.3g}",
                    file, 1 / row_period_s, 1 / model.sample_period_s, 1 / row_period_s));
  const auto moves = [](const model::InputCount& count) { return count.high > count.low; };
  const bool any_moves = std::ranges::any_of(ranges.counts(), moves);
  std::vector<std::string> doubts;
  std::vector<std::string> turned;
  std::string mend = "another board or divider, or a sensor that is not plugged in?";
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    const model::InputCount& count = ranges.counts()[i];
    const model::Input& input = model.inputs[i];
    const std::string read = fmt::format("of {} readings, which span {:g} to {:g}, lie outside of the",
                                         count.readings, count.low, count.high);
    const std::string outside = fmt::format("column \"{}\": {} {} model's range {:g} to {:g}", columns[i],
                                            count.outside, read, input.valid_min, input.valid_max);
    if (count.mostly_outside()) {
      doubts.push_back(outside);
    } else if (count.mostly_beyond()) {
      doubts.push_back(fmt::format("column \"{}\": {} {} {:g} to {:g} that the model was made from",
                                   columns[i], count.beyond, read, input.readings->reading.front(),
                                   input.readings->reading.back()));
    } else if (count.readings > 0 && 10 * count.outside >= count.readings) {
      warn(fmt::format("{}: {}", file, outside));
    }
    if (any_moves && !moves(count))
      warn(count.readings == 0
               ? fmt::format("{}: column \"{}\" has no reading", file, columns[i])
               : fmt::format("{}: column \"{}\" reads {:g} in all rows: is its sensor plugged in?", file,
                             columns[i], count.low));
    if (ranges.mirrored(i)) turned.push_back(columns[i]);
  }
  if (const auto pair = ranges.exchanged()) {
    const std::string& one = columns[pair->first];
    const std::string& other = columns[pair->second];
    mend = fmt::format(
        "\"{}\" and \"{}\" seem to be exchanged: exchange them with --input, and check the others", one,
        other);
    if (doubts.empty()) doubts.push_back("each reads as the other did when the model was made");
  }
  if (!turned.empty()) {
    mend = fmt::format(
        "{}: the converter's full scale minus the reading is what the model was made from: is the divider "
        "wired the other way round?",
        recording::listed(turned));
    if (doubts.empty()) warn(fmt::format("{}: {}", file, mend));
  }
  if (doubts.empty()) return;
  const std::string more =
      doubts.size() > 1 ? fmt::format("; and {} more column(s)", doubts.size() - 1) : std::string();
  throw io::Doubt("{}: {}{}: {}", file, doubts.front(), more, mend);
}

}  // namespace flexor::identify
