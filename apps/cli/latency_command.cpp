#include "apps/cli/commands.hpp"
#include "host/io/folder_lock.hpp"
#include "host/report/render.hpp"
#include "host/study/boards.hpp"

namespace flexor::cli::latency_command {

struct Options {
  std::string model = "published-hw";
  double rate_hz = 10;
  int edges = 100;
  std::uint64_t seed = 1;
  TwinFiles twin;
  std::string folder;
};

Output run(const Options& o) {
  study::Boards boards(io::program_beside(kBoardsWorker));
  if (o.edges < 1) throw io::InputError("--edges must be at least 1");
  const twin::Parameters p = twin_parameters(o.twin);
  study::Compensator compensator = study::compensator(o.model, o.rate_hz);
  std::vector<std::string> notes;
  compensator.model = deploy::on_hand(std::move(compensator.model), p, notes);
  const deploy::Glove glove = deploy::glove_for(p, compensator.model, study::bench_key());
  const double frames_hz = o.rate_hz / deploy::samples_per_frame(glove);
  std::optional<io::FolderLock> lock;
  if (!o.folder.empty()) lock.emplace(o.folder, "latency");
  log(fmt::format("{} edges on simulated boards ...", o.edges));
  Json json = study::budget_of(boards.latency(p, compensator.model, o.edges, o.seed), o.edges);
  const std::string title =
      fmt::format("{:g} samples and {:g} frames a second, {:g} baud", o.rate_hz, frames_hz, p.baud);
  if (!o.folder.empty()) {
    study::save_results(json, title, o.folder);
    report::render(o.folder);
  }
  json["title"] = title;
  json["rate_hz"] = o.rate_hz;
  json["frame_rate_hz"] = frames_hz;
  json["seed"] = o.seed;
  return {json, report::summary("latency", json) + line_of("report", o.folder, "/report.html")};
}

void add(CLI::App& app) {
  const auto [o, command] = add_command(
      app, "latency", "Time from a sensor's edge to the motor, stage by stage, on simulated boards", run);
  add_compensator(*command, o->model, o->rate_hz);
  add_shown(*command, "--edges", o->edges, "how many, at random times");
  add_seed(*command, o->seed);
  add_twin_options(*command, o->twin);
  add_folder(*command, "--out", o->folder, "write report.html and latency.csv into this folder");
}

}  // namespace flexor::cli::latency_command
