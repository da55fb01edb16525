#include "host/twin/picture.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexor::twin {
namespace {

// Points inside a pixel: a lattice of which no two share a row or a column, so that an edge along the pixels
// is drawn as exactly as any other.
constexpr int kSub = 16;
constexpr int kLattice = 7;
constexpr std::size_t kNoiseTable = 1U << 18U;
constexpr double kRadians = std::numbers::pi / 180;

std::size_t index(int i) { return static_cast<std::size_t>(i); }

}  // namespace

Renderer::Renderer(const View& view, const Look& look, std::uint64_t seed)
    : view_(view), look_(look), seed_(seed) {
  const double a = view.turn_deg * kRadians;
  const double b = view.tilt_deg * kRadians;
  // R = turn about y, then tilt about x.
  turn_ = {{{std::cos(a), std::sin(a) * std::sin(b), std::sin(a) * std::cos(b)},
            {0, std::cos(b), -std::sin(b)},
            {-std::sin(a), std::cos(a) * std::sin(b), std::cos(a) * std::cos(b)}}};
  const auto pixels = index(view.width) * index(view.height);
  plane_.resize(pixels);
  empty_.resize(3 * pixels);
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      const std::size_t i = index(y) * index(view.width) + index(x);
      const Place p = unproject(x, y);
      plane_[i] = {static_cast<float>(p.x), static_cast<float>(p.y)};
    }
  }
  set_light(look.light);
  if (look.noise > 0) {
    Random random(seed_of(seed, 1));
    noise_.resize(kNoiseTable);
    for (float& n : noise_) n = static_cast<float>(look.noise * random.normal());
  }
}

void Renderer::set_light(double light) {
  look_.light = light;
  std::size_t i = 0;
  for (int y = 0; y < view_.height; ++y) {
    for (int x = 0; x < view_.width; ++x) {
      const double here = light * (1 - look_.gradient * x / view_.width);
      for (const std::uint8_t c : look_.background) empty_[i++] = static_cast<float>(here * c);
    }
  }
}

Place Renderer::project(Place p) const {
  std::array<double, 3> q{};
  for (std::size_t i = 0; i < 3; ++i) q[i] = turn_[i][0] * p.x + turn_[i][1] * p.y;
  q[2] += view_.distance_mm;
  const double x = q[0] / q[2];
  const double y = q[1] / q[2];
  const double r2 = x * x + y * y;
  const double stretch = view_.focal_px * (1 + view_.k1 * r2 + view_.k2 * r2 * r2);
  return {stretch * x + view_.centre_px.x, stretch * y + view_.centre_px.y};
}

Place Renderer::unproject(double u, double v) const {
  const double xd = (u - view_.centre_px.x) / view_.focal_px;
  const double yd = (v - view_.centre_px.y) / view_.focal_px;
  double x = xd;
  double y = yd;
  constexpr int kRounds = 12;  // contraction by less than a third each for any usable lens
  for (int i = 0; i < kRounds; ++i) {
    const double r2 = x * x + y * y;
    const double stretch = 1 + view_.k1 * r2 + view_.k2 * r2 * r2;
    x = xd / stretch;
    y = yd / stretch;
  }
  // The ray s (x, y, 1) meets the plane where its third coordinate along the plane's normal is that of the
  // plane.
  const double nx = turn_[0][2];
  const double ny = turn_[1][2];
  const double nz = turn_[2][2];
  const double s = view_.distance_mm * nz / (nx * x + ny * y + nz);
  const double px = s * x;
  const double py = s * y;
  const double pz = s - view_.distance_mm;
  return {turn_[0][0] * px + turn_[1][0] * py + turn_[2][0] * pz,
          turn_[0][1] * px + turn_[1][1] * py + turn_[2][1] * pz};
}

Renderer::Box Renderer::box(const std::vector<Place>& outline) const {
  double left = 1e9;
  double top = 1e9;
  double right = -1e9;
  double bottom = -1e9;
  for (const Place& p : outline) {
    const Place q = project(p);
    left = std::min(left, q.x);
    right = std::max(right, q.x);
    top = std::min(top, q.y);
    bottom = std::max(bottom, q.y);
  }
  constexpr double kMargin = 2;
  const auto inside = [](double v, int size) {
    return static_cast<int>(std::clamp(v, 0.0, static_cast<double>(size)));
  };
  return {inside(left - kMargin, view_.width), inside(top - kMargin, view_.height),
          inside(right + kMargin + 1, view_.width), inside(bottom + kMargin + 1, view_.height)};
}

