// An ensemble of laboratories as text.
#pragma once

#include <string>

#include "host/study/ensemble_run.hpp"

namespace flexor::cli {

// Its laboratories: prior and posterior of each free parameter, how well the chains mixed.
std::string ensemble_text(const study::Ensemble& ensemble);

// The experiment in them.
std::string ensemble_text(const study::EnsembleResult& result, const study::EnsemblePlan& plan);

}  // namespace flexor::cli
