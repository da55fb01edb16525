#include "apps/live/camera.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "host/io/base64.hpp"
#include "host/io/io.hpp"
#include "host/study/builtin.hpp"

namespace flexor::live {
namespace {

bool is_carried(const std::string& joints) {
  return std::ranges::find(joint_files(), joints) != joint_files().end();
}

}  // namespace

const std::vector<std::string>& joint_files() {
  static const std::vector<std::string> names = {"green_markers", "paper_hand", "printed_finger"};
  return names;
}

void require_carried(const std::string& joints) {
  if (!is_carried(joints))
    throw io::InputError("\"joints\" names none of {}", fmt::join(joint_files(), ", "));
}

Camera::Camera(const std::filesystem::path& program) : worker_(program) {}

void Camera::open(const std::string& joints, const std::string& lens, bool drawn) {
  const Json document = is_carried(joints) ? Json::parse(study::builtin("joints/" + joints + ".json"))
                                           : io::bytes_to_json(joints);
  angles_ =
      worker_.run("watch_open", {{"joints", document}, {"lens", io::bytes_to_json(lens)}, {"drawn", drawn}})
          .at("angles")
          .get<std::vector<std::string>>();
}

Seen Camera::picture(double t_s, std::string_view jpeg) {
  return worker_.run("watch_picture", {{"t_s", t_s}, {"jpeg", io::base64(jpeg)}}).get<Seen>();
}

Grabbed Camera::grab(const std::string& device) {
  const Json json = worker_.run("watch_camera", {{"device", io::bytes_to_json(device)}});
  return {json.get<Seen>(), json.at("t_s"), json.at("ended")};
}

std::vector<SeenRow> Camera::close() { return worker_.run("watch_close", Json::object()).at("rows"); }

std::string Camera::draw(const twin::PerFinger& mcp_deg, std::uint64_t frame) {
  const std::string text = worker_.run("draw_picture", {{"mcp_deg", mcp_deg}, {"frame", frame}}).at("jpeg");
  const auto jpeg = io::from_base64(text);
  if (!jpeg) throw io::JobError("flexor-camera: a picture that is no base64");
  return *jpeg;
}

}  // namespace flexor::live
