#include "apps/live/camera.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>

#include "host/io/base64.hpp"
#include "host/io/io.hpp"
#include "host/study/builtin.hpp"

namespace flexor::live {
namespace {

using Json = nlohmann::ordered_json;

double number_or_nan(const Json& json) {
  return json.is_null() ? std::numeric_limits<double>::quiet_NaN() : json.get<double>();
}

std::vector<SeenRow> rows_of(const Json& json, const std::vector<std::string>& angles) {
  std::vector<SeenRow> out;
  for (const Json& row : json.at("rows")) {
    SeenRow& one = out.emplace_back();
    one.t_s = row.at("t_s");
    for (const std::string& name : angles) {
      one.deg.push_back(number_or_nan(row.at("deg").at(name)));
      one.se_deg.push_back(number_or_nan(row.at("se_deg").at(name)));
      one.quality.push_back(row.at("quality").at(name));
    }
  }
  return out;
}

void read(const Json& json, const std::vector<std::string>& angles, Seen& out) {
  out.rows = rows_of(json, angles);
  out.marks_found = json.at("marks_found");
  out.marks_at = json.at("marks_at").get<std::vector<std::array<double, 2>>>();
  out.marks = json.at("marks");
  out.width = json.at("width");
  out.height = json.at("height");
}

std::string bytes_of(const Json& json) {
  const auto bytes = io::from_base64(json.get_ref<const std::string&>());
  if (!bytes) throw io::JobError("flexor-camera: a picture that is no base64");
  return *bytes;
}

}  // namespace

const std::vector<std::string>& joint_files() {
  static const std::vector<std::string> names = {"green_markers", "paper_hand", "printed_finger"};
  return names;
}

void require_carried(const std::string& joints) {
  if (std::ranges::find(joint_files(), joints) != joint_files().end()) return;
  throw io::InputError(fmt::format("\"joints\" names none of {}", fmt::join(joint_files(), ", ")));
}

Camera::Camera(const std::filesystem::path& program) : worker_(program) {}

void Camera::open(const std::string& joints, const std::string& lens, bool drawn) {
  const bool carried = std::ranges::find(joint_files(), joints) != joint_files().end();
  const Json document =
      carried ? Json::parse(study::builtin("joints/" + joints + ".json")) : io::bytes_to_json(joints);
  angles_ =
      worker_.run("watch_open", {{"joints", document}, {"lens", io::bytes_to_json(lens)}, {"drawn", drawn}})
          .at("angles")
          .get<std::vector<std::string>>();
}

Seen Camera::picture(double t_s, std::string_view jpeg) {
  Seen out;
  read(worker_.run("watch_picture", {{"t_s", t_s}, {"jpeg", io::base64(jpeg)}}), angles_, out);
  return out;
}

Grabbed Camera::grab(const std::string& device) {
  const Json json = worker_.run("watch_camera", {{"device", io::bytes_to_json(device)}});
  Grabbed out;
  read(json, angles_, out);
  out.t_s = json.at("t_s");
  out.ended = json.at("ended");
  return out;
}

std::vector<SeenRow> Camera::close() { return rows_of(worker_.run("watch_close", Json::object()), angles_); }

std::string Camera::draw(const twin::PerFinger& mcp_deg, std::uint64_t frame) {
  return bytes_of(worker_.run("draw_picture", {{"mcp_deg", mcp_deg}, {"frame", frame}}).at("jpeg"));
}

}  // namespace flexor::live
