// The twin's side of the published table.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "host/study/trials.hpp"

namespace flexor::study {

// E_T in degree-seconds, mean of the trials, [gesture - 1][raw, published-w, published-hw].
using TableErrors = std::vector<std::array<double, kPublishedCompensators>>;

// The twin's, with common random numbers: the same trials for every set of parameters. trials: a multiple of 16
// makes best use of the vectors.
TableErrors twin_table(const twin::Parameters& parameters, int last, int trials, std::uint64_t seed);

}  // namespace flexor::study
