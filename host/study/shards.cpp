#include "host/study/shards.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <map>

#include "host/io/json.hpp"
#include "host/twin/exact_json.hpp"

namespace flexor::study {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using io::InputError;

// The first member that differs, in the words of run.json.
std::string difference(const Json& a, const Json& b) {
  for (const auto& [key, value] : a.items())
    if (!b.contains(key) || b.at(key) != value) return key;
  return "shard";
}

Plan to_plan(const Json& settings) {
  Plan plan;
  const Json& made_of = settings.at("plan");
  settings.at("twin").get_to(plan.parameters);
  for (const Json& motion : made_of.at("motions"))
    motion.get_to(plan.motions.emplace_back(recommended_motion()));
  for (std::size_t i = 0; i < settings.at("compensators").size(); ++i) {
    Compensator& one = plan.compensators.emplace_back();
    settings.at("compensators").at(i).at("name").get_to(one.name);
    made_of.at("models").at(i).get_to(one.model);
  }
  settings.at("seed").get_to(plan.seed);
  settings.at("trials").get_to(plan.trials);
  made_of.at("scenarios").get_to(plan.scenarios);
  return plan;
}

}  // namespace

Shards read_shards(const std::vector<fs::path>& folders,
                   const std::function<Engine*(const std::string& name)>& engine) {
  Shards out;
  Json first;
  std::map<std::size_t, fs::path> by_index;
  for (const fs::path& folder : folders) {
    const std::string file = (folder / "run.json").string();
    Json settings = io::parse_json(io::read_document(file), file);
    if (!settings.contains("shard") || !settings.contains("plan"))
      throw InputError(
          fmt::format("{}: is no shard's: merge takes folders of flexor experiment --shard i/N", file));
    const auto index = settings.at("shard").at("index").get<std::size_t>();
    settings["shard"].erase("index");
    if (first.is_null()) first = settings;
    if (settings != first)
      throw InputError(fmt::format("{}: belongs to another run than {}: \"{}\" differs in their run.json",
                                   folder.string(), folders.front().string(), difference(first, settings)));
    if (const auto [other, is_new] = by_index.emplace(index, folder); !is_new)
      throw InputError(
          fmt::format("{} and {} are both shard {}", other->second.string(), folder.string(), index));
  }
  if (first.at("version") != FLEXOR_VERSION)
    throw InputError(fmt::format("{}: is of Flexor {}, this is {}: merge with that version",
                                 folders.front().string(), first.at("version").get<std::string>(),
                                 FLEXOR_VERSION));
  std::vector<std::size_t> missing;
  for (std::size_t i = 1; i <= first.at("shard").at("of").get<std::size_t>(); ++i) {
    if (by_index.contains(i))
      out.folders.push_back(by_index.at(i));
    else
      missing.push_back(i);
  }
  if (!missing.empty())
    throw InputError(fmt::format("of {} shards {} {} missing: give their folders too",
                                 first.at("shard").at("of").dump(), fmt::join(missing, ", "),
                                 missing.size() > 1 ? "are" : "is"));
  try {
    out.plan = to_plan(first);
  } catch (const Json::exception&) {
    throw InputError(fmt::format("{}/run.json: is damaged: give that shard's command into a new folder",
                                 folders.front().string()));
  }
  out.plan.engine = engine(first.at("engine").get<std::string>());
  return out;
}

}  // namespace flexor::study
