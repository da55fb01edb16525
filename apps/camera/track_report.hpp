// What was tracked, as a page to look at: angles over time with what is unsure in grey, quality, a labelled
// frame.
#pragma once

#include <filesystem>

#include "apps/camera/cameras.hpp"

namespace flexor::filming {

// report.html (self-contained), angles.svg and frame.jpg. `csv` is the file that was written, and is read as
// it is drawn. Throws io::JobError when gnuplot fails.
void write_track_report(const Tracked& result, const TrackRequest& request, const std::filesystem::path& csv,
                        const camera::Picture& labelled, const std::filesystem::path& folder);

}  // namespace flexor::filming
