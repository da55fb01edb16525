#include "host/camera/draw.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "host/camera/opencv.hpp"

namespace flexor::camera {
namespace {

constexpr int kChart_px = 180;
constexpr int kLegend_px = 16;  // a line
constexpr double kPast_s = 10;
const cv::Scalar kWhite(255, 255, 255);
const cv::Scalar kBlack(0, 0, 0);
const cv::Scalar kOrange(0, 94, 213);
const cv::Scalar kBoneColour(230, 180, 86);
// Colours that colour-blind people can tell (Okabe and Ito), blue first; blue, green, red.
const std::array<cv::Scalar, 7> kPalette = {
    cv::Scalar(178, 114, 0), cv::Scalar(0, 159, 230),  cv::Scalar(115, 158, 0), cv::Scalar(167, 121, 204),
    cv::Scalar(0, 94, 213),  cv::Scalar(233, 180, 86), cv::Scalar(66, 228, 240)};

cv::Point pixel(Point p) { return {static_cast<int>(std::lround(p.x)), static_cast<int>(std::lround(p.y))}; }

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

double scale(const Picture& picture) { return std::clamp(picture.height / 720.0, 0.5, 2.0) * 0.55; }

void draw_skeleton(cv::Mat& on, const Skeleton& s, const Observation& seen, double size) {
  if (seen.marks.empty()) return;
  for (const Link& l : s.links) {
    const ObservedMark& a = seen.marks[l.from];
    const ObservedMark& b = seen.marks[l.to];
    if (a.lost || b.lost) continue;
    cv::line(on, pixel(a.at), pixel(b.at), kBlack, 4, cv::LINE_AA);
    cv::line(on, pixel(a.at), pixel(b.at), kBoneColour, 2, cv::LINE_AA);
  }
  for (const ObservedMark& m : seen.marks) {
    if (m.lost) continue;
    const int r = std::max(4, static_cast<int>(std::lround(std::sqrt(m.area_px / 3.14))));
    cv::circle(on, pixel(m.at), r, m.measured ? kWhite : kOrange, 2, cv::LINE_AA);
    cv::circle(on, pixel(m.at), 2, m.measured ? kWhite : kOrange, cv::FILLED, cv::LINE_AA);
  }
  for (std::size_t k = 0; k < s.angles.size(); ++k) {
    const AngleRule& rule = s.angles[k];
    const ObservedMark& corner = seen.marks[rule.marks[s.kind == MarkKind::printed ? 0 : 1]];
    if (corner.lost) continue;
    const Measurement& m = seen.measurements[k];
    const std::string value =
        m.angle ? fmt::format("{:.1f}{}", m.angle->deg, m.doubtful ? "?" : "") : "hidden";
    const double r = std::sqrt(corner.area_px / 3.14) + 6;
    write(on, value, pixel({corner.at.x + r, corner.at.y - r / 2}), size,
          m.angle && !m.doubtful ? kWhite : kOrange);
  }
}

void draw_chart(cv::Mat chart, const std::deque<FilteredRow>& past, const std::vector<std::string>& names) {
  chart.setTo(cv::Scalar(28, 26, 24));
  if (past.empty()) return;
  double low = 1e9;
  double high = -1e9;
  for (const FilteredRow& row : past) {
    for (const FilteredAngle& a : row.angles) {
      if (a.quality == Quality::lost) continue;
      low = std::min(low, a.deg);
      high = std::max(high, a.deg);
    }
  }
  if (low > high) return;
  low = std::floor(low / 20) * 20;
  high = std::max(low + 20, std::ceil(high / 20) * 20);
  constexpr int kLeft = 50;
  constexpr int kRight = 180;
  const double end_s = past.back().t_s;
  const auto place = [&](double t_s, double deg) {
    const double x = chart.cols - kRight - (end_s - t_s) / kPast_s * (chart.cols - kLeft - kRight);
    return pixel({x, 10 + (high - deg) / (high - low) * (chart.rows - 20)});
  };
  for (const double deg : {low, (low + high) / 2, high}) {
    cv::line(chart, {kLeft, place(0, deg).y}, {chart.cols - kRight, place(0, deg).y}, cv::Scalar(70, 70, 70));
    cv::putText(chart, fmt::format("{:.0f}", deg), {8, place(0, deg).y + 4}, cv::FONT_HERSHEY_SIMPLEX, 0.4,
                kWhite, 1, cv::LINE_AA);
  }
  for (std::size_t k = 0; k < names.size(); ++k) {
    const cv::Scalar& colour = kPalette[k % kPalette.size()];
    for (std::size_t i = 1; i < past.size(); ++i) {
      const FilteredAngle& a = past[i - 1].angles[k];
      const FilteredAngle& b = past[i].angles[k];
      if (a.quality == Quality::lost || b.quality == Quality::lost) continue;
      const bool sure = b.quality == Quality::good;
      cv::line(chart, place(past[i - 1].t_s, a.deg), place(past[i].t_s, b.deg),
               sure ? colour : cv::Scalar(140, 140, 140), sure ? 2 : 1, cv::LINE_AA);
    }
    const int y = 18 + static_cast<int>(k) * kLegend_px;
    if (y < chart.rows) {
      const FilteredAngle& now = past.back().angles[k];
      const std::string text =
          now.quality == Quality::lost ? names[k] + " lost" : fmt::format("{} {:.1f}", names[k], now.deg);
      cv::putText(chart, text, {chart.cols - kRight + 12, y}, cv::FONT_HERSHEY_SIMPLEX, 0.42, colour, 1,
                  cv::LINE_AA);
    }
  }
}

int even(int v) { return v + v % 2; }

}  // namespace

Picture draw_proposal(const Picture& picture, const MarkProposal& proposal) {
  Picture out = picture;
  cv::Mat on = mat(out);
  const double size = scale(picture);
  for (std::size_t i = 0; i < proposal.candidates.size(); ++i) {
    const Mark& m = proposal.candidates[i];
    const int r = static_cast<int>(std::lround(std::sqrt(m.area_px / 3.14))) + 4;
    const bool named = !proposal.name[i].empty();
    cv::circle(on, pixel(m.centre), r, kBlack, 4, cv::LINE_AA);
    cv::circle(on, pixel(m.centre), r, named ? kWhite : kOrange, 2, cv::LINE_AA);
    write(on, std::to_string(i + 1), pixel({m.centre.x + r + 3, m.centre.y + 5}), size,
          named ? kWhite : kOrange);
    const auto line = static_cast<double>(i + 1);
    write(on, fmt::format("{}  {}", i + 1, named ? proposal.name[i] : "-"), pixel({10, line * 40 * size}),
          size, named ? kWhite : kOrange);
  }
  return out;
}

Picture draw_seen(const Picture& picture, const Joints& joints, const std::vector<Observation>& seen) {
  Picture out = picture;
  cv::Mat on = mat(out);
  for (std::size_t i = 0; i < joints.skeletons.size(); ++i) {
    draw_skeleton(on, joints.skeletons[i], seen[i], scale(picture));
  }
  return out;
}

Preview::Preview(const std::filesystem::path& path, int width, int height, double rate_hz,
                 const Joints& joints)
    : joints_(joints),
      names_(angle_names(joints)),
      width_(even(width)),
      height_(even(height)),
      chart_px_(even(std::max(kChart_px, kLegend_px * static_cast<int>(names_.size()) + 20))),
      writer_(path, width_, height_ + chart_px_, rate_hz) {}

void Preview::add(const Picture& picture, const std::vector<Observation>& seen,
                  const std::vector<FilteredRow>& rows) {
  waiting_.push_back(draw_seen(picture, joints_, seen));
  for (const FilteredRow& row : rows) write(row);
}

void Preview::finish(const std::vector<FilteredRow>& rows) {
  for (const FilteredRow& row : rows) write(row);
  writer_.finish();
}

void Preview::write(const FilteredRow& row) {
  past_.push_back(row);
  while (past_.back().t_s - past_.front().t_s > kPast_s) past_.pop_front();
  const Picture& drawn = waiting_.front();
  Picture page(width_, height_ + chart_px_);
  cv::Mat on = mat(page);
  mat(drawn).copyTo(on(cv::Rect(0, 0, drawn.width, drawn.height)));
  draw_chart(on(cv::Rect(0, height_, width_, chart_px_)), past_, names_);
  writer_.add(page);
  waiting_.pop_front();
}

}  // namespace flexor::camera
