#include "host/study/shards.hpp"

#include <fmt/ranges.h>

#include "host/io/json.hpp"
#include "host/twin/exact_json.hpp"

namespace flexor::study {
namespace {

namespace fs = std::filesystem;
using io::InputError;

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

ShardFolders find_shards(const std::vector<fs::path>& folders, const std::string& kind,
                         bool (*is_one)(const Json& settings)) {
  ShardFolders out;
  for (const fs::path& folder : folders) {
    const std::string file = (folder / "run.json").string();
    Json settings = io::parse_json(io::read_document(file), file);
    if (!is_one(settings)) throw InputError("{}: is no {}", file, kind);
    const auto [index, of] = settings.value("shard", Shard{});
    settings["shard"] = of;
    settings.erase("rows_digest");
    if (out.folders.empty()) {
      out.settings = settings;
      out.folders.resize(of);
    }
    for (const Json* one : {&out.settings, &settings})
      for (const auto& [key, value] : one->items())
        if (settings.value(key, Json()) != out.settings.value(key, Json()))
          throw InputError("{}: belongs to another run than {}: \"{}\" differs in their run.json",
                           folder.string(), folders.front().string(), key);
    if (index < 1 || index > out.folders.size())
      throw InputError("{}: is shard {} of {}: give that shard's command into a new folder", file, index,
                       out.folders.size());
    fs::path& mine = out.folders[index - 1];
    if (!mine.empty()) throw InputError("{} and {} are both shard {}", mine.string(), folder.string(), index);
    mine = folder;
  }
  if (folders.empty()) throw InputError("no folders to merge");
  if (out.settings.at("version") != FLEXOR_VERSION)
    throw InputError("{}: is of Flexor {}, this is {}: merge with that version", folders.front().string(),
                     out.settings.at("version").get<std::string>(), FLEXOR_VERSION);
  out.settings.erase("shard");
  return out;
}

Shards read_shards(const std::vector<fs::path>& folders,
                   const std::function<Engine*(const std::string& name)>& engine) {
  const auto [settings, found] =
      find_shards(folders, "shard's: merge takes folders of flexor experiment --shard i/N",
                  [](const Json& one) { return one.contains("shard") && one.contains("plan"); });
  std::vector<std::size_t> missing;
  for (std::size_t i = 0; i < found.size(); ++i)
    if (found[i].empty()) missing.push_back(i + 1);
  if (!missing.empty())
    throw InputError("of {} shards {} {} missing: give their folders too", found.size(),
                     fmt::join(missing, ", "), missing.size() > 1 ? "are" : "is");
  Shards out{{}, found};
  try {
    out.plan = to_plan(settings);
  } catch (const Json::exception&) {
    throw InputError("{}/run.json: is damaged: give that shard's command into a new folder",
                     folders.front().string());
  }
  out.plan.engine = engine(settings.at("engine").get<std::string>());
  return out;
}

}  // namespace flexor::study
