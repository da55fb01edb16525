#include "apps/live/worn_glove.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "apps/live/bench_source.hpp"
#include "apps/live/twin_source.hpp"
#include "host/deploy/pair_key.hpp"
#include "host/io/io.hpp"
#include "host/io/worker.hpp"
#include "host/study/bench.hpp"
#include "host/study/boards.hpp"
#include "host/twin/glove.hpp"

namespace flexor::live {
namespace {

constexpr double kBoardsRate_hz = 10;
// From a reading to the hand that follows it, as `flexor twin record` finds it for the shipped twin.
constexpr double kBoardsLead_s = 0.099;
constexpr double kTwinRate_hz = 50;
constexpr const char* kBoards = "flexor-cosim";

// A published compensator behind the divider's own curve: a board of which the sensors' counts are not converted takes models of
// counts, as they are identified from a glove's readings.
model::Model of_counts(model::Model m, const twin::Parameters& parameters) {
  constexpr double kLeast_deg = -10;
  constexpr double kMost_deg = 220;
  constexpr int kKnots = 24;
  const twin::Divider divider(parameters);
  model::Curve curve;
  for (int k = 0; k < kKnots; ++k) {
    const int counts = divider.counts(kLeast_deg + (kMost_deg - kLeast_deg) * k / (kKnots - 1));
    curve.x.push_back(counts);
    curve.y.push_back(divider.alpha_deg(counts));
  }
  std::vector<model::Block> blocks;
  for (model::Input& input : m.inputs) {
    const std::string alpha = input.name + " alpha";
    for (model::Block& block : m.blocks) std::ranges::replace(block.from, input.name, alpha);
    blocks.push_back({{input.name}, alpha, curve});
    input.unit = "count";
    input.column = input.name + "_count";
    input.valid_min = curve.x.front();
    input.valid_max = curve.x.back();
  }
  m.blocks.insert(m.blocks.begin(), blocks.begin(), blocks.end());
  m.name += " of counts";
  model::check(m);
  return m;
}

}  // namespace

nlohmann::ordered_json WornGlove::pose_angles() {
  const twin::Parameters hand;
  nlohmann::ordered_json out;
  for (std::size_t f = 0; f < twin::kFingers; ++f)
    out.push_back(fmt::format("{}={:g}:{:g}", model::finger_names()[f], hand.hand_lower_deg[f],
                              hand.hand_upper_deg[f]));
  return out;
}

std::shared_ptr<WornGlove> worn_twin(const std::string& unit) {
  return std::make_shared<TwinSource>(TwinOptions{.rate_hz = kTwinRate_hz, .unit = unit});
}

std::shared_ptr<WornGlove> worn_boards() {
  struct Boards {
    io::TemporaryFolder folder;
    std::optional<BenchSource> source;
  };
  const auto boards = std::make_shared<Boards>();
  study::BenchOptions options;
  options.model = of_counts(study::compensator("published-hw", kBoardsRate_hz).model, options.parameters);
  options.port_link = boards->folder.path() / "glove";
  const study::Bench& bench = boards->source.emplace(io::program_beside(kBoards), options, true).bench();
  WornFacts& facts = boards->source->facts;
  if (const deploy::Key& key = bench.key()) {
    facts.key_file = (boards->folder.path() / "pair.key").string();
    deploy::write_key(facts.key_file, *key);
  }
  facts.has_boards = true;
  facts.port = bench.port();
  facts.why_not_written = study::why_no_bootloader();
  facts.rate_hz = kBoardsRate_hz;
  facts.lead_s = kBoardsLead_s;
  return {boards, &*boards->source};
}

}  // namespace flexor::live
