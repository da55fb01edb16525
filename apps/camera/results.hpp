// What tracking found, as files that its report is drawn from: results.json, angles.csv and frame.jpg, a labelled frame.
#pragma once

#include <filesystem>

#include "apps/camera/cameras.hpp"

namespace flexor::filming {

// `csv` is the file of angles that was written. Throws io::InputError when one cannot be written.
void save_results(const Tracked& result, const TrackRequest& request, const std::filesystem::path& csv,
                  const camera::Picture& labelled, const std::filesystem::path& folder);

}  // namespace flexor::filming
