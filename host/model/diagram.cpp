#include <fmt/format.h>

#include <vector>

#include "host/io/io.hpp"
#include "host/model/model.hpp"

namespace flexor::model {
namespace {

// The blocks before a joint as a tree, the joint at its root: what each takes stands indented below it. A signal
// that was shown before is only named.
class Diagram {
 public:
  explicit Diagram(const Model& m) : model_(m), graph_(m), shown_(graph_.values.size(), false) {}

  std::string text() {
    for (std::size_t j = 0; j < model_.joints.size(); ++j) {
      out_ += fmt::format("\n{}, rests at {:.1f} deg\n", model_.joints[j].name, model_.joints[j].rest_deg);
      branch(graph_.joint[j], "", true);
    }
    return std::move(out_);
  }

 private:
  void branch(std::size_t signal, const std::string& indent, bool last) {
    const std::string stem = indent + (last ? "└─ " : "├─ ");
    if (signal < model_.inputs.size()) return leaf(stem, model_.inputs[signal]);
    const std::size_t b = signal - model_.inputs.size();
    const Block& block = model_.blocks[b];
    out_ += shown_[signal] ? fmt::format("{}{} (above)\n", stem, block.to)
                           : fmt::format("{}{}: {}\n", stem, type_of(block.kind), text_of(block.kind));
    if (shown_[signal]) return;
    shown_[signal] = true;
    for (const std::size_t from : graph_.from[b])
      branch(from, indent + (last ? "   " : "│  "), from == graph_.from[b].back());
  }

  void leaf(const std::string& stem, const Input& input) {
    out_ += fmt::format(
        "{}{}{}, valid {:g} to {:g}\n", stem, input.column.empty() ? input.name : input.column,
        input.unit.empty() ? "" : fmt::format(" ({})", input.unit), input.valid_min, input.valid_max);
  }

  const Model& model_;
  Graph graph_;
  std::vector<bool> shown_;
  std::string out_;
};

}  // namespace

std::string diagram(const Model& m) {
  std::string out = fmt::format(
      "{}: {}\n{:g} ms a sample, {} input(s), {} block(s), {} joint(s), schema {}, written by {}\n",
      io::one_line(m.name), io::one_line(m.description), 1000 * m.sample_period_s, m.inputs.size(),
      m.blocks.size(), m.joints.size(), kSchemaVersion, io::one_line(m.written_by));
  out += Diagram(m).text();
  const auto joints = m.fit.value("joints", nlohmann::ordered_json::object());
  for (const auto& [joint, fit] : joints.items()) {
    const auto rmse_deg =
        fit.value(nlohmann::ordered_json::json_pointer("/holdout/rmse_deg"), nlohmann::ordered_json());
    if (!rmse_deg.is_number()) continue;
    out += fmt::format("\nheld-out error of {} {:.2f} deg RMSE when it was fitted{}\n", io::one_line(joint),
                       rmse_deg.get<double>(),
                       fit.contains("untried_structures") ? ", by a search that was stopped" : "");
  }
  return out;
}

}  // namespace flexor::model
