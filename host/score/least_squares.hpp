// What anybody would draw through readings and angles first: the least that an estimate stands beside.
#pragma once

#include <vector>

namespace flexor::score {

// The sum of a curve of each x, of 24 hat functions on its quantiles, by least squares with a touch of smoothness, level beyond them:
// its values at `at`. Of each x and `at` its samples.
std::vector<double> least_squares_curves(const std::vector<std::vector<double>>& x,
                                         const std::vector<double>& y,
                                         const std::vector<std::vector<double>>& at);

}  // namespace flexor::score