// inside(x, y, colour) of a point of the plane: whether the thing is there, and its colour.
template <class Inside>
void Renderer::paint(const Box& b, Inside&& inside) {
  touched_ = {std::min(touched_.left, b.left), std::min(touched_.top, b.top),
              std::max(touched_.right, b.right), std::max(touched_.bottom, b.bottom)};
  const auto light_at = [&](int x) { return look_.light * (1 - look_.gradient * x / view_.width); };
  for (int y = b.top; y < b.bottom; ++y) {
    for (int x = b.left; x < b.right; ++x) {
      const std::size_t i = index(y) * index(view_.width) + index(x);
      // The plane is flat over one pixel.
      const std::size_t right = x + 1 < view_.width ? i + 1 : i - 1;
      const std::size_t below = y + 1 < view_.height ? i + index(view_.width) : i - index(view_.width);
      const double sx = x + 1 < view_.width ? 1 : -1;
      const double sy = y + 1 < view_.height ? 1 : -1;
      const double px = plane_[i][0];
      const double py = plane_[i][1];
      const double ux = sx * (plane_[right][0] - px);
      const double uy = sx * (plane_[right][1] - py);
      const double vx = sy * (plane_[below][0] - px);
      const double vy = sy * (plane_[below][1] - py);
      int hits = 0;
      std::array<int, 3> sum{};
      for (int j = 0; j < kSub; ++j) {
        const double u = (j + 0.5) / kSub - 0.5;
        const double v = (kLattice * j % kSub + 0.5) / kSub - 0.5;
        Bgr colour{};
        if (!inside(px + u * ux + v * vx, py + u * uy + v * vy, colour)) continue;
        ++hits;
        for (std::size_t k = 0; k < 3; ++k) sum[k] += colour[k];
      }
      if (hits == 0) continue;
      const auto rest = static_cast<float>(kSub - hits);
      const auto light = static_cast<float>(light_at(x));
      for (std::size_t k = 0; k < 3; ++k) {
        float& c = canvas_[3 * i + k];
        c = (rest * c + light * static_cast<float>(sum[k])) / kSub;
      }
    }
  }
}

void Renderer::paint_rod(const Rod& rod) {
  std::vector<Place> outline;
  for (const Place& end : {rod.a, rod.b}) {
    for (int k = 0; k < 8; ++k) {
      const double angle = k * std::numbers::pi / 4;
      // A polygon around the circle, not in it.
      const double r = rod.radius_mm * 1.09;
      outline.push_back({end.x + r * std::cos(angle), end.y + r * std::sin(angle)});
    }
  }
  const double dx = rod.b.x - rod.a.x;
  const double dy = rod.b.y - rod.a.y;
  const double length2 = std::max(1e-12, dx * dx + dy * dy);
  const double radius2 = rod.radius_mm * rod.radius_mm;
  paint(box(outline), [&](double x, double y, Bgr& colour) {
    const double share = std::clamp(((x - rod.a.x) * dx + (y - rod.a.y) * dy) / length2, 0.0, 1.0);
    const double ex = x - rod.a.x - share * dx;
    const double ey = y - rod.a.y - share * dy;
    colour = rod.colour;
    return ex * ex + ey * ey <= radius2;
  });
}

