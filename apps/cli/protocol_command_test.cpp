#include <algorithm>

#include "apps/cli/command_test.hpp"
#include "apps/cli/commands.hpp"

namespace flexor::cli {
namespace protocol_test {

using Protocol = Command;

struct Frame {
  double t_s;
  std::string text;
  bool has(const std::string& what) const { return text.find(what) != text.npos; }
  auto count(char what) const { return std::ranges::count(text, what); }
};

// With a clock that takes no time, and is so late each time.
std::vector<Frame> guided(double late_s = 0) {
  std::vector<Frame> out;
  double now_s = 0;
  guide_motion([&](double t_s) { return now_s = t_s + late_s; },
               [&](const std::string& text) {
                 out.push_back({now_s, text});
               });
  return out;
}

TEST_F(Protocol, LeadsThroughTheMotion) {
  const std::vector<Frame> frames = guided();
  const auto at = [&](double t_s) {
    return *std::ranges::find_if(frames.begin() + 1, frames.end(),
                                 [&](const Frame& f) { return f.t_s > t_s - 0.01; });
  };
  EXPECT_TRUE(at(-5).has("Part 1 of 5") && at(-5).has("\n\033[K··") && at(-5).has("0:00 of"));
  EXPECT_TRUE(at(15.5).has("Part 2 of 5") && at(15.5).has("██ 100 % closed"));
  EXPECT_TRUE(at(32).has("Part 3 of 5") && at(60).has("Part 4 of 5"));
  EXPECT_TRUE(at(118.5).has("Part 5 of 5") && at(118.5).has("1:58 of 2:00"));
}

TEST_F(Protocol, IsDrawnInPlaceWithABellAtEachChange) {
  const std::vector<Frame> frames = guided();
  const auto part = [&](std::size_t of) { return frames[of].text.substr(frames[of].text.find("Part"), 7); };
  std::ptrdiff_t bells = frames.back().count('\a');
  for (std::size_t i = 1; i + 1 < frames.size(); ++i) {
    bells += frames[i].count('\a');
    ASSERT_EQ(frames[i].count('\n'), 5);
    ASSERT_EQ(frames[i].has("\033[5A"), i > 1);
    ASSERT_TRUE(i < 2 || part(i) == part(i - 1) || frames[i].has("\a")) << "a part begins with a move";
  }
  EXPECT_EQ(bells, std::ssize(json_of("protocol --json").at("moves")) + 1);
  EXPECT_EQ(guided(20).size(), 2U + 6) << "a machine that stood still goes on where time is";
}

TEST_F(Protocol, WhereNobodyLooksIsAListOfItsParts) {
  const Finished r = run("protocol");
  EXPECT_EQ(lines(r.out), 4 + 1 + 5) << r.out;
  EXPECT_NE(r.out.find("\n0:48-1:08  Close all"), std::string::npos) << r.out;
  EXPECT_EQ(run("protocol --list").out, r.out);
}

}  // namespace protocol_test
}  // namespace flexor::cli
