// The experiment's tables, figures and pictures of hands; as files, and as one page that reads well on a
// phone.
#pragma once

#include <string>
#include <vector>

#include "host/study/trials.hpp"

namespace flexor::report {

using namespace study;

struct ScenarioResult {
  Scenario scenario;
  Result result;
};

// The worst compensator's: fastest hit of any trial, mean of a trial's pressing over the motions.
struct Stops {
  double impact_deg_s = 0;
  double pressed_s = 0;
};
Stops stops_of(const Result& result);

struct TrialFigure {
  std::string name;  // file name without its ending
  std::string title;
  std::string caption;
  std::string svg;
  std::string pdf;
};

// errors: the table as bars; response_N and error_N: trial 0 of motion N with all compensators; posture_N:
// the hand at its end. Throws io::JobError when gnuplot is missing or fails, and io::Cancelled.
std::vector<TrialFigure> draw(const Plan& plan, const Result& result);

// results.json, report.html, and every figure as SVG and PDF.
void write_trial_report(const Plan& plan, const Result& result, const std::vector<ScenarioResult>& scenarios,
                        const std::filesystem::path& folder);

}  // namespace flexor::report
