#include <fmt/format.h>

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <set>
#include <sstream>

#include "apps/cli/commands.hpp"
#include "apps/cli/program.hpp"
#include "host/identify/map_check.hpp"
#include "host/io/interrupt.hpp"
#include "host/io/io.hpp"
#include "host/io/process.hpp"
#include "host/report/gnuplot.hpp"
#include "host/report/render.hpp"

namespace flexor::cli {

namespace {

[[noreturn]] void standard_output_failed() {
  throw io::JobError(fmt::format("standard output: cannot be written: {}", std::strerror(errno)));
}

}  // namespace

void add_time_options(CLI::App& command, recording::TimeOptions& time) {
  command.add_option("--time-unit", time.unit,
                     "s, ms, us or ns: of a time column that states no unit (default: s)");
  command.add_option("--time-column", time.column, "which column is the time, where several could be");
  command.add_option("--log-rate", time.log_rate_hz, "rows a second of a log without any time");
}

void print(const std::string& text) { print_as_it_is(io::without_controls(text, "\n\r\t")); }

void print_as_it_is(const std::string& text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0) {
    standard_output_failed();
  }
}

namespace {

// A stream that was closed must not become the number of a file that is opened later, into which messages
// would go.
void occupy_standard_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(stream, F_GETFD) < 0) (void)open("/dev/null", O_RDWR);
  }
}

// Runs the command. Help, too, is an output that may fail, and some file systems tell a failure only on
// closing.
void parse(CLI::App& app, int argc, char** argv) {
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& help) {
    std::ostringstream text;
    (void)app.exit(help, text, text);
    print(text.str());
  }
  if (close(dup(STDOUT_FILENO)) != 0) standard_output_failed();
}

}  // namespace

void check_unit(const model::Input& input, const std::string& file, const std::string& column,
                const std::string& unit) {
  if (const auto note = identify::unit_note(input, file, column, unit)) log("note: " + *note);
}

// Losing a line of a log is no reason to lose the work.
void log(const std::string& line) {
  (void)std::fputs((io::without_controls(line, "\n\r\t") + "\n").c_str(), stderr);
}

void draw_report(const std::filesystem::path& folder, const std::atomic<bool>* stop) {
  report::render(folder, stop);
  if (const std::string why = report::gnuplot_missing(); !why.empty())
    log("warning: the report has no figures: " + why);
}

namespace {

// What every option of every command has in common.
void guard_options(CLI::App& app) {
  const auto not_empty = [](const std::string& value) {
    return value.empty() ? std::string("is empty: give a value, or leave the option out") : std::string();
  };
  const std::set<std::string> outputs = {"OUT", "--out", "--model", "--report", "--preview", "--save"};
  for (CLI::App* command : app.get_subcommands({})) {
    guard_options(*command);
    for (CLI::Option* option : command->get_options()) {
      if (option->get_items_expected_max() == 0) continue;  // a flag
      option->check(not_empty);
      // A pair's key may lie in the folder that is written: it is kept there.
      if (outputs.contains(option->get_name()) || option->get_name() == "--key") continue;
      option->each([](const std::string& values) {
        std::istringstream list(values);
        for (std::string value; std::getline(list, value, ',');) io::note_input(value);
        io::note_input(values);
      });
    }
  }
}

}  // namespace

int run(int argc, char** argv) {
  constexpr int kFailed = 1;
  constexpr int kBadInput = 2;
  constexpr int kDoubt = 3;
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  occupy_standard_streams();
  io::end_cleanly_on_signals();
  CLI::App app("Flexor: turn a flex-sensor glove into a measuring instrument", "flexor");
  app.set_version_flag("--version", std::string("flexor ") + FLEXOR_VERSION);
  app.require_subcommand(1);
  app.add_option_function<int>("--ends-with", io::end_with)->group("");  // a job of the live view, with it
  for (const auto add :
       {add_experiment, add_calibrate_twin, add_twin,     add_wiring, add_deploy,   add_flash,
        add_pair,       add_send,           add_latency,  add_ports,  add_live,     add_sessions,
        add_monitor,    add_record,         add_protocol, add_align,  add_identify, add_recalibrate,
        add_donning,    add_track,          add_camera,   add_apply,  add_posture,  add_export,
        add_score,      add_report,         add_show})
    add(app);
  guard_options(app);
  try {
    parse(app, argc, argv);
    return 0;
  } catch (const CLI::ParseError& error) {
    log(fmt::format("flexor: {} (try --help)", error.what()));
    return kBadInput;
  } catch (const io::InputError& error) {
    log(fmt::format("flexor: {}", error.what()));
    return kBadInput;
  } catch (const Doubt& error) {
    log(fmt::format("flexor: {}", error.what()));
    return kDoubt;
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
