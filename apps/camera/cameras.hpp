// Cameras as the experiment uses them: videos of hands to angles, and the twin's hand filmed instead of told.
//
// An interface, because what stands behind it loads two hundred shared libraries: only the programs
// flexor-camera and flexor-cosim have it, and `flexor` starts as fast as before (docs/adr/0007).
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "host/camera/lens.hpp"
#include "host/camera/setup.hpp"
#include "host/camera/tracker.hpp"
#include "host/study/trials.hpp"

namespace flexor::filming {

using namespace study;

struct TrackRequest {
  std::filesystem::path video;  // or a camera device
  std::filesystem::path joints;
  std::filesystem::path lens;     // empty: none
  std::filesystem::path out;      // angles.csv
  std::filesystem::path preview;  // empty: none
  std::filesystem::path report;   // a folder; empty: none
  double seconds = 0;             // stop after these; 0: at the end
};

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

struct SetupRequest {
  std::filesystem::path video;
  std::filesystem::path joints;
  double at_s = 0;  // which picture: the first from there on
  std::size_t skeleton = 0;
  camera::ColourChoice colour;
  std::map<int, std::string> told;
  std::filesystem::path picture;  // PNG with numbers
  std::filesystem::path save;     // joint file with colour and start positions; empty: none
};

struct FilmRequest {
  twin::Parameters parameters;
  std::vector<twin::Motion> motions;  // one after the other
  double rate_hz = 50;                // of the glove's log
  std::uint64_t seed = 1;
  std::filesystem::path folder;
};

class Cameras {
 public:
  virtual ~Cameras() = default;

  // Writes t_s, and for each angle NAME_deg, NAME_se_deg, NAME_quality (camera::Quality as a number); the
  // report and the preview likewise appear whole or not at all. Throws io::InputError, and io::JobError when
  // no frame shows the marks.
  virtual Tracked track(const TrackRequest& request, const TrackProgress& progress) const = 0;
  virtual camera::Setup set_up(const SetupRequest& request) const = 0;
  virtual camera::Calibration calibrate(const std::vector<std::filesystem::path>& pictures,
                                        const camera::Board& board) const = 0;
  // The twin wears the glove and is filmed: glove.csv (readings), video.mp4, truth.csv (exact angles at the
  // video's frames) and joints.json. The glove's clock is seconds away from the video's.
  virtual void film(const FilmRequest& request, const TrackProgress& progress) const = 0;
  // Plays trials on `inner` (null: the twin), and films both hands: what its cameras say is what was tracked.
  virtual std::unique_ptr<Engine> rendered(Engine* inner) const = 0;
};

// The real ones. Links OpenCV.
std::unique_ptr<Cameras> make_cameras();

nlohmann::ordered_json to_json(const Tracked& result, const TrackRequest& request);

}  // namespace flexor::filming
