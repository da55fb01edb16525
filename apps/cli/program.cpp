#include <fmt/format.h>

#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <exception>
#include <filesystem>

#include "apps/cli/commands.hpp"
#include "apps/cli/program.hpp"
#include "host/io/io.hpp"

namespace flexor::cli {

void print(const std::string& text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0) {
    throw io::JobError("standard output: cannot be written");
  }
}

namespace {

// Becomes the program of that name beside this one, with the same command line.
[[noreturn]] void become(const Program& program, const char* name, const char* what) {
  const auto beside = std::filesystem::read_symlink("/proc/self/exe").parent_path() / name;
  std::vector<char*> arguments(program.argv, program.argv + program.argc);
  arguments.push_back(nullptr);
  execv(beside.c_str(), arguments.data());
  throw io::InputError(fmt::format("{} is missing: it {}; script/build makes it", beside.string(), what));
}

}  // namespace

experiment::Boards& Program::require_boards() const {
  if (boards == nullptr) become(*this, "flexor-cosim", "runs the firmware on simulated boards");
  return *boards;
}

const experiment::Cameras& Program::require_cameras() const {
  if (cameras == nullptr) become(*this, "flexor-camera", "sees videos");
  return *cameras;
}

void log(const std::string& line) { fmt::print(stderr, "{}\n", line); }

int run(int argc, char** argv, experiment::Boards* boards, const experiment::Cameras* cameras) {
  constexpr int kFailed = 1;
  constexpr int kBadInput = 2;
  std::signal(SIGPIPE, SIG_IGN);
  CLI::App app("Flexor: turn a flex-sensor glove into a measuring instrument", "flexor");
  app.set_version_flag("--version", std::string("flexor ") + FLEXOR_VERSION);
  app.require_subcommand(1);
  const Program program{argc, argv, boards, cameras};
  add_experiment(app, program);
  add_calibrate_glove(app);
  add_calibrate_twin(app);
  add_twin(app);
  add_deploy(app, program);
  add_latency(app, program);
  add_align(app);
  add_identify(app, program);
  add_track(app, program);
  add_camera(app, program);
  add_apply(app);
  add_score(app);
  add_show(app);
  try {
    app.parse(argc, argv);
    return 0;
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    log(fmt::format("flexor: {} (try --help)", error.what()));
    return kBadInput;
  } catch (const io::InputError& error) {
    log(fmt::format("flexor: {}", error.what()));
    return kBadInput;
  } catch (const io::JobError& error) {
    log(fmt::format("flexor: {}", error.what()));
    return kFailed;
  } catch (const std::bad_alloc&) {
    log("flexor: out of memory: is the recording's time column in the right unit?");
    return kFailed;
  } catch (const std::exception& error) {
    log(fmt::format("flexor: {}: this is a defect of Flexor, please report it", error.what()));
    return kFailed;
  }
}

}  // namespace flexor::cli
