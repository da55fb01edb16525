#include "host/report/scores_table.hpp"

#include <fmt/format.h>

#include <cmath>

namespace flexor::report {

TableBlock scores_table(const std::vector<ScoredColumn>& columns) {
  struct Row {
    const char* name;
    const char* key;
    const char* unit;
  };
  constexpr Row kRows[] = {{"RMSE", "rmse_deg", "°"},
                           {"95th percentile of the error", "p95_abs_deg", "°"},
                           {"largest error", "max_abs_deg", "°"},
                           {"fit (NRMSE)", "fit_percent", " %"},
                           {"R²", "r2", ""},
                           {"integral of absolute error", "iae_deg_s", "°s"},
                           {"best constant lag (positive: late)", "best_lag_s", " s"},
                           {"RMSE with that lag removed", "lag_removed_rmse_deg", "°"},
                           {"integral with that lag removed", "lag_removed_iae_deg_s", "°s"}};
  TableBlock t{"Scores on the held-out part", {"score"}, {}, {}};
  for (const ScoredColumn& column : columns) t.columns.push_back(column.name);
  for (const Row& row : kRows) {
    t.rows.push_back({row.name});
    for (const ScoredColumn& column : columns) {
      const double value =
          column.scores.is_object() ? number_or_nan(column.scores.value(row.key, Json(nullptr))) : NAN;
      t.rows.back().push_back(std::isnan(value) ? "-" : fmt::format("{:.3f}{}", value, row.unit));
    }
  }
  return t;
}

}  // namespace flexor::report
