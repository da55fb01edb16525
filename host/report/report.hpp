// The files of one identification: report.html (self-contained), holdout.csv, and one SVG for each figure.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host/identify/identify_files.hpp"
#include "host/report/figures.hpp"

namespace flexor::report {

using namespace identify;

// One page that needs nothing else: summary for anybody first, then the checks for those who know.
std::string report_html(const Identification& result, const std::vector<Figure>& figures);

// t_s, measured_deg, estimated_deg, straight_line_deg and gap over the held-out part, in the sensor's clock.
recording::Recording holdout(const Identification& result);

// Makes the folder if needed and writes everything; every file appears whole or not at all.
// Throws io::InputError when it cannot be written, io::JobError when gnuplot fails.
void write_report(const Identification& result, const std::filesystem::path& folder);

}  // namespace flexor::report
