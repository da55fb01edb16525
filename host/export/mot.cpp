#include "host/export/mot.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "host/io/output.hpp"

namespace flexor::exports {
namespace {

std::string coordinate(std::string name) {
  std::ranges::replace_if(
      name, [](unsigned char c) { return c <= ' ' || c == 0x7f; }, '_');
  return name;
}

std::vector<std::string> coordinates(const Angles& angles) {
  std::vector<std::string> out;
  for (const std::string& joint : angles.joints()) {
    const std::string name = coordinate(joint);
    if (name == "time" || std::ranges::find(out, name) != out.end())
      throw io::InputError(
          fmt::format("{}: a .mot file cannot have another column {}: call the joint otherwise with --names",
                      angles.source(), name));
    out.push_back(name);
  }
  return out;
}

}  // namespace

Written write_mot(const std::filesystem::path& recording, const AngleOptions& options,
                  const std::filesystem::path& out) {
  if (recording == "-")
    throw io::InputError(
        "standard input cannot be read twice, as a .mot file needs it: save it as a file first");
  io::Output output(out);
  AngleOptions whole = options;
  whole.whole_rows = true;
  AngleRow row;
  Angles counted(recording, whole);
  while (counted.next(row)) continue;
  Angles angles(recording, whole);
  const std::vector<std::string> joints = coordinates(angles);
  output.write(fmt::format("{}\nversion=1\nnRows={}\nnColumns={}\ninDegrees=yes\nendheader\ntime\t{}\n",
                           coordinate(out.stem().string()), counted.rows(), 1 + joints.size(),
                           fmt::join(joints, "\t")));
  while (angles.next(row)) output.write(fmt::format("{}\t{}\n", row.t_s, fmt::join(row.angle_deg, "\t")));
  if (angles.rows() != counted.rows())
    throw io::JobError(
        fmt::format("{}: changed while it was read: export it once nobody writes it", angles.source()));
  output.commit();
  Written done = angles.written({out.string()});
  done.joints = joints;
  return done;
}

}  // namespace flexor::exports
