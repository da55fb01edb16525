#include "apps/cli/commands.hpp"
#include "host/io/io.hpp"
#include "host/model/diagram.hpp"

namespace flexor::cli {
namespace show_command {

struct Options {
  std::string model;
  bool schema = false;
  bool json = false;
};

void run(const Options& o) {
  if (o.schema) return print(model::schema_json());
  if (o.model.empty()) throw io::InputError("show: name a model document, or ask for --schema");
  const model::Model m = model::load(o.model);
  print(o.json ? model::to_json(m) : model::diagram(m));
}

}  // namespace show_command

void add_show(CLI::App& app) {
  using namespace show_command;
  const auto [o, command] =
      add_command(app, "show", "Show a model document: a diagram of its blocks, and its limits", run,
                  "the document itself, checked");
  CLI::Option* model = command->add_option("model", o->model, "model document");
  command->add_flag("--schema", o->schema, "the JSON Schema of every model document instead")
      ->excludes(model);
}

}  // namespace flexor::cli
