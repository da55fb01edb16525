#include "apps/camera/live_jobs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <thread>

#include "host/camera/jpeg.hpp"
#include "host/camera/tracker.hpp"
#include "host/io/base64.hpp"
#include "host/io/io.hpp"
#include "host/io/json.hpp"

namespace flexor::filming {
namespace {

constexpr std::uint64_t kSeed = 1;
constexpr double kLeastStep_s = 1e-3;
constexpr double kMost_s = 1e9;

Json rows_of(const std::vector<camera::FilteredRow>& rows) {
  Json out = Json::array();
  for (const camera::FilteredRow& row : rows) {
    Json one = {{"t_s", row.t_s}};
    for (const camera::FilteredAngle& angle : row.angles) {
      const bool lost = angle.quality == camera::Quality::lost;
      one["deg"].push_back(lost ? 0 : angle.deg);
      one["se_deg"].push_back(lost ? 0 : angle.se_deg);
      one["quality"].push_back(static_cast<int>(angle.quality));
    }
    out.push_back(std::move(one));
  }
  return out;
}

std::string bytes_of(io::JsonReader& arguments, const char* key) {
  const std::string& text = arguments.member(key).get_ref<const std::string&>();
  std::optional<std::string> bytes;
  if (text.size() <= 2 * camera::kMostJpegBytes) bytes = io::from_base64(text);
  if (!bytes) arguments.fail(fmt::format("\"{}\" must be a JPEG in base64", key));
  return std::move(*bytes);
}

// Pictures one after the other as somebody sends them, or as a camera gives them.
struct Watch {
  camera::Joints joints;
  std::optional<camera::Lens> lens;
  std::optional<camera::Tracker> tracker = {};  // from the first picture on
  cv::Size size = {};
  double last_s = -1;
  std::string device = {};
  std::unique_ptr<camera::VideoReader> video = {};
  std::chrono::steady_clock::time_point begin = {};
  camera::Picture taken = {};

  // One more picture, taken at t_s; of what is refused the watch goes on.
  std::vector<camera::FilteredRow> push(const camera::Picture& picture, double t_s) {
    if (!(t_s >= 0 && t_s <= kMost_s && (!tracker || t_s >= last_s + kLeastStep_s))) {
      throw io::InputError(
          "picture: taken at {:.6f} s; times must lie between 0 and {:g} s and grow by a millisecond or more",
          t_s, kMost_s);
    }
    if (tracker && picture.size() != size) {
      throw io::InputError("picture: {} x {} pixels, those before it {} x {}: begin again to change the size",
                           picture.cols, picture.rows, size.width, size.height);
    }
    if (!tracker) tracker.emplace(joints, lens, picture.cols, picture.rows);
    size = picture.size();
    last_s = t_s;
    return tracker->push(picture, t_s);
  }

  Json seen(const std::vector<camera::FilteredRow>& rows) const {
    std::vector<std::array<double, 2>> found;
    std::size_t marks = 0;
    for (const camera::Skeleton& skeleton : joints.skeletons) marks += skeleton.marks.size();
    for (const camera::Observation& one : tracker ? tracker->seen() : std::vector<camera::Observation>()) {
      for (const camera::ObservedMark& mark : one.marks) {
        if (mark.measured) found.push_back({mark.at.x / size.width, mark.at.y / size.height});
      }
    }
    return {{"rows", rows_of(rows)}, {"marks_found", found.size()}, {"marks_at", found},
            {"marks", marks},        {"width", size.width},         {"height", size.height}};
  }
};

struct State {
  std::optional<Watch> open;
  std::optional<Renderer> film;

  Watch& watch() {
    if (!open) throw io::InputError("nothing is watched: watch_open comes first");
    return *open;
  }
};

Json open(State& state, const Json& json) {
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
  state.open = Watch{std::move(joints), lens};
  return {{"angles", camera::angle_names(state.open->joints)}};
}

Json picture(State& state, const Json& json) {
  io::JsonReader arguments(json, "watch_picture");
  Watch& open = state.watch();
  const double t_s = arguments.number("t_s");
  const std::string bytes = bytes_of(arguments, "jpeg");
  arguments.done();
  return open.seen(open.push(camera::from_jpeg(bytes), t_s));
}

Json camera(State& state, const Json& json) {
  io::JsonReader arguments(json, "watch_camera");
  Watch& open = state.watch();
  const std::string device = io::bytes_from_json(arguments.member("device"));
  arguments.done();
  if (!open.video) {
    open.video = std::make_unique<camera::VideoReader>(device);
    open.device = device;
    open.begin = std::chrono::steady_clock::now();
  }
  if (device != open.device)
    throw io::InputError("{}: {} is watched already: begin again", device, open.device);
  double t_s = 0;
  const bool ended = !open.video->next(open.taken, t_s);
  if (!ended && !std::filesystem::is_character_file(device))
    std::this_thread::sleep_until(open.begin + std::chrono::duration<double>(t_s));
  std::vector<camera::FilteredRow> rows;
  if (!ended && t_s >= open.last_s + kLeastStep_s) rows = open.push(open.taken, t_s);
  Json out = open.seen(rows);
  out["t_s"] = ended ? 0 : t_s;
  out["ended"] = ended;
  return out;
}

Json close(State& state, const Json& json) {
  io::JsonReader(json, "watch_close").done();
  Watch& open = state.watch();
  const auto rows = open.tracker ? open.tracker->flush() : std::vector<camera::FilteredRow>();
  Json out = {{"rows", rows_of(rows)}};
  state.open.reset();
  return out;
}

Json draw(State& state, const Json& json) {
  io::JsonReader arguments(json, "draw_picture");
  const std::vector<double> angles = arguments.numbers_within("mcp_deg", -180, 360);
  if (angles.size() != twin::kFingers) arguments.fail("\"mcp_deg\" must be five angles");
  constexpr double kMostFrames = 1e12;
  const double frame = arguments.number_within("frame", 0, kMostFrames);
  arguments.done();
  twin::PerFinger pose{};
  std::ranges::copy(angles, pose.begin());
  if (!state.film) state.film.emplace(hand_camera(kSeed));
  const camera::Picture& picture = state.film->draw(hand_scene(pose), static_cast<std::uint64_t>(frame));
  return {{"jpeg", io::base64(camera::to_jpeg(picture))}};
}

}  // namespace

std::map<std::string, io::Job> live_jobs() {
  const auto bound = [state = std::make_shared<State>()](Json (*job)(State&, const Json&)) {
    return [state, job](const Json& json, const io::JobProgress&) { return job(*state, json); };
  };
  return {{"watch_open", bound(open)},
          {"watch_picture", bound(picture)},
          {"watch_camera", bound(camera)},
          {"watch_close", bound(close)},
          {"draw_picture", bound(draw)}};
}

}  // namespace flexor::filming
