#include "host/identify/motion_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/identify/hold.hpp"
#include "host/identify/robust.hpp"

namespace flexor::identify {
namespace {

using Eigen::Index;

constexpr double kRange_deg = 20;
constexpr double kSpan_s = 0.25;  // over which a speed is taken
constexpr double kQuick_deg_s = 60;
constexpr double kSlow_deg_s = 30;
constexpr double kStill_deg_s = 3;
constexpr double kSlow_s = 0.5;

struct Found {
  bool hold = false;
  double quickest_deg_s = 0;
  bool slow = false;
};

void look(const Session& session, double period_s, Found& found) {
  const auto span = std::max<Index>(1, std::lround(kSpan_s / period_s));
  const auto angle = [&](Index k) { return session.angle_deg(k); };
  Index slow = 0;
  found.hold = found.hold || !holds_of(session, period_s).empty();
  for (Index k = 0; k < session.angle_deg.size(); ++k) {
    const bool used = session.use[static_cast<std::size_t>(k)] != 0;
    if (k < span) continue;
    const double speed = std::abs(angle(k) - angle(k - span)) / (static_cast<double>(span) * period_s);
    if (used && session.use[static_cast<std::size_t>(k - span)] != 0)
      found.quickest_deg_s = std::max(found.quickest_deg_s, speed);
    slow = used && speed > kStill_deg_s && speed < kSlow_deg_s ? slow + 1 : 0;
    found.slow = found.slow || static_cast<double>(slow) * period_s >= kSlow_s;
  }
}

}  // namespace

std::vector<std::string> lacking(const std::vector<Session>& sessions, double period_s) {
  Found found;
  for (const Session& session : sessions) look(session, period_s, found);
  std::vector<double> angles = used_angles(sessions);
  if (angles.empty()) return {};
  std::ranges::sort(angles);
  const double range = quantile(angles, 0.99) - quantile(angles, 0.01);
  std::vector<std::string> out;
  const auto say = [&](bool lacks, const std::string& what) {
    if (lacks) out.push_back(what + " (flexor protocol prints the recommended motion)");
  };
  say(range < kRange_deg,
      fmt::format("it moves by {:.0f} degrees only: go from the open hand to the fist and back", range));
  say(!found.hold,
      "it is never held for a second: hold the hand open, half closed and closed, two seconds each");
  say(found.quickest_deg_s < std::min(kQuick_deg_s, range),
      "it never moves quickly: open and close within a second, some times");
  say(!found.slow, "it never moves slowly: take four seconds to close, and four to open");
  return out;
}

std::optional<std::string> refused_readings(const model::Input& input,
                                            const std::vector<std::span<const double>>& logs) {
  std::ptrdiff_t refused = 0;
  for (const std::span<const double> log : logs)
    refused +=
        std::ranges::count_if(log, [&](double u) { return u < input.valid_min || u > input.valid_max; });
  if (refused == 0) return std::nullopt;
  return fmt::format(
      "{}: {} reading(s) lie outside the valid range of {:g} to {:g} {}: was the sensor unplugged or "
      "shorted? They "
      "are left out, and where nothing else was read the compensator holds its angle",
      input.name, refused, input.valid_min, input.valid_max, input.unit);
}

}  // namespace flexor::identify
