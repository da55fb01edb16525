#include "apps/cli/commands.hpp"
#include "host/io/folder_lock.hpp"
#include "host/report/render.hpp"

namespace flexor::cli::report_command {

struct Options {
  std::string folder;
  bool files = false;
};

Output run(const Options& o) {
  std::optional<io::FolderLock> lock;  // a run that goes on there would mix its results with these
  if (std::filesystem::exists(std::filesystem::path(o.folder) / "results.json")) lock.emplace(o.folder);
  report::render(o.folder, o.files);
  const std::string page = o.folder + "/report.html";
  return {{{"report", page}}, fmt::format("report   {}\n", page)};
}

void add(CLI::App& app) {
  const auto [o, command] = add_command(
      app, "report", "Draw a job's report once more, from the results that it saved in its folder", run);
  add_folder(*command, "FOLDER", o->folder,
             "that identify --report, experiment --out, track --report, deploy --out or latency --out "
             "has written")
      ->required();
  command->add_flag(
      "--pdf", o->files,
      "also every curve as PDF and SVG (by gnuplot), and every drawing as SVG, beside the page");
}

}  // namespace flexor::cli::report_command
