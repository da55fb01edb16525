#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <numeric>
#include <set>
#include <sstream>
#include <string_view>
#include <vector>

#include "apps/cli/commands.hpp"
#include "apps/cli/job.hpp"
#include "host/io/interrupt.hpp"
#include "host/io/posix.hpp"
#include "host/io/process.hpp"

namespace flexor::cli {

namespace {

[[noreturn]] void standard_output_failed() {
  throw io::JobError("standard output: cannot be written: {}", std::strerror(errno));
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
  } catch (const CLI::ParseError& error) {
    throw io::InputError("{} (try --help)", error.what());
  }
  if (close(dup(STDOUT_FILENO)) != 0) standard_output_failed();
}

// What every option of every command has in common.
void guard_options(CLI::App& app) {
  const auto not_empty = [](const std::string& value) {
    return value.empty() ? std::string("is empty: give a value, or leave the option out") : std::string();
  };
  const auto finite = [](const std::string& number) {  // nan lies within every range of CLI11
    return std::isfinite(std::strtod(number.c_str(), nullptr)) ? std::string()
                                                               : number + " is no finite number";
  };
  const std::set<std::string> outputs = {"OUT", "--out", "--model", "--report", "--preview", "--save"};
  for (CLI::App* command : app.get_subcommands({})) {
    guard_options(*command);
    for (CLI::Option* option : command->get_options()) {
      if (option->get_items_expected_max() == 0) continue;  // a flag
      option->check(not_empty);
      if (option->get_type_name().starts_with("FLOAT")) option->check(finite);
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

constexpr std::pair<const char*, const char*> kMore[] = {
    {"twin record", "flexor twin record --out glove/"},
    {"twin wear", "flexor twin wear --port-link glove --key pair.key"},
    {"camera calibrate", "flexor camera calibrate board1.png board2.png --out lens.json"},
    {"camera film", "flexor camera film --out hand/"},
    {"posture complete",
     "flexor posture complete models/posture.json angles.csv --from index_mcp_deg --out hand.csv"},
};

// Help begins with an example.
void begin_with(CLI::App& command, const char* example) {
  command.description(fmt::format("{}\n\n{}", example, command.get_description()));
}

// In the list of commands: what it does in a few words, and an example.
class Formatter : public CLI::Formatter {
 public:
  std::string make_subcommand(const CLI::App* command) const override {
    const std::string text = command->get_description();
    const std::string about =
        text.substr(text.rfind("\n\n") == std::string::npos ? 0 : text.rfind("\n\n") + 2);
    const std::string example = about.size() == text.size() ? "" : text.substr(0, text.find('\n'));
    return fmt::format("  {:<16}{}\n{:18}{}\n", command->get_name(),
                       about.substr(0, about.find_first_of(":;,(")), "", example);
  }
};

// Letters to insert, to leave out and to change.
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t corner = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j)
      corner =
          std::exchange(row[j + 1], std::min({row[j] + 1, row[j + 1] + 1, corner + (a[i] != b[j] ? 1 : 0)}));
  }
  return row.back();
}

// Commands that Python has taken over.
constexpr std::pair<const char*, const char*> kMoved[] = {
    {"calibrate-twin", "python -m flexor.laboratories draw --out laboratories.json"},
    {"donning", "python -m flexor.donning FILE... --out prior.json"},
    {"posture learn", "python -m flexor.posture_learning FILE... --out posture.json"},
};

void require_command(const CLI::App& app, const std::string& name, const std::string& next) {
  for (const auto& [moved, instead] : kMoved)
    if (name == moved || fmt::format("{} {}", name, next) == moved)
      throw io::InputError("{} is Python's now: {}", moved, instead);
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
  if (name.starts_with('-') || std::ranges::find(names, name) != names.end()) return;
  throw io::InputError(
      "there is no command {}: did you mean {}? flexor help lists all", name,
      *std::ranges::min_element(names, {}, [&](const std::string& one) { return distance(name, one); }));
}

// Whatever ends a command: its exit status. What fails once a signal has come is nobody's fault.
int failed(Json answer) {
  const auto is_cancelled = [&] { return answer.at("error").at("kind") == "cancelled"; };
  if (io::is_interrupted() && !is_cancelled()) answer = io::answer([] { return io::go_on(), Json(); });
  log("flexor: " + io::bytes_from_json(answer.at("error").at("text")));
  if (is_cancelled()) io::end_by_signal();
  return status_of(answer);
}

}  // namespace

void add_time_options(CLI::App& command, recording::TimeOptions& time) {
  command.add_option("--time-unit", time.unit,
                     "s, ms, us or ns: of a time column that states no unit (default: s)");
  command.add_option("--time-column", time.columns,
                     "which column is the time, where several could be; once more for a second file");
  command.add_option("--log-rate", time.log_rate_hz, "rows a second of a log without any time")
      ->check(CLI::Range(0.01, 1e5));
}

void set_rate(model::Model& model, std::optional<double> rate_hz) {
  if (!rate_hz) return;
  if (!(*rate_hz > 0))
    throw io::InputError("--rate must be a positive number of samples a second: 10, 20, 50 or 100");
  model.sample_period_s = 1 / *rate_hz;
  model::check(model);
}

