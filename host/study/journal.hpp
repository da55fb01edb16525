// What an experiment keeps in its folder, so that it survives being killed at any instant:
//   run.json    the settings; a run goes on only with the same
//   trials.csv  a header and the rows of whole batches, in order; what follows the last whole one is cut off
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

#include "host/io/growing_file.hpp"
#include "host/io/io.hpp"
#include "host/score/trial.hpp"
#include "host/twin/parameters.hpp"

namespace flexor::study {

// Whether what run.json holds is `settings`, sealed or not.
bool is_same_run(Json there, const Json& settings);
// Likewise of the folder's; false: it has none. Throws io::InputError: it has another run's.
bool is_same_run(const std::filesystem::path& folder, const Json& settings);

// Adds to the run.json of a run that is whole the digest of what it found. Throws io::InputError: it has another one.
void seal(const std::filesystem::path& folder, Json settings, const std::string& digest);
bool is_sealed(const std::filesystem::path& folder);
// Throws io::InputError: it has another one, or none.
void require_sealed(const std::filesystem::path& folder, const std::string& digest);

// A row of trials.csv: one trial of one motion with one compensator.
struct TrialRow {
  double total_deg_s = 0;
  std::optional<score::LagRemoved> lag_removed;  // none: two empty fields
  twin::PerFinger finger_deg_s{};
  twin::PerFinger swing_deg{};  // from the hand's smallest angle to its largest
  twin::PerFinger impact_deg_s{};
  twin::PerFinger pressed_s{};
  int sent = 0;
  int lost = 0;

  bool operator==(const TrialRow&) const = default;
};

// Goes up when a row's numbers change their meaning; part of a run's settings.
inline constexpr int kRowsVersion = 2;

// A whole line; numbers read back to the bit.
std::string text_of_row(const std::string& motion, const std::string& compensator, int trial,
                        const TrialRow& row);

// A line without its end back to numbers; false if it is not one of ours.
bool parse_row(const std::string& line, const std::string& motion, const std::string& compensator, int trial,
               TrialRow& row);

// First next() and keep() until the rows end, then start(), append() and finish(). The folder is locked.
class Journal {
 public:
  // Throws io::InputError: another run's folder.
  Journal(const std::filesystem::path& folder, const Json& settings);

  // The next row without its newline; false at the end, and for a last row that lacks its newline.
  bool next(std::string& row);

  // The rows that next() gave since are a batch, which stays.
  void keep();

  // Cuts off what was not kept. Throws io::JobError.
  void start();

  // All of the batch `rows`, or an io::JobError and nothing of them.
  void append(const std::string& rows);

  // The file is whole and on the disk; throws io::JobError otherwise.
  void finish() { file_->bring_to_disk(); }

  // Of all batches, as seal() has it.
  std::string digest() const { return digest_.empty() ? "no rows" : digest_; }

 private:
  std::filesystem::path path_;
  std::ifstream old_;
  std::string batch_;
  std::string digest_;
  std::uintmax_t kept_bytes_ = 0;
  std::optional<io::GrowingFile> file_;
};

}  // namespace flexor::study
