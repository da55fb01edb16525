// Figures of an identification, drawn by gnuplot as SVG.
#pragma once

#include <string>
#include <vector>

#include "host/identify/identify_files.hpp"

namespace flexor::report {

using namespace identify;

struct Figure {
  std::string name;  // file name without ".svg"
  std::string title;
  std::string caption;
  std::string svg;
};

// alignment, curve, dynamics, holdout, residuals. Throws io::JobError when gnuplot is missing or fails.
std::vector<Figure> draw(const Identification& result);

}  // namespace flexor::report
