#include "host/model/compensator.hpp"

#include <algorithm>

namespace flexor::model {

template <class Arithmetic>
Compensator<Arithmetic>::Compensator(const Model& model) {
  // node_of: of a block by its place; fraction_of: of a signal.
  const auto build = [&](const Graph& graph, const auto& node_of, const auto& fraction_of) {
    for (std::size_t b = 0; b < model.blocks.size(); ++b)
      blocks_.push_back({node_of(b), {graph.from[b].begin(), graph.from[b].end()}});
    signals_.resize(graph.values.size());
    status_.resize(graph.values.size(), core::Status::ok);
    for (std::size_t j = 0; j < model.joints.size(); ++j) {
      const std::size_t signal = graph.joint[j];
      const std::size_t before = graph.from[signal - model.inputs.size()].front();
      outputs_.push_back(
          {static_cast<std::uint16_t>(signal), static_cast<std::uint16_t>(before), fraction_of(signal)});
      const Saturation& limit = limits(model, model.joints[j]);
      samples_.push_back(
          {std::clamp(model.joints[j].rest_deg, limit.lower_deg, limit.upper_deg), core::Status::ok});
    }
  };
  if constexpr (kFixed) {
    const FixedModel fixed(model);
    valid_min_ = fixed.valid_min;
    valid_max_ = fixed.valid_max;
    for (std::size_t i = 0; i < model.inputs.size(); ++i)
      refinement_.push_back(static_cast<std::uint8_t>(fixed.signals[i].fraction - core::kInputFraction));
    const auto node_of = [&](std::size_t b) {
      return std::visit([]<class K>(const FixedCoefficients<K>& one) -> Node { return NodeOf<K>{one.c}; },
                        fixed.blocks[b]);
    };
    build(fixed.graph, node_of, [&](std::size_t signal) { return fixed.signals[signal].fraction; });
    for (std::size_t j = 0; j < model.joints.size(); ++j)
      samples_[j].angle_deg = std::ldexp(fixed.rest[j], -core::kOutputFraction);
  } else {
    for (const Input& input : model.inputs) {
      valid_min_.push_back(static_cast<Number>(input.valid_min));
      valid_max_.push_back(static_cast<Number>(input.valid_max));
    }
    const auto node_of = [&](std::size_t b) {
      return std::visit(
          [&]<class K>(const K& kind) -> Node {
            return NodeOf<K>{kind.template floating<Number>(model.sample_period_s)};
          },
          model.blocks[b].kind);
    };
    build(Graph(model), node_of, [](std::size_t) { return 0; });
  }
}

template <class Arithmetic>
typename Compensator<Arithmetic>::Number Compensator<Arithmetic>::number(double u) {
  if constexpr (kFixed) {
    if (!(u > -1024)) return INT16_MIN;
    return static_cast<std::int16_t>(
        std::lround(std::ldexp(std::min(u, 32767.0 / 32), core::kInputFraction)));
  } else {
    return static_cast<Number>(u);
  }
}

template <class Arithmetic>
double Compensator<Arithmetic>::in_degrees(Number y, int fraction) {
  if constexpr (kFixed) {
    return std::ldexp(core::to_output(y, static_cast<std::int8_t>(fraction - core::kOutputFraction)),
                      -core::kOutputFraction);
  } else {
    return y;
  }
}

template <class Arithmetic>
core::Status Compensator<Arithmetic>::read(std::size_t input, double u) {
  const Number v = number(u);
  if (!(v >= valid_min_[input] && v <= valid_max_[input])) {
    if (v != v) return core::Status::not_a_number;
    return v < valid_min_[input] ? core::Status::below_range : core::Status::above_range;
  }
  if constexpr (kFixed) {
    signals_[input] = core::refine(v, refinement_[input]);
  } else {
    signals_[input] = v;
  }
  return core::Status::ok;
}

template <class Arithmetic>
void Compensator<Arithmetic>::run(Block& block, Number& out) {
  const bool first = !block.started;
  block.started = true;
  std::visit(
      [&](auto& node) {
        const Number in = signals_[block.from.front()];
        if constexpr (requires { node.c.step(node.state, in); }) {
          if (first) node.c.start(node.state, in);
          out = node.c.step(node.state, in);
        } else if constexpr (requires { node.c(in); }) {
          out = node.c(in);
        } else {
          std::array<Number, kMaxTerms> terms;
          for (std::size_t i = 0; i < block.from.size(); ++i) terms[i] = signals_[block.from[i]];
          out = node.c(terms.data());
        }
      },
      block.node);
}

template <class Arithmetic>
void Compensator<Arithmetic>::forget(std::size_t signal) {
  if (signal < inputs()) return;
  Block& block = blocks_[signal - inputs()];
  if (!block.started) return;
  block.started = false;
  for (const std::size_t from : block.from) forget(from);
}

template <class Arithmetic>
std::span<const typename Compensator<Arithmetic>::Sample> Compensator<Arithmetic>::step(
    std::span<const double> reading) {
  for (std::size_t i = 0; i < inputs(); ++i) status_[i] = read(i, reading[i]);
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    Block& block = blocks_[b];
    core::Status status = core::Status::ok;
    for (const std::size_t from : block.from) {
      if (status == core::Status::ok) status = status_[from];
    }
    const std::size_t signal = inputs() + b;
    status_[signal] = status;
    if (status == core::Status::ok) run(block, signals_[signal]);
  }
  for (std::size_t j = 0; j < outputs_.size(); ++j) {
    const std::size_t signal = outputs_[j].signal;
    samples_[j].status = status_[signal];
    if (status_[signal] != core::Status::ok) continue;
    if (kFixed || std::isfinite(static_cast<double>(signals_[outputs_[j].unlimited]))) {
      samples_[j].angle_deg = in_degrees(signals_[signal], outputs_[j].fraction);
    } else {
      // Coefficients from elsewhere, or damaged: the next good reading must not inherit the infinity.
      samples_[j].status = core::Status::not_a_number;
      forget(signal);
    }
  }
  return samples_;
}

template class Compensator<DoubleArithmetic>;
template class Compensator<FloatArithmetic>;
template class Compensator<FixedArithmetic>;

}  // namespace flexor::model
