#include "host/identify/compare.hpp"

#include <fmt/format.h>

#include <cmath>

#include "host/io/io.hpp"
#include "host/recording/align.hpp"
#include "host/recording/pair.hpp"
#include "host/recording/resample.hpp"

namespace flexor::identify {

Compared compare(const recording::Log& measured, const std::string& column, const recording::Log& estimated,
                 const std::string& of, const recording::TimeOptions& time, double shift_s) {
  constexpr double kMoveTogether = 0.9;  // as eta^2
  constexpr double kDriftErrors = 4;     // standard errors
  Compared out;
  const auto angle = [&](const recording::Log& log, const std::string& name) {
    recording::Recording r = recording::read_angle(log, name, time);
    recording::to_degrees(r, name, "");
    out.notes.insert(out.notes.end(), r.warnings.begin(), r.warnings.end());
    return r;
  };
  const recording::Recording reference = angle(measured, column);
  recording::Recording estimate = angle(estimated, of);
  for (double& t : estimate.t_s) t += shift_s;
  const recording::Series y = reference.series(column), e = estimate.series(of);
  std::optional<recording::Alignment> clocks;  // none where the motion says too little of them
  try {
    clocks = recording::align(e, y);
    if (clocks->confidence < recording::kUnsure) clocks.reset();
  } catch (const io::JobError&) {  // too short, or two motions
  }
  const auto compared = [&](double by_s) {
    std::vector<double> t_s = estimate.t_s;
    for (double& t : t_s) t += by_s;
    return score::compare({y.t_s, y.value, recording::default_max_gap_s(y.t_s)},
                          {t_s, e.value, recording::default_max_gap_s(e.t_s)});
  };
  const double behind_s = clocks ? clocks->clock_offset_s : 0;
  const std::string shift =
      fmt::format("by their motion --estimate-offset {:.2f} puts the two on one clock", shift_s + behind_s);
  try {
    out.score = compared(0);
  } catch (const io::InputError& error) {
    throw io::InputError("{} and {}: {}: {}; {}", measured.string(), estimated.string(), column, error.what(),
                         clocks ? shift : "shift one with --estimate-offset");
  }
  if (out.score.left_out > 0)
    out.notes.push_back(fmt::format("{} of {} samples lie in gaps of the other file and are left out",
                                    out.score.left_out, out.score.left_out + out.score.samples));
  if (clocks && 2 * compared(behind_s).rmse_deg < out.score.lag_removed_rmse_deg)
    out.warnings.push_back(shift);
  else if (clocks && out.score.r2 < 0 && clocks->eta_squared > kMoveTogether)
    out.warnings.emplace_back(
        "the two move together and yet are far apart: has one another zero or sign, or radians?");
  else if (out.score.lag_at_edge)
    out.warnings.emplace_back(
        "the best lag lies at the edge of the search: are the two on the same clock? --estimate-offset "
        "shifts one");
  if (clocks && clocks->drift_se_ppm && std::abs(*clocks->drift_ppm) > kDriftErrors * *clocks->drift_se_ppm &&
      std::abs(*clocks->drift_ppm) * 1e-6 * clocks->overlap_s > recording::kVelocityError_s)
    out.warnings.push_back(
        fmt::format("the measured angle's clock runs {:+.2f} % fast, which the error holds too",
                    *clocks->drift_ppm * 1e-4));
  return out;
}

}  // namespace flexor::identify
