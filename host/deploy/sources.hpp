// The firmware's sources, which the program carries with it: a user needs no checkout to deploy.
#pragma once

#include <string>
#include <vector>

namespace flexor::deploy {

struct Source {
  std::string path;  // from the repository's root, as its includes are written
  std::string text;
};

const std::vector<Source>& sources();

}  // namespace flexor::deploy
