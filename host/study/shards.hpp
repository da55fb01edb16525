// The folders of an experiment's shards, and the plan that they are parts of, as their run.json says (trials.hpp, settings_of).
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "host/study/trials.hpp"

namespace flexor::study {

struct Shards {
  Plan plan;                                   // of the whole run, without a folder
  std::vector<std::filesystem::path> folders;  // of shard 1, 2, ...
};

// `engine`: what an engine's name stands for; null for the twin's. Throws io::InputError: a folder that is no shard's, of
// another run or version than the first, the same shard twice; or shards that are not there, each named.
Shards read_shards(const std::vector<std::filesystem::path>& folders,
                   const std::function<Engine*(const std::string& name)>& engine);

}  // namespace flexor::study
