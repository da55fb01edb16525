// The commands of `flexor`. Each adds itself to the parser; parsing runs it. What this includes, a command does not include again.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

#include "host/io/json.hpp"
#include "host/io/worker.hpp"
#include "host/recording/time.hpp"
#include "host/study/boards.hpp"

namespace flexor::cli {

using Json = nlohmann::ordered_json;

// What a command found: for programs, to which the version is added, and for people, who get notes and warnings before it.
struct Output {
  Json json;
  std::string text;
  std::vector<std::string> warnings = {};
  std::vector<std::string> notes = {};
};
void print(Output output, bool as_json);

// "report   rep/report.html" at the end of a command's words; nothing where it was not asked for.
std::string line_of(const char* what, const std::filesystem::path& folder, const char* file = "");

// A command; its options live until `run` gets them. `json`: what --json prints, where it has an Output, or they have `json`.
template <class Options, class Result>
std::pair<std::remove_const_t<Options>*, CLI::App*> add_command(
    CLI::App& app, const char* name, const char* about, Result (*run)(Options&),
    const char* json = "one JSON object on standard output") {
  const auto options = std::make_shared<std::remove_const_t<Options>>();
  CLI::App* command = app.add_subcommand(name, about);
  auto as_json = std::make_shared<bool>(false);
  if constexpr (requires { options->json; }) as_json = {options, &options->json};
  if constexpr (std::is_void_v<Result>) {
    command->callback([options, run] { run(*options); });
  } else {
    command->callback([options, run, as_json] { print(run(*options), *as_json); });
  }
  if (!std::is_void_v<Result> || requires { options->json; }) command->add_flag("--json", *as_json, json);
  return {options.get(), command};
}

// Parses and runs; the exit status.
int run(int argc, char** argv);
// All commands of `app`, as run() parses them.
void add_commands(CLI::App& app);

// Every command of `flexor`: its name, where help lists it, and an example.
#define FLEXOR_COMMANDS(X)                                                                            \
  X(live, "See it", "flexor live --demo")                                                             \
  X(monitor, "See it", "flexor monitor --from twin")                                                  \
  X(wiring, "A glove", "flexor wiring --hardware lucidgloves --out wiring/")                          \
  X(ports, "A glove", "flexor ports")                                                                 \
  X(record, "A glove", "flexor record glove.csv")                                                     \
  X(protocol, "A glove", "flexor protocol")                                                           \
  X(identify, "Logs", "flexor identify --pair glove.csv camera.csv --model hand.json")                \
  X(apply, "Logs", "flexor apply hand.json glove.csv > angles.csv")                                   \
  X(score, "Logs", "flexor score camera.csv angles.csv")                                              \
  X(align, "Logs", "flexor align --sensor glove.csv --reference camera.csv --out aligned.csv")        \
  X(recalibrate, "Logs", "flexor recalibrate hand.json --recording tomorrow.csv --out tomorrow.json") \
  X(track, "Logs", "flexor track hand.mp4 --joints joints.json --out angles.csv")                     \
  X(camera, "Logs", "flexor camera calibrate board1.png board2.png --out lens.json")                  \
  X(posture, "Logs",                                                                                  \
    "flexor posture complete models/posture.json angles.csv --from index_mcp_deg --out hand.csv")     \
  X(export, "Logs", "flexor export angles.csv --to mcap --out angles.mcap")                           \
  X(show, "Logs", "flexor show hand.json")                                                            \
  X(report, "Logs", "flexor report report/")                                                          \
  X(deploy, "Boards", "flexor deploy hand.json --rate 50 --output opengloves --out vr/")              \
  X(flash, "Boards", "flexor flash firmware/ --board glove --port auto")                              \
  X(pair, "Boards", "flexor pair --glove /dev/ttyUSB0 --hand /dev/ttyUSB1")                           \
  X(send, "Boards", "flexor send hand.json --rate 10 --port auto --key firmware/pair.key")            \
  X(latency, "Boards", "flexor latency --compensator published-hw")                                   \
  X(experiment, "The paper", "flexor experiment --trials 200 --out paper/")                           \
  X(merge, "The paper", "flexor merge shard1/ shard2/ --out paper/")                                  \
  X(twin, "The paper", "flexor twin record --out glove/")                                             \
  X(job, "Programs", "flexor job identify < request.json")                                            \
  X(completion, "Programs", "flexor completion bash > flexor.bash")
#define FLEXOR_ADD_COMMAND(name, group, example) \
  namespace name##_command {                     \
    void add(CLI::App& app);                     \
  }
FLEXOR_COMMANDS(FLEXOR_ADD_COMMAND)
#undef FLEXOR_ADD_COMMAND
namespace wear_command {
void add(CLI::App& twin);
}

// The twin as shipped or from a file, with parameters set. Throws io::InputError.
struct TwinFiles {
  std::string file;
  std::vector<std::string> set;
};
twin::Parameters twin_parameters(const TwinFiles& twin);
// --twin, which is `about`, and --set.
void add_twin_options(CLI::App& command, TwinFiles& twin,
                      const char* about = "configuration of the twin (default: the shipped one)");

// An option with a value for each of some names.
template <class T>
CLI::Option* add_choice(CLI::App& command, const std::string& name, T& to,
                        const std::map<std::string, T>& choices, const std::string& about) {
  CLI::Option* const out = command.add_option_function<std::string>(
      name, [&to, choices](const std::string& one) { to = choices.at(one); }, about);
  for (const auto& [choice, value] : choices)
    if (value == to) out->default_str(choice);
  return out->check(CLI::IsMember(choices));
}

// Of which help shows the default.
template <class T>
CLI::Option* add_shown(CLI::App& command, const std::string& name, T& to, const std::string& about) {
  return command.add_option(name, to, about)->capture_default_str();
}
template <class T>
CLI::Option* add_positive(CLI::App& command, const std::string& name, T& to, const std::string& about) {
  return command.add_option(name, to, about)->check(CLI::Range(1e-3, 1e9));
}
// Without a "/" at its end, since names of files follow one.
template <class T>
CLI::Option* add_folder(CLI::App& command, const std::string& name, T& to, const std::string& about) {
  return command.add_option(name, to, about)->transform([](std::string folder) {
    while (folder.size() > 1 && folder.ends_with('/')) folder.pop_back();
    return folder;
  });
}

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
Json track_video(io::Worker& camera, const TrackOptions& options, const std::function<bool()>& goes_on);

// Prints to standard output, control characters but line ends and tabs as question marks; throws io::JobError when it is closed or full.
void print(const std::string& text);
// Likewise with our own escapes: what is foreign in it was given to io::one_line.
void print_as_it_is(const std::string& text);

// One line on standard error, or a warning of the job: a message of its own kind, "warning: ..." or "note: ...".
void log(const std::string& line, const char* kind = "message");
inline void log_warning(const std::string& text) { log("warning: " + text, "warning"); }
inline void log_warnings(const std::vector<std::string>& texts) {
  for (const std::string& text : texts) log_warning(text);
}
inline void log_note(const std::string& text) { log("note: " + text, "note"); }

}  // namespace flexor::cli
