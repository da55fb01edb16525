#include "host/study/latency.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/io/io.hpp"
#include "host/io/json.hpp"

namespace flexor::study {

using Json = nlohmann::ordered_json;

LatencyBudget budget_of(const std::vector<Latency>& edges, int asked) {
  if (edges.empty()) throw io::JobError("no edge came through to the motor");
  const auto over = [&](const auto& value) {
    LatencyBudget::Stage s{0, 1e9, 0};
    for (const Latency& edge : edges) {
      const double ms = value(edge);
      s.mean_ms += ms / static_cast<double>(edges.size());
      s.min_ms = std::min(s.min_ms, ms);
      s.max_ms = std::max(s.max_ms, ms);
    }
    return s;
  };
  LatencyBudget out;
  out.edges = static_cast<int>(edges.size());
  out.lost = asked - out.edges;
  for (std::size_t i = 0; i < out.stage.size(); ++i)
    out.stage[i] = over([i](const Latency& edge) { return edge[i]; });
  out.total = over([](const Latency& edge) {
    double sum = 0;
    for (const double ms : edge) sum += ms;
    return sum;
  });
  return out;
}

namespace {

// Each stage, then the total, by this format: name, mean, least, most.
std::string rows(const LatencyBudget& b, const char* format) {
  std::string out;
  const auto row = [&](const char* name, const LatencyBudget::Stage& s) {
    out += fmt::format(fmt::runtime(format), name, s.mean_ms, s.min_ms, s.max_ms);
  };
  for (std::size_t i = 0; i < b.stage.size(); ++i) row(kLatencyStages[i], b.stage[i]);
  row("total", b.total);
  return out;
}

}  // namespace

std::string latency_table(const LatencyBudget& b) {
  return fmt::format("{:<22}{:>9}{:>9}{:>9}\n", "stage", "mean", "least", "most") +
         rows(b, "{:<22}{:>9.2f}{:>9.2f}{:>9.2f}\n");
}

Json to_json(const LatencyBudget& b) {
  const auto stage = [](const LatencyBudget::Stage& s) {
    return Json{{"mean_ms", s.mean_ms}, {"min_ms", s.min_ms}, {"max_ms", s.max_ms}};
  };
  Json stages = Json::array();
  for (std::size_t i = 0; i < b.stage.size(); ++i) {
    Json row = stage(b.stage[i]);
    row["name"] = kLatencyStages[i];
    stages.push_back(std::move(row));
  }
  return {{"edges", b.edges}, {"lost", b.lost}, {"stages", std::move(stages)}, {"total", stage(b.total)}};
}

void save_results(const LatencyBudget& b, const std::string& title, const std::filesystem::path& folder) {
  io::make_folder(folder);
  io::write_file(folder / "latency.csv",
                 "stage,mean_ms,min_ms,max_ms\n" + rows(b, "{},{:.4f},{:.4f},{:.4f}\n"));
  Json json = {{"kind", "latency"}, {"title", title}, {"version", FLEXOR_VERSION}};
  json.update(to_json(b));
  io::write_file(folder / "results.json", io::dump(json));
}

}  // namespace flexor::study
