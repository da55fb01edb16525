#include "apps/camera/live_jobs.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/camera/jpeg.hpp"
#include "host/io/base64.hpp"
#include "host/io/io.hpp"
#include "host/io/json.hpp"

namespace flexor::filming {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::uint64_t kSeed = 1;

Json rows_of(const std::vector<camera::FilteredRow>& rows, const std::vector<std::string>& names) {
  Json out = Json::array();
  for (const camera::FilteredRow& row : rows) {
    Json deg = Json::object();
    Json se_deg = Json::object();
    Json quality = Json::object();
    for (std::size_t k = 0; k < names.size(); ++k) {
      const camera::FilteredAngle& angle = row.angles[k];
      const bool lost = angle.quality == camera::Quality::lost;
      deg[names[k]] = lost ? Json(nullptr) : Json(angle.deg);
      se_deg[names[k]] = lost ? Json(nullptr) : Json(angle.se_deg);
      quality[names[k]] = static_cast<int>(angle.quality);
    }
    out.push_back({{"t_s", row.t_s},
                   {"deg", std::move(deg)},
                   {"se_deg", std::move(se_deg)},
                   {"quality", std::move(quality)}});
  }
  return out;
}

Json seen(const Watch& watch, const std::vector<camera::FilteredRow>& rows) {
  return {{"rows", rows_of(rows, watch.angles())},
          {"marks_found", watch.marks_found().size()},
          {"marks_at", watch.marks_found()},
          {"marks", watch.marks()},
          {"width", watch.width()},
          {"height", watch.height()}};
}

std::string bytes_of(io::JsonReader& arguments, const char* key) {
  const std::string& text = arguments.member(key).get_ref<const std::string&>();
  std::optional<std::string> bytes;
  if (text.size() <= 2 * camera::kMostJpegBytes) bytes = io::from_base64(text);
  if (!bytes) arguments.fail(fmt::format("\"{}\" must be a JPEG in base64", key));
  return std::move(*bytes);
}

}  // namespace

Watch& LiveJobs::watch() {
  if (!watch_) throw io::InputError("nothing is watched: watch_open comes first");
  return *watch_;
}

Json LiveJobs::open(const Json& json) {
  io::JsonReader arguments(json, "watch_open");
  const Json& from = arguments.member("joints");
  camera::Joints joints = from.is_object() ? camera::joints_from_json(from.dump(), "joints")
                                           : camera::load_joints(io::bytes_from_json(from));
  if (arguments.has("drawn") && arguments.member("drawn").get<bool>()) joints = drawn_hand(std::move(joints));
  std::optional<camera::Lens> lens;
  const std::string path =
      arguments.has("lens") ? io::bytes_from_json(arguments.member("lens")) : std::string();
  if (!path.empty()) lens = camera::load_lens(path);
  arguments.done();
  watch_.emplace(std::move(joints), std::move(lens));
  return {{"angles", watch_->angles()}};
}

Json LiveJobs::picture(const Json& json) {
  io::JsonReader arguments(json, "watch_picture");
  Watch& open = watch();
  const double t_s = arguments.number("t_s");
  const std::string bytes = bytes_of(arguments, "jpeg");
  arguments.done();
  return seen(open, open.push(camera::from_jpeg(bytes), t_s));
}

Json LiveJobs::camera(const Json& json) {
  io::JsonReader arguments(json, "watch_camera");
  Watch& open = watch();
  const std::string device = io::bytes_from_json(arguments.member("device"));
  arguments.done();
  const std::optional<Watch::Taken> taken = open.take(device);
  Json out = seen(open, taken ? taken->rows : std::vector<camera::FilteredRow>());
  out["t_s"] = taken ? taken->t_s : 0;
  out["ended"] = !taken;
  return out;
}

Json LiveJobs::close(const Json& json) {
  io::JsonReader(json, "watch_close").done();
  Watch& open = watch();
  Json out = {{"rows", rows_of(open.flush(), open.angles())}};
  watch_.reset();
  return out;
}

Json LiveJobs::draw(const Json& json) {
  io::JsonReader arguments(json, "draw_picture");
  const std::vector<double> angles = arguments.numbers_within("mcp_deg", -180, 360);
  if (angles.size() != twin::kFingers) arguments.fail("\"mcp_deg\" must be five angles");
  constexpr double kMostFrames = 1e12;
  const double frame = arguments.number_within("frame", 0, kMostFrames);
  arguments.done();
  twin::PerFinger pose{};
  std::ranges::copy(angles, pose.begin());
  if (!film_) film_.emplace(kSeed);
  const camera::Picture& picture = film_->shoot(pose, static_cast<std::uint64_t>(frame));
  return {{"jpeg", io::base64(camera::to_jpeg(picture))}};
}

std::map<std::string, io::Job> LiveJobs::jobs() {
  return {{"watch_open", [this](const Json& json, const io::JobProgress&) { return open(json); }},
          {"watch_picture", [this](const Json& json, const io::JobProgress&) { return picture(json); }},
          {"watch_camera", [this](const Json& json, const io::JobProgress&) { return camera(json); }},
          {"watch_close", [this](const Json& json, const io::JobProgress&) { return close(json); }},
          {"draw_picture", [this](const Json& json, const io::JobProgress&) { return draw(json); }}};
}

}  // namespace flexor::filming
