// What anybody would draw through readings and angles first: the least that an estimate stands beside.
#pragma once

#include <vector>

namespace flexor::score {

// 24 hat functions on quantiles of x, by least squares with a touch of smoothness, level beyond them: its values at `at`.
std::vector<double> least_squares_curve(const std::vector<double>& x, const std::vector<double>& y,
                                        const std::vector<double>& at);

}  // namespace flexor::score