twin::Parameters twin_parameters(const TwinFiles& twin) {
  twin::Parameters p = twin.file.empty() ? twin::Parameters() : twin::load(twin.file);
  for (const std::string& assignment : twin.set) twin::assign(p, assignment);
  twin::check(p);
  return p;
}

void add_twin_options(CLI::App& command, TwinFiles& twin, const char* about) {
  command.add_option("--twin", twin.file, about);
  command.add_option("--set", twin.set, "change one of its values: radio.loss=0.05; may be repeated");
}

std::map<std::string, std::pair<double, double>> ends_deg(const std::string& file) {
  std::map<std::string, std::pair<double, double>> out;
  if (file.empty()) return out;
  const model::Model model = model::load(file);
  for (const model::Joint& joint : model.joints) {
    const model::Ends ends = model::ends(model, joint);
    out[joint.name] = {ends.open_deg, ends.fist_deg};
  }
  return out;
}

void add_hardware(CLI::App& command, std::string& hardware) {
  add_shown(command, "--hardware", hardware,
            "glove and hand: flexor, lucidgloves, or a document (flexor show --hardware)");
}

void add_seed(CLI::App& command, std::uint64_t& seed, const char* about) {
  // CLI11 alone takes -1 for 2^64 - 1.
  const auto fault = [](const std::string& text) {
    std::uint64_t value = 0;
    const char* const end = text.data() + text.size();
    const auto [at, error] = std::from_chars(text.data(), end, value);
    return error == std::errc() && at == end
               ? std::string()
               : fmt::format("{} is no whole number from 0 to {}", text, UINT64_MAX);
  };
  add_shown(command, "--seed", seed, about)->check(fault);
}

void add_compensator(CLI::App& command, std::string& model, double& rate_hz) {
  add_shown(command, "--compensator", model, "raw, published-w, published-hw, or a model file");
  add_shown(command, "--rate", rate_hz, "sample rate of the glove: 10, 20, 50 or 100 Hz");
}

void add_duration(CLI::App& command, double& for_s) {
  add_positive(command, "--for", for_s, "seconds (default: until Ctrl-C)");
}

CLI::Option* add_port(CLI::App& command, std::string& port, const std::string& of) {
  return add_shown(command, "--port", port, "serial port" + of + ", or auto: the only one there is");
}

void print(Output output, bool as_json) {
  for (const std::string& note : as_json ? std::vector<std::string>() : output.notes) log_note(note);
  if (!as_json) log_warnings(output.warnings);
  output.json.emplace("version", FLEXOR_VERSION);
  print(as_json ? io::dump(output.json) : output.text);
}

std::string line_of(const char* what, const std::filesystem::path& folder, const char* file) {
  return folder.empty() ? "" : fmt::format("{:<9}{}{}\n", what, folder.string(), file);
}

void print(const std::string& text) { print_as_it_is(io::without_controls(text, "\n\r\t")); }

void print_as_it_is(const std::string& text) {
  if (job_output != nullptr) return void(job_output->result += text);
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0) {
    standard_output_failed();
  }
}

// Losing a line of a log is no reason to lose the work.
void log(const std::string& line, const char* kind) {
  if (job_output != nullptr) {
    const std::string text =
        line.substr(line.starts_with(std::string(kind) + ": ") ? std::strlen(kind) + 2 : 0);
    return void(job_output->event({{"warning", {{"kind", kind}, {"text", io::to_utf8(text)}}}}));
  }
  (void)std::fputs((io::without_controls(line, "\n\r\t") + "\n").c_str(), stderr);
}

void add_commands(CLI::App& app) {
  app.require_subcommand(1);
  app.formatter(std::make_shared<Formatter>());
#define FLEXOR_ADD_COMMAND(name, group_of, example) \
  name##_command::add(app);                         \
  begin_with(*app.get_subcommand(#name)->group(group_of), example);
  FLEXOR_COMMANDS(FLEXOR_ADD_COMMAND)
#undef FLEXOR_ADD_COMMAND
  for (const auto& [path, example] : kMore) {
    CLI::App* command = &app;
    std::istringstream names(path);
    for (std::string name; names >> name;) command = command->get_subcommand(name);
    begin_with(*command, example);
  }
  guard_options(app);
}

int run(int argc, char** argv) {
  constexpr int kBadInput = 2;
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  // A stream that was closed must not become the number of a file that is opened later, into which messages would go.
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (fcntl(stream, F_GETFD) < 0) (void)open("/dev/null", O_RDWR);
  const bool is_worker = argc == 2 && std::string_view(argv[1]) == "job";
  io::stop_on_signals(!is_worker);
  CLI::App app("Flexor: turn a flex-sensor glove into a measuring instrument", "flexor");
  app.allow_windows_style_options(false);  // /folder is a name there too
  app.set_version_flag("--version", std::string("flexor ") + FLEXOR_VERSION);
  add_commands(app);
  try {
    const Json answer = io::answer([&] {
      if (argc < 2 || std::string_view(argv[1]) == "help") {
        print(app.help());
        if (argc < 2) throw JobEnded{kBadInput};
        return Json();
      }
      require_command(app, argv[1], argc > 2 ? argv[2] : "");
      parse(app, argc, argv);
      return Json();
    });
    return answer.contains("error") ? failed(answer) : 0;
  } catch (const JobEnded& job) {
    return job.status;
  }
}

}  // namespace flexor::cli
