#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>

#include "apps/cli/commands.hpp"
#include "host/io/json.hpp"
#include "host/study/journal.hpp"

namespace flexor::cli {
namespace report_command {

struct Options {
  std::string folder;
  bool json = false;
};

void run(const Options& o) {
  std::optional<study::FolderLock> lock;  // a run that goes on there would mix its results with these
  if (std::filesystem::exists(std::filesystem::path(o.folder) / "results.json")) lock.emplace(o.folder);
  draw_report(o.folder);
  const std::string page = o.folder + "/report.html";
  print(o.json ? io::dump({{"report", page}, {"version", FLEXOR_VERSION}})
               : fmt::format("report   {}\n", page));
}

}  // namespace report_command

void add_report(CLI::App& app) {
  using namespace report_command;
  auto o = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "report", "Draw a job's report once more, from the results that it saved in its folder");
  command
      ->add_option("FOLDER", o->folder,
                   "that identify --report, experiment --out, track --report, deploy --out or latency --out "
                   "has written")
      ->required();
  command->add_flag("--json", o->json, "one JSON object on standard output");
  command->callback([o] { run(*o); });
}

}  // namespace flexor::cli
