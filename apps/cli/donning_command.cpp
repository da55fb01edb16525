#include <fmt/format.h>

#include "apps/cli/commands.hpp"
#include "host/identify/donning_sessions.hpp"
#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/report/render.hpp"

namespace flexor::cli {
namespace donning_command {

struct Options {
  std::vector<std::filesystem::path> files;
  std::vector<std::string> sensors;
  recording::TimeOptions time;
  std::string out;
  std::string report;
  bool json = false;
};

void show(const identify::Sessions& all) {
  const auto percent = [](const identify::Change& c) {
    return fmt::format("{:+.0f} ({:+.0f} .. {:+.0f}) %", 100 * c.value, 100 * c.low, 100 * c.high);
  };
  print(fmt::format("{:<26}{:<17}{:>20}{:>20}{:>8}{:>8}\n", "session", "sensor", "shift", "gain", "shape",
                    "noise"));
  for (const identify::SessionChange& session : all.sessions) {
    for (const identify::SensorChange& s : session.sensors) {
      print(fmt::format("{:<26}{:<17}{:>20}{:>20}{:>6.1f} %{:>6.2f} %\n", io::start_of(session.name, 25),
                        io::start_of(s.sensor, 16), percent(s.shift), percent(s.log_gain), 100 * s.shape,
                        100 * s.noise));
    }
  }
  print(
      fmt::format("\nfrom session to session: shift {:.1f} %, gain {:.1f} % (standard deviations; shares of "
                  "a sensor's span); shifts of two sensors correlate by {:.2f}\n",
                  100 * all.prior.shift_sd, 100 * all.prior.log_gain_sd, all.prior.alike));
}

void run(const Options& o) {
  if (!o.out.empty()) io::require_writable(o.out);
  if (!o.report.empty()) io::require_folder(o.report, "donning");
  const identify::Sessions all = identify::compare_files(o.files, o.sensors, o.time);
  if (!o.out.empty()) io::write_file(o.out, to_json(all.prior));
  if (!o.report.empty()) {
    identify::save_results(all, o.report);
    report::render(o.report);
  }
  if (o.json) return print(io::dump(to_json(all)));
  show(all);
  if (!o.out.empty()) print(fmt::format("prior    {}\n", o.out));
  if (!o.report.empty()) print(fmt::format("report   {}/report.html\n", o.report));
}

}  // namespace donning_command

void add_donning(CLI::App& app) {
  using namespace donning_command;
  const auto [o, command] = add_command(
      app, "donning", "What changed between sessions of one glove: where its sensors lie and reach", run);
  command->footer(
      "Each session is a log of much motion; they are compared by the quantiles of their readings.");
  command->add_option("sessions", o->files, "logs, one for each time that the glove was put on")->required();
  command->add_option("--sensors", o->sensors, "columns (default: those that are called like fingers)")
      ->delimiter(',');
  add_time_options(*command, o->time);
  command->add_option("--out", o->out, "write how they differ here, for recalibrate --prior");
  command->add_option("--report", o->report, "write report.html into this folder")->transform(kFolder);
}

}  // namespace flexor::cli
