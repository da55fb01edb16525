#include "host/export/mot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

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

// OpenSim's Storage ends where a number is not one.
bool next_whole(Angles& angles, AngleRow& row, std::uint64_t& left_out) {
  while (angles.next(row)) {
    if (std::ranges::none_of(row.angle_deg, [](double angle) { return std::isnan(angle); })) return true;
    ++left_out;
  }
  return false;
}

std::uint64_t rows_of(Angles angles) {
  AngleRow row;
  std::uint64_t left_out = 0;
  std::uint64_t rows = 0;
  while (next_whole(angles, row, left_out)) ++rows;
  if (rows == 0) throw io::InputError(fmt::format("{}: no row with all its angles", angles.source()));
  return rows;
}

}  // namespace

Written write_mot(const std::filesystem::path& recording, const AngleOptions& options,
                  const std::filesystem::path& out) {
  if (recording == "-")
    throw io::InputError(
        "standard input cannot be read twice, as a .mot file needs it: save it as a file first");
  io::Output output(out);
  Written done;
  done.files = {out.string()};
  done.rows = rows_of(Angles(recording, options));
  Angles angles(recording, options);
  std::string line = fmt::format("{}\nversion=1\nnRows={}\nnColumns={}\ninDegrees=yes\nendheader\ntime",
                                 coordinate(out.stem().string()), done.rows, 1 + angles.joints().size());
  done.joints = coordinates(angles);
  for (const std::string& joint : done.joints) line += "\t" + joint;
  output.write(line + "\n");
  AngleRow row;
  std::uint64_t rows = 0;
  std::uint64_t left_out = 0;
  double first_s = 0;
  double last_s = 0;
  for (; next_whole(angles, row, left_out); ++rows) {
    if (rows == 0) first_s = row.t_s;
    last_s = row.t_s;
    line = fmt::format("{}", row.t_s);
    for (const double angle : row.angle_deg) line += fmt::format("\t{}", angle);
    output.write(line + "\n");
  }
  if (rows != done.rows)
    throw io::JobError(
        fmt::format("{}: changed while it was read: export it once nobody writes it", angles.source()));
  output.commit();
  done.seconds = last_s - first_s;
  done.notes = angles.notes();
  if (left_out > 0) {
    done.notes.push_back(
        fmt::format("{}: {} row(s) with an angle that is not known are left out: OpenSim reads no further "
                    "than such a row",
                    angles.source(), left_out));
  }
  return done;
}

}  // namespace flexor::exports
