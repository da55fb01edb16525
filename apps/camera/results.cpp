#include "apps/camera/results.hpp"

#include "host/camera/video.hpp"
#include "host/io/io.hpp"
#include "host/io/json.hpp"

namespace flexor::filming {

void save_results(const Tracked& r, const TrackRequest& request, const std::filesystem::path& csv,
                  const camera::Picture& labelled, const std::filesystem::path& folder) {
  io::make_folder(folder);
  std::error_code error;
  if (!std::filesystem::equivalent(csv, folder / "angles.csv", error))
    io::write_file(folder / "angles.csv", io::read_file(csv));
  if (!labelled.empty()) camera::write_picture(folder / "frame.jpg", labelled);
  nlohmann::ordered_json json = {{"kind", "tracking"}};
  json.update(to_json(r, request));
  json["lens"] = io::to_utf8(request.lens.string());
  json["most_hidden_frames"] = camera::kMaxHidden;
  io::write_file(folder / "results.json", io::dump(json));
}

}  // namespace flexor::filming
