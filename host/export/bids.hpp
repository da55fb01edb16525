// A BIDS dataset with motion: a folder that holds one subject or more, each with runs of one tracking system, the glove.
//
//   dataset_description.json, README.md, participants.tsv
//   sub-01/motion/sub-01_task-motion_tracksys-glove[_run-1]_{motion.tsv, motion.json, channels.tsv}
//
// A row for each sample, evenly spaced, degrees; `n/a` where an angle is not known. The last column is `latency`, the
// seconds from the first sample on by the recording's own times, to the microsecond: the rate alone would lose them.
// A recording is even where no step differs from the mean by more than 15 % (clocks are written in whole milliseconds)
// and no sample lies more than one mean step from its place at an even rate; otherwise a rate is to be given, for the
// causal resampler.
//
// A new dataset is there whole or not at all. Into one that is there a subject, a task or a run is added, its files all or
// none; nothing that is there is changed, but for a line in participants.tsv. One export at a time.
//
// Source: BIDS 1.10.0, Motion; JNTANG is its type of joint angles, LATENCY of times. MotionChannelCount counts both, as
// the columns of motion.tsv are counted and as the standard's own example motion_dualtask has it.
#pragma once

#include <filesystem>
#include <vector>

#include "host/export/angles.hpp"

namespace flexor::exports {

struct BidsOptions {
  std::string subject = "01";
  std::string task = "motion";
  int run = 0;  // of the first recording; 0: one recording has none, several count from 1
};

// Throws io::InputError and io::JobError.
Written write_bids(const std::vector<std::filesystem::path>& recordings, const AngleOptions& angles,
                   const BidsOptions& options, const std::filesystem::path& folder);

}  // namespace flexor::exports
