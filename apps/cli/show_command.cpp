#include "apps/cli/commands.hpp"
#include "host/model/hardware.hpp"

namespace flexor::cli::show_command {

struct Options {
  std::string model;
  std::string hardware;
  bool schema = false;
  bool json = false;
};

void run(const Options& o) {
  if (!o.hardware.empty())
    return print(io::dump(o.schema ? model::hardware_schema() : model::to_json(model::hardware(o.hardware))));
  if (o.schema) return print(model::schema_json());
  if (o.model.empty()) throw io::InputError("show: name a model document, or ask for --hardware or --schema");
  const model::Model m = model::load(o.model);
  print(o.json ? model::to_json(m) : model::diagram(m));
}

void add(CLI::App& app) {
  const auto [o, command] =
      add_command(app, "show", "Show a model document: a diagram of its blocks, and its limits", run,
                  "the document itself, checked");
  CLI::Option* model = command->add_option("model", o->model, "model document");
  command
      ->add_option(
          "--hardware", o->hardware,
          "instead the document of this glove and hand, to edit: flexor, lucidgloves, or a file, checked")
      ->excludes(model);
  command->add_flag("--schema", o->schema, "the JSON Schema of every such document instead")->excludes(model);
}

}  // namespace flexor::cli::show_command
