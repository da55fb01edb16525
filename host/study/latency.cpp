#include "host/study/latency.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "host/io/json.hpp"

namespace flexor::study {

Json budget_of(const std::vector<Latency>& edges, int asked) {
  if (edges.empty()) throw io::JobError("no edge came through to the motor");
  const auto row = [&](const auto& ms_of) -> Json {
    std::vector<double> ms;
    for (const Latency& edge : edges) ms.push_back(ms_of(edge));
    double mean_ms = 0;
    for (const double one : ms) mean_ms += one / static_cast<double>(ms.size());
    return {{"mean_ms", mean_ms}, {"min_ms", std::ranges::min(ms)}, {"max_ms", std::ranges::max(ms)}};
  };
  Json stages = Json::array();
  for (std::size_t i = 0; i < kLatencyStages.size(); ++i) {
    stages.push_back(row([i](const Latency& edge) { return edge[i]; }));
    stages.back()["name"] = kLatencyStages[i];
  }
  const auto whole = [](const Latency& edge) { return std::accumulate(edge.begin(), edge.end(), 0.0); };
  return {{"edges", edges.size()},
          {"lost", asked - std::ssize(edges)},
          {"stages", std::move(stages)},
          {"total", row(whole)}};
}

void save_results(const Json& budget, const std::string& title, const std::filesystem::path& folder) {
  io::make_folder(folder);
  Json rows = budget.at("stages");
  rows.push_back(budget.at("total"));
  rows.back()["name"] = "total";
  std::string csv = "stage,mean_ms,min_ms,max_ms\n";
  for (const Json& r : rows)
    csv += fmt::format("{},{:.4f},{:.4f},{:.4f}\n", r.at("name").get<std::string>(),
                       r.at("mean_ms").get<double>(), r.at("min_ms").get<double>(),
                       r.at("max_ms").get<double>());
  io::write_file(folder / "latency.csv", csv);
  Json json = {{"kind", "latency"}, {"title", title}, {"version", FLEXOR_VERSION}};
  json.update(budget);
  io::write_file(folder / "results.json", io::dump(json));
}

}  // namespace flexor::study
