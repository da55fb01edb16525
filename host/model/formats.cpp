#include "host/model/formats.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace flexor::model {
namespace {

// The needs of all blocks that take one signal, together.
struct Together {
  std::optional<Need> need;
  int most = kMostFraction;  // that what keeps its fraction can have

  void add(const Need& one) {
    need = need ? Need{hull(need->values, one.values), std::max(need->fraction, one.fraction),
                       need->finer || one.finer}
                : one;
  }
};

bool keeps_fraction(const Kind& kind) {
  return std::visit([](const auto& k) { return k.kKeepsFraction; }, kind);
}

Interval held_values(const Graph& graph, const std::vector<Together>& needs, std::size_t signal) {
  return needs[signal].need ? meet(graph.values[signal], needs[signal].need->values) : graph.values[signal];
}

int fitting(double magnitude) {
  int fraction = kMostFraction;
  while (fraction > -kMostFraction && std::round(std::ldexp(magnitude, fraction)) > 32767) --fraction;
  return fraction;
}

// From the joints back.
std::vector<Together> needs_of(const Model& model, const Graph& graph) {
  const std::size_t count = model.inputs.size();
  std::vector<Together> needs(graph.values.size());
  for (const std::size_t joint : graph.joint) {
    needs[joint].add({graph.values[joint], core::kOutputFraction, false});
  }
  for (std::size_t b = model.blocks.size(); b-- > 0;) {
    const Together& out = needs[count + b];
    if (!out.need) continue;  // nobody asks for it
    const Kind& kind = model.blocks[b].kind;
    for (const std::size_t from : graph.from[b]) {
      const Need need = std::visit(
          [&](const auto& k) {
            return k.need({graph.values[from], 0}, *out.need);
          },
          kind);
      needs[from].add(need);
      needs[from].most = std::min(needs[from].most, need.most);
      if (!keeps_fraction(kind)) continue;
      const int most = fitting(held_values(graph, needs, count + b).magnitude());
      needs[from].most = std::min({needs[from].most, out.most, most});
    }
  }
  return needs;
}

}  // namespace

bool holds_readings(const Input& input) {
  return fits(input.valid_min, core::kInputFraction) && fits(input.valid_max, core::kInputFraction);
}

FixedModel::FixedModel(const Model& model) : graph(model) {
  const std::size_t count = model.inputs.size();
  const std::vector<Together> needs = needs_of(model, graph);
  const auto values = [&](std::size_t signal) { return held_values(graph, needs, signal); };
  const auto most = [&](std::size_t signal) {
    return needs[signal].need ? needs[signal].need->fraction : kMostFraction;
  };
  for (std::size_t i = 0; i < count; ++i) {
    const Input& input = model.inputs[i];
    const FixedFormat format{fmt::format("{}: input", input.name)};
    // Of the steps of Q5 those within, as double has them: rounded to the nearest, a limit would let in one that it refuses.
    constexpr double kSteps = 1 << core::kInputFraction;
    valid_min.push_back(
        format.number("valid_min", std::ceil(input.valid_min * kSteps) / kSteps, core::kInputFraction));
    valid_max.push_back(
        format.number("valid_max", std::floor(input.valid_max * kSteps) / kSteps, core::kInputFraction));
    constexpr int kFiner = 4;
    const bool finer = needs[i].need && needs[i].need->finer;
    const int high = finer ? std::clamp(needs[i].most, core::kInputFraction, core::kInputFraction + kFiner)
                           : core::kInputFraction;
    const Interval held = values(i);
    signals.push_back({held, format.fraction("its range", held.magnitude(), core::kInputFraction, high)});
  }
  for (std::size_t b = 0; b < model.blocks.size(); ++b) {
    const Block& block = model.blocks[b];
    FixedBlock format{{fmt::format("{}: {}", block.to, type_of(block.kind))}, model.sample_period_s, {}, {}};
    for (const std::size_t from : graph.from[b]) format.in.push_back(signals[from]);
    const FixedSignal& in = format.in.front();
    const Interval held = values(count + b);
    // Only an lti gives no more fraction bits than are needed: its direct form has those of an angle.
    const int needed = std::holds_alternative<Lti>(block.kind) ? most(count + b) : kMostFraction;
    const auto* curve = std::get_if<Curve>(&block.kind);
    const int high =
        std::min({needed, needs[count + b].most, curve != nullptr ? curve->most_fraction() : kMostFraction});
    if (keeps_fraction(block.kind) && std::ldexp(held.magnitude(), in.fraction) > 32767.5) {
      format.does_not_fit(fmt::format("its signal ({:.6g})", held.magnitude()));
    }
    format.out = {held, keeps_fraction(block.kind)
                            ? in.fraction
                            : format.fraction("its signal", held.magnitude(), -kMostFraction, high)};
    signals.push_back(format.out);
    blocks.push_back(std::visit(
        [&](const auto& kind) -> FixedKind {
          return FixedCoefficients<std::decay_t<decltype(kind)>>{kind.fixed(format)};
        },
        block.kind));
  }
  for (const Joint& joint : model.joints) {
    const Saturation& limit = limits(model, joint);
    const FixedFormat format{fmt::format("{}: joint", joint.name)};
    // Coarser than the output, its limits would be rounded, too.
    const std::size_t signal = graph.joint[static_cast<std::size_t>(&joint - model.joints.data())];
    if (signals[signal].fraction < core::kOutputFraction)
      format.does_not_fit("the range of the blocks before it");
    const double rest_deg = std::clamp(joint.rest_deg, limit.lower_deg, limit.upper_deg);
    rest.push_back(format.number("rest_deg", rest_deg, core::kOutputFraction));
  }
}

}  // namespace flexor::model
