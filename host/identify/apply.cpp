#include "host/identify/apply.hpp"

#include <fmt/format.h>

#include "host/identify/map_check.hpp"
#include "host/io/io.hpp"

namespace flexor::identify {
namespace {

template <class Arithmetic>
void start_tracking(Estimator<Arithmetic>& estimator, const std::string& source) {
  estimator.track({});
  if (estimator.trackers()->any()) return;
  throw io::InputError(
      fmt::format("{}: no input says what its strip reads at the open hand and at the fist, against which "
                  "--track works: identify the model anew from a recording with both, or leave out --track",
                  source));
}

}  // namespace

AnyEstimator estimator_of(const model::Model& model, const std::string& arithmetic) {
  if (arithmetic == "double") return Estimator<model::DoubleArithmetic>(model);
  if (arithmetic == "float") return Estimator<model::FloatArithmetic>(model);
  if (arithmetic == "fixed") return Estimator<model::FixedArithmetic>(model);
  throw io::InputError(fmt::format("arithmetic \"{}\": double, float or fixed", arithmetic));
}

Applied apply(const model::Model& model, recording::LogReader& log, const ApplyOptions& o,
              const std::function<void(const Estimate&)>& sink) {
  for (const model::Joint& joint : model.joints) {
    if (o.intervals && !joint.accuracy)
      throw io::InputError(fmt::format(
          "{}: {} does not say how accurate it is: identify it with --pair, or leave out --intervals",
          o.source, joint.name));
  }
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    if (const auto note = unit_note(model.inputs[i], log.name(), log.columns()[i], log.units()[i]))
      o.note(*note);
  }
  recording::Stream stream(log, recording::Resets::follow);
  Applied out{{}, model::RangeCount(model)};
  const auto run = [&](auto& estimator) {
    if (o.track) start_tracking(estimator, o.source);
    recording::Row row;
    std::size_t rows = 0;
    for (; stream.next(row); ++rows) {
      if (o.progress) o.progress(rows);
      out.ranges.add(row.value);
      estimator.push(row.t_s, row.value, sink);
    }
    if (rows == 0) throw io::InputError(fmt::format("{}: no row with a reading of any input", log.name()));
    if (estimator.trackers()) out.followed = estimator.trackers()->followed();
  };
  AnyEstimator estimator = estimator_of(model, o.arithmetic);
  std::visit(run, estimator);
  for (const std::string& note : stream.notes()) o.note(note);
  return out;
}

}  // namespace flexor::identify
