// identify on files: two logs in, the machine-readable result out.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "host/identify/identification.hpp"

namespace flexor::identify {

struct SourceFiles {
  std::filesystem::path sensor;
  std::filesystem::path reference;
  std::string input = {};        // column of the sensor file; empty: its only column of numbers
  std::string output = {};       // column of the reference file, an angle; likewise
  std::string output_unit = {};  // deg or rad, where that column states none; empty: degrees
  std::string time_unit = {};    // s, ms, us or ns, of time columns that state none
};

// Throws io::InputError, listing the columns where one has to be named.
recording::Pair load_pair(SourceFiles files);

struct FileRequest : Request {
  SourceFiles files;
};

Identification identify_files(const FileRequest& request, const Progress& progress);

// The machine-readable result; see docs/json.md.
nlohmann::ordered_json to_json(const Identification& result);

}  // namespace flexor::identify
