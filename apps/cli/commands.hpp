// The commands of `flexor`. Each adds itself to the parser; parsing runs it.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "apps/camera/cameras.hpp"
#include "host/study/boards.hpp"

namespace flexor::cli {

struct Program {
  int argc;
  char** argv;
  study::Boards* boards;            // null: not in this program
  const filming::Cameras* cameras;  // likewise

  // The boards; without any, this process becomes flexor-cosim with the same command line. Throws
  // io::InputError when there is no such program beside this one.
  study::Boards& require_boards() const;
  // The cameras; without any, flexor-camera.
  const filming::Cameras& require_cameras() const;
};

void add_align(CLI::App& app);
void add_camera(CLI::App& app, const Program& program);
void add_calibrate_glove(CLI::App& app);
void add_calibrate_twin(CLI::App& app);
void add_deploy(CLI::App& app, const Program& program);
void add_experiment(CLI::App& app, const Program& program);
void add_latency(CLI::App& app, const Program& program);
void add_track(CLI::App& app, const Program& program);
void add_twin(CLI::App& app);
void add_identify(CLI::App& app, const Program& program);
void add_apply(CLI::App& app);
void add_report(CLI::App& app);
void add_score(CLI::App& app);
void add_show(CLI::App& app);

// The twin as shipped or from a file, with parameters set. Throws io::InputError.
twin::Parameters twin_parameters(const std::string& file, const std::vector<std::string>& set);

inline constexpr const char* kTimeUnitHelp =
    "s, ms, us or ns: of a time column that states no unit (default: s)";

// A check for --seed: CLI11 alone takes -1 for 2^64 - 1. Empty, or what is wrong.
std::string seed_fault(const std::string& text);

// A reading in another unit than the model's would give angles that look right: throws io::InputError. Where
// either states none, a note says so. `unit` is that of the column for the model's channel.
void check_unit(const model::Channel& channel, const std::string& file, const std::string& column,
                const std::string& unit);

// Prints to standard output; throws io::JobError when it is closed or full.
void print(const std::string& text);

// One line on standard error.
void log(const std::string& line);

}  // namespace flexor::cli
