// What an identification of a hand found, as files that its report is drawn from: results.json, scores.csv (every
// RMSE in a row: of all that is held out, of each pair, of each part that was left out), and beside them for
// the joint number N, from 1, samples-N.csv: t_s (since both logs of that pair run), pair (from 1), reading (of the own
// sensor), measured_deg, estimated_deg, straight_line_deg, line_lead_deg (NaN: no such line could be fitted), gap, held_out.
#pragma once

#include <filesystem>

#include "host/identify/identify.hpp"

namespace flexor::identify {

// Makes the folder if needed; every file appears whole or not at all. Throws io::InputError when it cannot be written.
void save_results(const Result& result, const std::filesystem::path& folder);

}  // namespace flexor::identify
