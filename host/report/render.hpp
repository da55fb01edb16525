// The report of a job from what the job saved, and from nothing else: it never simulates, fits or measures.
//
// A job writes results.json and its tables into a folder and then calls render(); `flexor report FOLDER` calls the
// same, and writes the same bytes.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace flexor::report {

// Writes report.html, for a hand also joint-N.html for each joint, N from 1; a page needs nothing else. With `draws_files` also
// each curve as NAME.svg and NAME.pdf, by gnuplot, and each drawing as SVG. Every file appears whole or not at all. Throws
// io::InputError for a folder without results or with other ones than this version writes, and where gnuplot is missing.
void render(const std::filesystem::path& folder, bool draws_files = false);

// What a page begins with, for a terminal: of a job of this kind by what it found, saved or not.
std::string summary(const std::string& kind, const nlohmann::ordered_json& results);

// Takes away what an identification and its report have left for each joint: the next one may have fewer.
void clear_hand(const std::filesystem::path& folder);

}  // namespace flexor::report
