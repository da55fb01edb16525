#include "host/study/latency.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "host/io/io.hpp"
#include "host/io/json.hpp"

namespace flexor::study {

LatencyBudget budget_of(const std::vector<Latency>& edges, int asked) {
  if (edges.empty()) throw io::JobError("no edge came through to the motor");
  LatencyBudget out{static_cast<int>(edges.size()), asked - static_cast<int>(edges.size()), {}};
  for (const char* name : kLatencyStages) out.rows.push_back({name});
  out.rows.push_back({"total"});
  for (const Latency& edge : edges) {
    std::vector<double> ms(edge.begin(), edge.end());
    ms.push_back(std::accumulate(edge.begin(), edge.end(), 0.0));
    for (std::size_t i = 0; i < ms.size(); ++i) {
      LatencyBudget::Row& row = out.rows[i];
      row.mean_ms += ms[i] / static_cast<double>(edges.size());
      row.min_ms = std::min(row.min_ms, ms[i]);
      row.max_ms = std::max(row.max_ms, ms[i]);
    }
  }
  return out;
}

Json to_json(const LatencyBudget& b) {
  Json stages = Json::array();
  for (const LatencyBudget::Row& r : b.rows)
    stages.push_back({{"mean_ms", r.mean_ms}, {"min_ms", r.min_ms}, {"max_ms", r.max_ms}, {"name", r.name}});
  Json total = std::move(stages.back());
  stages.erase(stages.size() - 1);
  total.erase("name");
  return {{"edges", b.edges}, {"lost", b.lost}, {"stages", std::move(stages)}, {"total", std::move(total)}};
}

void save_results(const LatencyBudget& b, const std::string& title, const std::filesystem::path& folder) {
  io::make_folder(folder);
  std::string csv = "stage,mean_ms,min_ms,max_ms\n";
  for (const LatencyBudget::Row& r : b.rows)
    csv += fmt::format("{},{:.4f},{:.4f},{:.4f}\n", r.name, r.mean_ms, r.min_ms, r.max_ms);
  io::write_file(folder / "latency.csv", csv);
  Json json = {{"kind", "latency"}, {"title", title}, {"version", FLEXOR_VERSION}};
  json.update(to_json(b));
  io::write_file(folder / "results.json", io::dump(json));
}

}  // namespace flexor::study
