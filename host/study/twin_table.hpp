// The twin's side of the published table, and how likely the published one is beside it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "host/study/trials.hpp"

namespace flexor::study {

// E_T in degree-seconds, mean of the trials, [gesture - 1][raw, published-w, published-hw].
using TableErrors = std::vector<std::array<double, kPublishedCompensators>>;

// The article's averages of gestures 1 to last.
TableErrors published_table(int last);

// The twin's, with common random numbers: the same trials for every set of parameters. trials: a multiple of 16
// makes best use of the vectors.
TableErrors twin_table(const twin::Parameters& parameters, int last, int trials, std::uint64_t seed);

// The relative standard error of a published average of three trials, for each compensator: standard
// deviation of the three / average / sqrt(3), root mean square over gestures 1 to 4, since three trials say
// little of one cell's spread. 0.28, 0.49 and 0.62.
std::array<double, kPublishedCompensators> published_standard_errors();

// -1/2 sum over the cells of (ln(ours / published) / standard error of its compensator)^2
double log_likelihood(const TableErrors& ours, const TableErrors& published);

}  // namespace flexor::study
