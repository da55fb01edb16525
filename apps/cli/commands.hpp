// The commands of `flexor`. Each adds itself to the parser; parsing runs it.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

#include "host/io/worker.hpp"
#include "host/model/range_count.hpp"
#include "host/recording/time.hpp"
#include "host/study/boards.hpp"

namespace flexor::cli {

// What a command found: for programs, to which the version is added, and for people.
struct Output {
  nlohmann::ordered_json json;
  std::string text;
};
void print(Output output, bool as_json);

// A command; its options live until `run` gets them. `json`: what --json prints, where they have it.
template <class Options, class Result>
std::pair<std::remove_const_t<Options>*, CLI::App*> add_command(
    CLI::App& app, const char* name, const char* about, Result (*run)(Options&),
    const char* json = "one JSON object on standard output") {
  const auto options = std::make_shared<std::remove_const_t<Options>>();
  CLI::App* command = app.add_subcommand(name, about);
  command->callback([options, run] {
    if constexpr (std::is_void_v<Result>) {
      run(*options);
    } else {
      print(run(*options), options->json);
    }
  });
  if constexpr (requires { options->json; }) command->add_flag("--json", options->json, json);
  return {options.get(), command};
}

// Parses and runs; the exit status.
int run(int argc, char** argv);
// All commands of `app`, as run() parses them.
void add_commands(CLI::App& app);

void add_align(CLI::App& app);
void add_protocol(CLI::App& app);
void add_camera(CLI::App& app);
void add_deploy(CLI::App& app);
void add_experiment(CLI::App& app);
void add_export(CLI::App& app);
void add_flash(CLI::App& app);
void add_latency(CLI::App& app);
void add_live(CLI::App& app);
void add_monitor(CLI::App& app);
void add_pair(CLI::App& app);
void add_posture(CLI::App& app);
void add_ports(CLI::App& app);
void add_record(CLI::App& app);
void add_track(CLI::App& app);
void add_twin(CLI::App& app);
void add_twin_wear(CLI::App& twin);
void add_identify(CLI::App& app);
void add_job(CLI::App& app);
void add_apply(CLI::App& app);
void add_merge(CLI::App& app);
void add_recalibrate(CLI::App& app);
void add_report(CLI::App& app);
void add_score(CLI::App& app);
void add_send(CLI::App& app);
void add_show(CLI::App& app);
void add_wiring(CLI::App& app);

// The twin as shipped or from a file, with parameters set. Throws io::InputError.
struct TwinFiles {
  std::string file;
  std::vector<std::string> set;
};
twin::Parameters twin_parameters(const TwinFiles& twin);
// --twin, which is `about`, and --set.
void add_twin_options(CLI::App& command, TwinFiles& twin,
                      const char* about = "configuration of the twin (default: the shipped one)");

// For options that name a folder: without a "/" at its end, since names of files follow one.
inline const CLI::Validator kFolder(
    [](std::string& name) {
      while (name.size() > 1 && name.ends_with('/')) name.pop_back();
      return std::string();
    },
    "");

// The sample rate of --rate, where it is given. Throws io::InputError.
void set_rate(model::Model& model, std::optional<double> rate_hz);

// --hardware, of real boards.
void add_hardware(CLI::App& command, std::string& hardware);

// What a log does not say of its times.
void add_time_options(CLI::App& command, recording::TimeOptions& time);

// Of each joint of the model in `file`: its angles at the open hand and at the fist. None where no file is given.
std::map<std::string, std::pair<double, double>> ends_deg(const std::string& file);

void add_seed(CLI::App& command, std::uint64_t& seed,
              const char* about = "everything random follows from it");
// --compensator and --rate of simulated boards; --for; --port of one board.
void add_compensator(CLI::App& command, std::string& model, double& rate_hz);
void add_duration(CLI::App& command, double& for_s);
CLI::Option* add_port(CLI::App& command, std::string& port, const std::string& of);

// A reading in another unit than the model's would give angles that look right: throws io::InputError. Where
// either states none, a note says so. `unit` is that of the column for the model's input.
void check_unit(const model::Input& input, const std::string& file, const std::string& column,
                const std::string& unit);

// Throws io::Doubt, one line, where the model hardly knows what the columns of the log hold; warns where it knows a part.
void check_ranges(const model::Model& model, const std::string& file, const std::vector<std::string>& columns,
                  const model::RangeCount& ranges);

// The recommended motion as a guide for a terminal: what to do now, for how long still, what comes next, how far to close.
// `wait` returns at t_s of the motion, or later, with the time that it is then; below zero it has not begun. `write` gets
// the same lines again and again, each time over those before, and a bell where there is something else to do.
void guide_motion(const std::function<double(double t_s)>& wait,
                  const std::function<void(const std::string& text)>& write);

// The workers beside this program.
inline constexpr const char* kCameraWorker = "flexor-camera";
inline constexpr const char* kBoardsWorker = "flexor-cosim";

// A video to angles, as `flexor track` does it. Empty paths: none.
struct TrackOptions {
  std::filesystem::path video;
  std::filesystem::path joints;
  std::filesystem::path lens;
  std::filesystem::path out;
  std::filesystem::path preview;
  std::filesystem::path report;
  double seconds = 0;  // stop after these; 0: at the end
};
// With progress on standard error; what `flexor track --json` prints. As soon as `goes_on` is false it ends and
// keeps what there is. Throws as the job does.
nlohmann::ordered_json track_video(io::Worker& camera, const TrackOptions& options,
                                   const std::function<bool()>& goes_on);

// Prints to standard output, control characters but line ends and tabs as question marks; throws io::JobError when it is closed or full.
void print(const std::string& text);
// Likewise with our own escapes: what is foreign in it was given to io::one_line.
void print_as_it_is(const std::string& text);

// One line on standard error, or a warning of the job: a message of its own kind, "warning: ..." or "note: ...".
void log(const std::string& line, const char* kind = "message");
inline void log_warning(const std::string& text) { log("warning: " + text, "warning"); }
inline void log_note(const std::string& text) { log("note: " + text, "note"); }

}  // namespace flexor::cli
