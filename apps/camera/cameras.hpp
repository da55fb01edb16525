// What cameras are for, as jobs of the worker: videos of hands to angles, a video's set-up, a lens, and the twin's hand on film.
// They take what apps/cli sends, paths as bytes, and give what its --json prints.
#pragma once

#include "host/io/io.hpp"
#include "host/io/worker.hpp"

namespace flexor::filming {

// Writes t_s, and for each angle NAME_deg, NAME_se_deg, NAME_quality (camera::Quality as a number); the report
// and the preview likewise appear whole or not at all. Where `progress` stops it, what there is is kept. Throws io::InputError,
// and io::JobError when no frame shows the marks.
Json track(const Json& arguments, const io::JobProgress& progress);

// "picture" gets numbers, "save" the joint file with colour and start positions.
Json propose_marks(const Json& arguments, const io::JobProgress& progress);

Json fit_lens(const Json& arguments, const io::JobProgress& progress);

// The twin wears the glove and is filmed, one motion of "inputs" after the other: glove.csv (readings), video.mp4, truth.csv
// (exact angles at the video's frames) and joints.json. The glove's clock is seconds away from the video's. Throws io::Cancelled.
Json film(const Json& arguments, const io::JobProgress& progress);

// Exact angles of a trial in, tracked ones out.
Json see(const Json& arguments, const io::JobProgress& progress);

}  // namespace flexor::filming
