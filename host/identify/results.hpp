// What an identification found, as files that its report is drawn from: results.json, and beside it samples.csv (every
// sample: t_s, reading, measured_deg, estimated_deg, straight_line_deg, gap, held_out), alignment_scan.csv and
// holdout.csv (the held-out part in the sensor's clock).
#pragma once

#include <filesystem>

#include "host/identify/identification.hpp"
#include "host/recording/recording.hpp"

namespace flexor::identify {

// t_s, measured_deg, estimated_deg, straight_line_deg and gap over the held-out part, in the sensor's clock.
recording::Recording holdout(const Identification& result);

// Makes the folder if needed; every file appears whole or not at all. Throws io::InputError when it cannot be written.
void save_results(const Identification& result, const std::filesystem::path& folder);

}  // namespace flexor::identify
