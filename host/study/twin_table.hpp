// The twin's side of the published table, and how likely the published one is beside it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "host/study/trials.hpp"

namespace flexor::study {

// E_T in degree-seconds, mean of the trials, [gesture - first][raw, published-w, published-hw].
using TableErrors = std::vector<std::array<double, kPublishedCompensators>>;

// The article's averages of these gestures.
TableErrors published_table(int first, int last);

// The relative standard error of a published average of three trials, for each compensator: standard
// deviation of the three / average / sqrt(3), root mean square over gestures 1 to 4, since three trials say
// little of one cell's spread. 0.28, 0.49 and 0.62.
std::array<double, kPublishedCompensators> published_standard_errors();

double log_rms(const TableErrors& ours, const TableErrors& published);

// -1/2 sum over the cells of (ln(ours / published) / standard error of its compensator)^2
double log_likelihood(const TableErrors& ours, const TableErrors& published);

// Plays gestures first to last with common random numbers: the same trials for every parameter.
class TwinTable {
 public:
  // trials: a multiple of 16 makes best use of the vectors.
  TwinTable(int first, int last, int trials, std::uint64_t seed);

  // log_likelihood(errors(parameters), published), cell by cell: minus infinity as soon as it is below floor.
  double log_likelihood(const twin::Parameters& parameters, const TableErrors& published, double floor) const;

  // threads 0: as many as the machine has.
  TableErrors errors(const twin::Parameters& parameters, int threads = 1) const;

 private:
  double error(const Plan& plan, std::size_t gesture, std::size_t compensator) const;

  Plan plan_;
};

}  // namespace flexor::study
