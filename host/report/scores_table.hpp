// All scores on the held-out part, one column for each compensator or baseline.
#pragma once

#include <string>
#include <vector>

#include "host/report/page.hpp"
#include "host/report/saved.hpp"

namespace flexor::report {

struct ScoredColumn {
  std::string name;
  Json scores;  // the keys of score::to_json, or null: dashes
};

TableBlock scores_table(const std::vector<ScoredColumn>& columns);

}  // namespace flexor::report
