// A log through a model, row by row: what flexor apply and Python's predict write.
#pragma once

#include <functional>
#include <string>
#include <variant>
#include <vector>

#include "host/identify/estimator.hpp"
#include "host/model/range_count.hpp"
#include "host/recording/csv.hpp"

namespace flexor::identify {

using AnyEstimator = std::variant<Estimator<model::DoubleArithmetic>, Estimator<model::FloatArithmetic>,
                                  Estimator<model::FixedArithmetic>>;
// `arithmetic`: double, float, or fixed, as in the glove. Throws io::InputError.
AnyEstimator estimator_of(const model::Model& model, const std::string& arithmetic);

struct ApplyOptions {
  std::string source = "model";  // the model's file, in messages
  std::string arithmetic = "double";
  bool intervals = false;  // every joint must say how accurate it is
  bool track = false;
  std::function<void(const std::string&)> note;  // of units before the first row, of the clock after the last
  std::function<void(std::size_t rows)> progress = {};
};

struct Applied {
  std::vector<model::Followed> followed;  // the correction of each sensor at the end; empty: not tracked
  model::RangeCount ranges;
  double row_period_s;  // median
};

// The log's clock is repaired, its readings come to the model's grid. Throws io::InputError: another unit, no reading, a model
// without what is asked for.
Applied apply(const model::Model& model, recording::LogReader& log, const ApplyOptions& options,
              const std::function<void(const Estimate&)>& sink);

// Throws io::Doubt, one line, where the model hardly knows what the columns of the log hold; warns where it knows a part, of a
// column that stands, and of rows much slower than the model (0: unknown).
void check_ranges(const model::Model& model, const std::string& file, const std::vector<std::string>& columns,
                  const model::RangeCount& ranges, const std::function<void(const std::string&)>& warn,
                  double row_period_s = 0);

}  // namespace flexor::identify