void Renderer::paint_pattern(const Pattern& p) {
  const double c = std::cos(p.turn_deg * kRadians);
  const double s = std::sin(p.turn_deg * kRadians);
  const double width = p.columns * p.cell_mm;
  const double height = p.rows * p.cell_mm;
  std::vector<Place> outline;
  for (const auto& [u, v] : {Place{-0.5, -0.5}, Place{0.5, -0.5}, Place{-0.5, 0.5}, Place{0.5, 0.5}}) {
    outline.push_back(
        {p.centre.x + c * u * width - s * v * height, p.centre.y + s * u * width + c * v * height});
  }
  paint(box(outline), [&](double x, double y, Bgr& colour) {
    const double dx = x - p.centre.x;
    const double dy = y - p.centre.y;
    const int column = static_cast<int>(std::floor((c * dx + s * dy + width / 2) / p.cell_mm));
    const int row = static_cast<int>(std::floor((-s * dx + c * dy + height / 2) / p.cell_mm));
    if (column < 0 || row < 0 || column >= p.columns || row >= p.rows) return false;
    constexpr Bgr kWhite = {235, 235, 235};
    constexpr Bgr kBlack = {25, 25, 25};
    colour = p.cells[index(row) * index(p.columns) + index(column)] ? kWhite : kBlack;
    return true;
  });
}

// Separable, with the picture's edge pixels repeated. Only around what was painted: the background is as good
// as flat to the filter.
void Renderer::blur(const Box& painted) {
  const int reach = static_cast<int>(std::ceil(3 * look_.blur_px));
  const Box b = {std::max(0, painted.left - reach), std::max(0, painted.top - reach),
                 std::min(view_.width, painted.right + reach),
                 std::min(view_.height, painted.bottom + reach)};
  if (b.left >= b.right || b.top >= b.bottom) return;
  std::vector<float> tap;
  float sum = 0;
  for (int k = -reach; k <= reach; ++k) {
    tap.push_back(static_cast<float>(std::exp(-k * k / (2 * look_.blur_px * look_.blur_px))));
    sum += tap.back();
  }
  for (float& t : tap) t /= sum;
  const std::size_t row = 3 * index(view_.width);
  const std::size_t width = 3 * index(b.right - b.left);
  scratch_.assign(width * index(b.bottom - b.top), 0);
  for (int y = b.top; y < b.bottom; ++y) {
    float* to = &scratch_[index(y - b.top) * width];
    for (int k = -reach; k <= reach; ++k) {
      const float* from = &canvas_[index(std::clamp(y + k, 0, view_.height - 1)) * row + 3 * index(b.left)];
      const float t = tap[index(k + reach)];
      for (std::size_t x = 0; x < width; ++x) to[x] += t * from[x];
    }
  }
  std::vector<float> wide(width + 6 * index(reach));
  for (int y = b.top; y < b.bottom; ++y) {
    const float* from = &scratch_[index(y - b.top) * width];
    for (int x = -reach; x < b.right - b.left + reach; ++x) {
      std::copy_n(from + 3 * index(std::clamp(x, 0, b.right - b.left - 1)), 3, &wide[3 * index(x + reach)]);
    }
    float* to = &canvas_[index(y) * row + 3 * index(b.left)];
    std::fill_n(to, width, 0.F);
    for (std::size_t k = 0; k < tap.size(); ++k) {
      for (std::size_t x = 0; x < width; ++x) to[x] += tap[k] * wide[x + 3 * k];
    }
  }
}

void Renderer::draw(const Scene& scene, std::uint64_t frame, std::vector<std::uint8_t>& bgr) {
  canvas_ = empty_;
  touched_ = {view_.width, view_.height, 0, 0};
  for (const Rod& rod : scene.rods) paint_rod(rod);
  for (const Pattern& pattern : scene.patterns) paint_pattern(pattern);
  for (const Disc& disc : scene.discs) paint_rod({disc.centre, disc.centre, disc.radius_mm, disc.colour});
  for (const Rod& rod : scene.in_front) paint_rod(rod);
  if (look_.blur_px > 0) blur(touched_);
  bgr.resize(canvas_.size());
  if (!noise_.empty()) {
    // A row takes its noise from a random place of one long table.
    Random random(seed_of(seed_, 2, frame));
    const std::size_t row = 3 * index(view_.width);
    for (int y = 0; y < view_.height; ++y) {
      const std::size_t start = random.bits() % (kNoiseTable - row);
      float* to = &canvas_[index(y) * row];
      for (std::size_t x = 0; x < row; ++x) to[x] += noise_[start + x];
    }
  }
  for (std::size_t i = 0; i < bgr.size(); ++i) {
    bgr[i] = static_cast<std::uint8_t>(std::clamp(canvas_[i] + 0.5F, 0.0F, 255.0F));
  }
}

}  // namespace flexor::twin
