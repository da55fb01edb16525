#include "host/camera/mark_proposal.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/camera/colour_tracker.hpp"
#include "host/io/io.hpp"

namespace flexor::camera {
MarkProposal propose_marks(const Skeleton& skeleton, const Picture& picture, const std::optional<Point>& mark,
                           const std::map<int, std::string>& assigned) {
  if (skeleton.kind != MarkKind::colour) {
    throw io::InputError("printed marks carry their numbers with them and need no set-up");
  }
  MarkProposal out;
  out.colour = mark              ? colour_at(picture, *mark)
               : skeleton.colour ? *skeleton.colour
                                 : learn_colour(skeleton, picture);
  out.candidates = find_marks(picture, out.colour, region_of(skeleton, picture), least_area_px(out.colour));
  std::ranges::sort(out.candidates, {}, [](const Mark& m) { return m.centre.x + m.centre.y; });
  out.name.resize(out.candidates.size());
  if (!assigned.empty()) {
    for (const auto& [number, name] : assigned) {
      (void)skeleton.mark(name);
      if (number < 1 || number > static_cast<int>(out.candidates.size())) {
        throw io::InputError("there is no candidate {}: they are numbered 1 to {} in the picture", number,
                             out.candidates.size());
      }
      out.name[static_cast<std::size_t>(number - 1)] = name;
    }
    return out;
  }
  const auto found = assign(skeleton, skeleton.lengths(), skeleton.length_tolerance, out.candidates);
  if (!found || found->cost > kMaxCost) {
    out.trouble = fmt::format("{} candidate(s) do not look like the {} marks of \"{}\"",
                              out.candidates.size(), skeleton.marks.size(), skeleton.name);
    return out;
  }
  if (found->margin < kMinMargin) out.trouble = "another assignment looks almost as likely: check this one";
  for (std::size_t m = 0; m < skeleton.marks.size(); ++m) out.name[found->candidate[m]] = skeleton.marks[m];
  return out;
}

Skeleton with_start(const Skeleton& skeleton, const MarkProposal& proposal) {
  Skeleton out = skeleton;
  out.colour = proposal.colour;
  out.rgb.reset();
  for (std::size_t m = 0; m < out.marks.size(); ++m) {
    const auto it = std::ranges::find(proposal.name, out.marks[m]);
    if (it == proposal.name.end()) {
      throw io::InputError("which candidate is \"{}\"? give --assign NUMBER={}", out.marks[m], out.marks[m]);
    }
    if (std::ranges::count(proposal.name, out.marks[m]) > 1) {
      throw io::InputError("two candidates are called \"{}\"", out.marks[m]);
    }
    out.start[m] = proposal.candidates[static_cast<std::size_t>(it - proposal.name.begin())].centre;
  }
  return out;
}

}  // namespace flexor::camera
