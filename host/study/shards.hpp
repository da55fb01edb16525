// The folders of an experiment's shards, and the plan that they are parts of, as in their run.json (trials.hpp, settings_of).
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "host/study/trials.hpp"

namespace flexor::study {

// The run.json of the whole run, without "shard", and the folders of its shards 1, 2, ...; empty where one is not given.
struct ShardFolders {
  Json settings;
  std::vector<std::filesystem::path> folders;
};

// `is_one`: whether a run.json is of the kind that is merged; if not, it is no `kind`. Throws io::InputError: such a folder, one of
// another run or version than the first, the same shard twice, or no folder.
ShardFolders find_shards(const std::vector<std::filesystem::path>& folders, const std::string& kind,
                         bool (*is_one)(const Json& settings));

struct Shards {
  Plan plan;                                   // of the whole run, without a folder
  std::vector<std::filesystem::path> folders;  // of shard 1, 2, ...
};

// `engine`: what an engine's name stands for; null for the twin's. Throws io::InputError as find_shards(), and for shards that are
// not there, each named.
Shards read_shards(const std::vector<std::filesystem::path>& folders,
                   const std::function<Engine*(const std::string& name)>& engine);

}  // namespace flexor::study
