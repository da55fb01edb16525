#include <memory>

#include "apps/cli/commands.hpp"
#include "host/model/diagram.hpp"

namespace flexor::cli {
namespace show_command {

struct Options {
  std::string model;
  bool json = false;
};

void run(const Options& o) {
  const model::Model m = model::load(o.model);
  print(o.json ? model::to_json(m) : model::diagram(m));
}

}  // namespace show_command

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
