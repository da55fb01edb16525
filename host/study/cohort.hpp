// Many takes of many people, each to its model, and one tidy table of all: a row a subject, session and joint.
//
// A folder has run.json (what must be the same for a run to go on), rows/N.json (job N, from 1: the takes in the manifest's order, then
// with LeaveOut::person each subject that is left out), models/SUBJECT_SESSION.json and, once no row is missing, cohort.csv. Each file
// appears whole or not at all, and depends on manifest, options and version alone: neither on threads nor on how often the run was cut off.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "host/identify/identify.hpp"
#include "host/study/shard.hpp"

namespace flexor::study {

struct Take {
  std::size_t row = 0;  // of the manifest, as an editor counts lines
  std::string subject;
  std::string session;
  identify::PairFiles files;
  std::string digest;  // of both files' bytes
  std::string map;     // joint_map.hpp; empty: by the columns' names
  std::vector<std::string> covariates;
  std::string fault;  // file, row, column and why it cannot be tried; or empty
};

struct Manifest {
  std::filesystem::path folder;         // that paths are relative to
  std::string digest;                   // of its bytes and of the maps that it names
  std::vector<std::string> covariates;  // columns that are carried along
  std::vector<Take> takes;
};

// Columns subject, session, glove, reference, where there are maps map (empty, JOINT=SENSOR:ANGLE,... or a file with that), in any order, and covariates.
// Throws io::InputError, one line: a header that is wrong, or no row. What is wrong with a row is its fault.
Manifest read_manifest(const std::filesystem::path& path);

struct CohortRequest {
  Manifest manifest;
  identify::Request options;  // of every take; pairs and map are its own. leave_out: none or person
  std::filesystem::path folder;
  Shard shard;
  int threads = 0;                // on which takes are identified; 0: as many as the machine has
  std::function<bool()> goes_on;  // from any thread; false: stop, and throw io::Cancelled. Null: always
};

struct CohortResult {
  std::size_t takes = 0;
  std::vector<std::string> failed;  // of takes, why
  std::size_t warned = 0;           // takes that the table has warnings of
};

// Goes on where the folder's rows end; takes that failed, and those whose files were changed, are tried once more. Throws io::InputError: a folder of another manifest,
// other options or another version; io::JobError: a file cannot be written; io::Cancelled: stopped, and names what is kept.
CohortResult run_cohort(const CohortRequest& request,
                        const std::function<void(std::size_t done, std::size_t of)>& progress);

// Whether the folder is one of run_cohort's, whole or a shard.
bool is_cohort(const std::filesystem::path& folder);

// The folders of all shards to the bytes of the whole run. Throws io::InputError, before anything is written: folders that do not
// belong together, the same shard twice, and rows that are missing, each named.
void merge_cohort(const std::vector<std::filesystem::path>& parts, const std::filesystem::path& out);

}  // namespace flexor::study
