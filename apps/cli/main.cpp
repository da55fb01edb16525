#include <fmt/format.h>

#include <csignal>
#include <cstdio>
#include <exception>

#include "apps/cli/commands.hpp"
#include "host/io/io.hpp"

namespace flexor::cli {

void print(const std::string& text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0) {
    throw io::JobError("standard output: cannot be written");
  }
}

void log(const std::string& line) { fmt::print(stderr, "{}\n", line); }

}  // namespace flexor::cli

int main(int argc, char** argv) {
  using namespace flexor;
  constexpr int kFailed = 1;
  constexpr int kBadInput = 2;
  std::signal(SIGPIPE, SIG_IGN);
  CLI::App app("Flexor: turn a flex-sensor glove into a measuring instrument", "flexor");
  app.set_version_flag("--version", std::string("flexor ") + FLEXOR_VERSION);
  app.require_subcommand(1);
  cli::add_experiment(app);
  cli::add_calibrate_glove(app);
  cli::add_calibrate_twin(app);
  cli::add_twin(app);
  cli::add_align(app);
  cli::add_identify(app);
  cli::add_apply(app);
  cli::add_score(app);
  cli::add_show(app);
  try {
    app.parse(argc, argv);
    return 0;
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    cli::log(fmt::format("flexor: {} (try --help)", error.what()));
    return kBadInput;
  } catch (const io::InputError& error) {
    cli::log(fmt::format("flexor: {}", error.what()));
    return kBadInput;
  } catch (const io::JobError& error) {
    cli::log(fmt::format("flexor: {}", error.what()));
    return kFailed;
  } catch (const std::bad_alloc&) {
    cli::log("flexor: out of memory: is the recording's time column in the right unit?");
    return kFailed;
  } catch (const std::exception& error) {
    cli::log(fmt::format("flexor: {}: this is a defect of Flexor, please report it", error.what()));
    return kFailed;
  }
}
