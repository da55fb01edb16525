#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "apps/cli/commands.hpp"
#include "host/model/model.hpp"

namespace flexor::cli {
namespace show_command {

struct Options {
  std::string model;
  bool json = false;
};

// The blocks before a joint as a tree, the joint at its root: what each takes stands indented below it. A signal
// that was shown before is only named.
class Diagram {
 public:
  explicit Diagram(const model::Model& m) : model_(m), graph_(m), shown_(graph_.values.size(), false) {}

  std::string text() {
    for (std::size_t j = 0; j < model_.joints.size(); ++j) show(j);
    return std::move(out_);
  }

 private:
  void show(std::size_t joint) {
    const model::Joint& j = model_.joints[joint];
    print(fmt::format("\n{}, rests at {:.1f} deg\n", j.name, j.rest_deg));
    branch(graph_.joint[joint], "", true);
  }

  void print(const std::string& text) { out_ += text; }

  void branch(std::size_t signal, const std::string& indent, bool last) {
    const std::string stem = indent + (last ? "└─ " : "├─ ");
    if (signal < model_.inputs.size()) return leaf(stem, model_.inputs[signal]);
    const std::size_t b = signal - model_.inputs.size();
    const model::Block& block = model_.blocks[b];
    if (shown_[signal]) return print(fmt::format("{}{} (above)\n", stem, block.to));
    shown_[signal] = true;
    print(fmt::format("{}{}: {}\n", stem, model::type_of(block.kind), model::text_of(block.kind)));
    for (const std::size_t from : graph_.from[b]) {
      branch(from, indent + (last ? "   " : "│  "), from == graph_.from[b].back());
    }
  }

  void leaf(const std::string& stem, const model::Input& input) {
    print(fmt::format("{}{}{}, valid {:g} to {:g}\n", stem, input.column.empty() ? input.name : input.column,
                      input.unit.empty() ? "" : fmt::format(" ({})", input.unit), input.valid_min,
                      input.valid_max));
  }

  const model::Model& model_;
  model::Graph graph_;
  std::vector<bool> shown_;
  std::string out_;
};

void run(const Options& o) {
  const model::Model m = model::load(o.model);
  print(o.json ? model::to_json(m) : diagram(m));
}

}  // namespace show_command

std::string diagram(const model::Model& m) {
  std::string out = fmt::format(
      "{}: {}\n{:g} ms a sample, {} input(s), {} block(s), {} joint(s), schema {}, written by {}\n",
      io::one_line(m.name), io::one_line(m.description), 1000 * m.sample_period_s, m.inputs.size(),
      m.blocks.size(), m.joints.size(), model::kSchemaVersion, io::one_line(m.written_by));
  out += show_command::Diagram(m).text();
  const auto holdout = m.fit.find("holdout");
  if (holdout != m.fit.end() && holdout->contains("rmse_deg") && !holdout->at("rmse_deg").is_null()) {
    out += fmt::format("\nheld-out error {:.2f} deg RMSE when it was fitted\n",
                       holdout->at("rmse_deg").get<double>());
  }
  return out;
}

void add_show(CLI::App& app) {
  using namespace show_command;
  auto o = std::make_shared<Options>();
  CLI::App* command =
      app.add_subcommand("show", "Show a model document: a diagram of its blocks, and its limits");
  command->add_option("model", o->model, "model document")->required();
  command->add_flag("--json", o->json, "the document itself, checked");
  command->callback([o] { run(*o); });
}

}  // namespace flexor::cli
