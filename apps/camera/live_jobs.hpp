// Jobs that keep something between them: a watch, picture by picture, and the drawn hand that stands in for a camera.
//
//   watch_open     {"joints": PATH or a joint file's JSON, "lens": PATH or "", "drawn": true, of the twin's hand}
//                  -> {"angles": [NAME, ...]}
//   watch_picture  {"t_s", "jpeg": base64}
//                  -> {"rows": [{"t_s", "deg": [34.1, ...], "se_deg": [...], "quality": [0 to 3]}, ...], of each angle; lost: 0
//                      "marks_found", "marks_at", "marks", "width", "height"}
//   watch_camera   {"device": a camera or a video file} -> the same of its next picture, and "t_s", "ended": there was none
//   watch_close    {} -> {"rows"}
//   draw_picture   {"mcp_deg": [5 angles], "frame": n} -> {"jpeg": base64}
//
// Rows are camera::kLag pictures old. A picture that is refused, an "input" error, ends nothing.
#pragma once

#include <map>
#include <string>

#include "apps/camera/film.hpp"
#include "host/io/worker.hpp"

namespace flexor::filming {

// By name, for io::serve().
std::map<std::string, io::Job> live_jobs();

}  // namespace flexor::filming
