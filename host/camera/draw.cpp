#include "host/camera/draw.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace flexor::camera {
namespace {

const cv::Scalar kWhite(255, 255, 255);
const cv::Scalar kBlack(0, 0, 0);
const cv::Scalar kOrange(0, 94, 213);
const cv::Scalar kBoneColour(230, 180, 86);

// Dark outline, so that it can be read on anything.
void write(cv::Mat& on, const std::string& text, cv::Point at, double size, const cv::Scalar& colour) {
  // Kept inside the picture.
  int baseline = 0;
  const cv::Size extent = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, size, 1, &baseline);
  at.x = std::clamp(at.x, 2, std::max(2, on.cols - extent.width - 2));
  at.y = std::clamp(at.y, extent.height + 2, std::max(extent.height + 2, on.rows - baseline));
  cv::putText(on, text, at, cv::FONT_HERSHEY_SIMPLEX, size, kBlack, 4, cv::LINE_AA);
  cv::putText(on, text, at, cv::FONT_HERSHEY_SIMPLEX, size, colour, 1, cv::LINE_AA);
}

double scale(const Picture& picture) { return std::clamp(picture.rows / 720.0, 0.5, 2.0) * 0.55; }

void draw_skeleton(cv::Mat& on, const Skeleton& s, const Observation& seen, double size) {
  if (seen.marks.empty()) return;
  for (const Link& l : s.links) {
    const ObservedMark& a = seen.marks[l.from];
    const ObservedMark& b = seen.marks[l.to];
    if (a.lost || b.lost) continue;
    cv::line(on, a.at, b.at, kBlack, 4, cv::LINE_AA);
    cv::line(on, a.at, b.at, kBoneColour, 2, cv::LINE_AA);
  }
  for (const ObservedMark& m : seen.marks) {
    if (m.lost) continue;
    const int r = std::max(4, static_cast<int>(std::lround(std::sqrt(m.area_px / 3.14))));
    cv::circle(on, m.at, r, m.measured ? kWhite : kOrange, 2, cv::LINE_AA);
    cv::circle(on, m.at, 2, m.measured ? kWhite : kOrange, cv::FILLED, cv::LINE_AA);
  }
  for (std::size_t k = 0; k < s.angles.size(); ++k) {
    const AngleRule& rule = s.angles[k];
    const ObservedMark& corner = seen.marks[rule.marks[s.kind == MarkKind::printed ? 0 : 1]];
    if (corner.lost) continue;
    const Measurement& m = seen.measurements[k];
    const std::string value =
        m.angle ? fmt::format("{:.1f}{}", m.angle->deg, m.doubtful ? "?" : "") : "hidden";
    const double r = std::sqrt(corner.area_px / 3.14) + 6;
    write(on, value, corner.at + Point(r, -r / 2), size, m.angle && !m.doubtful ? kWhite : kOrange);
  }
}

}  // namespace

Picture draw_proposal(const Picture& picture, const MarkProposal& proposal) {
  Picture out = picture.clone();
  const double size = scale(picture);
  for (std::size_t i = 0; i < proposal.candidates.size(); ++i) {
    const Mark& m = proposal.candidates[i];
    const int r = static_cast<int>(std::lround(std::sqrt(m.area_px / 3.14))) + 4;
    const bool named = !proposal.name[i].empty();
    cv::circle(out, m.centre, r, kBlack, 4, cv::LINE_AA);
    cv::circle(out, m.centre, r, named ? kWhite : kOrange, 2, cv::LINE_AA);
    write(out, std::to_string(i + 1), m.centre + Point(r + 3, 5), size, named ? kWhite : kOrange);
    const auto line = static_cast<double>(i + 1);
    write(out, fmt::format("{}  {}", i + 1, named ? proposal.name[i] : "-"), Point(10, line * 40 * size),
          size, named ? kWhite : kOrange);
  }
  return out;
}

Picture draw_seen(const Picture& picture, const Joints& joints, const std::vector<Observation>& seen) {
  Picture out = picture.clone();
  for (std::size_t i = 0; i < joints.skeletons.size(); ++i) {
    draw_skeleton(out, joints.skeletons[i], seen[i], scale(picture));
  }
  return out;
}

}  // namespace flexor::camera
