// What cameras are for: videos of hands to angles, a video's set-up, a lens, and the twin's hand on film.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host/camera/lens.hpp"
#include "host/camera/mark_proposal.hpp"
#include "host/camera/tracker.hpp"
#include "host/io/pipe_json.hpp"
#include "host/io/worker.hpp"
#include "host/twin/simulation.hpp"

// Bytes, whatever they are in a name.
template <>
struct nlohmann::adl_serializer<std::filesystem::path> {
  static void to_json(ordered_json& json, const std::filesystem::path& path) {
    json = flexor::io::bytes_to_json(path.string());
  }
  static void from_json(const ordered_json& json, std::filesystem::path& path) {
    path = flexor::io::bytes_from_json(json);
  }
};

namespace flexor::filming {

struct TrackRequest {
  std::filesystem::path video;  // or a camera device
  std::filesystem::path joints;
  std::filesystem::path lens;     // empty: none
  std::filesystem::path out;      // angles.csv
  std::filesystem::path preview;  // empty: none
  std::filesystem::path report;   // a folder; empty: none
  double seconds = 0;             // stop after these; 0: at the end
};
FLEXOR_PIPE(TrackRequest, video, joints, lens, out, preview, report, seconds)

struct Tracked {
  camera::Summary summary;
  std::vector<std::string> warnings;
  double decoding_s = 0;
  double tracking_s = 0;  // decoding and drawing left out
  int width = 0;
  int height = 0;
};

// frames so far, of how many (0: not known); false: stop here and keep what there is.
using TrackProgress = std::function<bool(std::size_t frames, std::size_t of)>;

struct MarkProposalRequest {
  std::filesystem::path video;
  std::filesystem::path joints;
  double at_s = 0;                      // which picture: the first from there on
  std::string skeleton;                 // its name; empty: the first
  std::optional<camera::Point> mark;    // a point on one, whose colour is learnt
  std::map<int, std::string> assigned;  // candidate -> mark; empty: they are proposed
  std::filesystem::path picture;        // PNG with numbers
  std::filesystem::path save;           // joint file with colour and start positions; empty: none
};

struct LensFitRequest {
  std::vector<std::filesystem::path> pictures;
  camera::Board board;
  std::filesystem::path out;  // the lens file
};

struct FilmRequest {
  std::vector<twin::TrialInput> inputs;  // one motion after the other; samples are recorded
  camera::Joints joints;                 // of what is drawn
  std::uint64_t seed = 1;
  std::filesystem::path folder;
};

// Writes t_s, and for each angle NAME_deg, NAME_se_deg, NAME_quality (camera::Quality as a number); the report
// and the preview likewise appear whole or not at all. Throws io::InputError, and io::JobError when no frame
// shows the marks.
Tracked track(const TrackRequest& request, const TrackProgress& progress);
camera::MarkProposal propose_marks(const MarkProposalRequest& request);
camera::LensFit fit_lens(const LensFitRequest& request);
// The twin wears the glove and is filmed: glove.csv (readings), video.mp4, truth.csv (exact angles at the
// video's frames) and joints.json. The glove's clock is seconds away from the video's. How many frames. Throws
// io::Cancelled.
std::size_t film(const FilmRequest& request, const TrackProgress& progress);

nlohmann::ordered_json to_json(const Tracked& result, const TrackRequest& request);
nlohmann::ordered_json to_json(const camera::MarkProposal& proposal, const MarkProposalRequest& request);
nlohmann::ordered_json to_json(const camera::LensFit& result, const LensFitRequest& request);

}  // namespace flexor::filming
