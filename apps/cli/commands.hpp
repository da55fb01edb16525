// The commands of `flexor`. Each adds itself to the parser; parsing runs it.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace flexor::cli {

void add_align(CLI::App& app);
void add_calibrate_glove(CLI::App& app);
void add_calibrate_twin(CLI::App& app);
void add_experiment(CLI::App& app);
void add_twin(CLI::App& app);
void add_identify(CLI::App& app);
void add_apply(CLI::App& app);
void add_score(CLI::App& app);
void add_show(CLI::App& app);

// Prints to standard output; throws io::JobError when it is closed or full.
void print(const std::string& text);

// One line on standard error.
void log(const std::string& line);

}  // namespace flexor::cli
