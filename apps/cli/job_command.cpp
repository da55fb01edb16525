#include <sstream>

#include "apps/cli/commands.hpp"
#include "apps/cli/job.hpp"

namespace flexor::cli {
namespace job_command {

struct Options {
  std::vector<std::string> name;
  bool schema = false;
};

CLI::App& command_of(CLI::App& app, const std::vector<std::string>& name) {
  CLI::App* command = &app;
  try {
    for (const std::string& word : name) command = command->get_subcommand(word);
  } catch (const CLI::OptionNotFound&) {
    command = &app;
  }
  if (command == &app || !command->get_subcommands({}).empty() || command->get_name() == "job")
    throw io::InputError("no job is called \"{}\"", fmt::join(name, " "));
  return *command;
}

// The long name without its dashes; of what has its place alone that name.
std::string name_of(const CLI::Option& option) {
  return option.get_lnames().empty() ? option.get_name(true) : option.get_lnames().front();
}

std::string key_of(const CLI::Option& option) { return CLI::detail::to_lower(name_of(option)); }

Json type_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  if (type.starts_with("FLOAT")) return {{"type", "number"}};
  if (type.starts_with("INT") || type.starts_with("UINT")) return {{"type", "integer"}};
  return {{"type", "string"}};
}

// One value, or the two of an option that takes a pair; of what may be repeated, a list of them.
Json schema_of(const CLI::Option& option) {
  Json out = option.get_items_expected_max() == 0 ? Json{{"type", "boolean"}} : type_of(option);
  const int size = option.get_type_size_max();
  if (size > 1) out = {{"type", "array"}, {"items", out}, {"minItems", size}, {"maxItems", size}};
  if (size > 0 && option.get_expected_max() > 1) out = {{"type", "array"}, {"items", out}};
  out["description"] = option.get_description();
  return out;
}

Json schema_of(const CLI::App& command) {
  Json properties = Json::object();
  Json required = Json::array();
  for (const CLI::Option* option : command.get_options()) {
    const std::string key = key_of(*option);
    if (key == "help" || key == "json") continue;
    properties[key] = schema_of(*option);
    if (option->get_required()) required.push_back(key);
  }
  return {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
          {"title", command.get_name()},
          {"type", "object"},
          {"properties", std::move(properties)},
          {"required", std::move(required)},
          {"additionalProperties", false}};
}

bool is_of_type(const Json& value, const std::string& type) {
  if (type == "boolean") return value.is_boolean();
  if (type == "number") return value.is_number();
  if (type == "integer") return value.is_number_integer();
  return value.is_string();
}

// Of a value, its texts as the option takes them. Nothing is split.
void add_texts(const Json& value, const Json& schema, const std::string& key, std::vector<std::string>& out) {
  const std::string type = schema.at("type");
  if (type != "array") {
    if (!is_of_type(value, type)) throw io::InputError("request: \"{}\" must be of the type {}", key, type);
    return out.push_back(value.is_string() ? value.get<std::string>() : value.dump());
  }
  if (!value.is_array() || (schema.contains("minItems") && value.size() != schema.at("minItems")))
    throw io::InputError(
        "request: \"{}\" must be a list{}", key,
        schema.contains("minItems") ? " of two; where several may be given, of such lists" : "");
  for (const Json& item : value) add_texts(item, schema.at("items"), key, out);
}

// The request as CLI11 takes a configuration.
class Request : public CLI::Config {
 public:
  Request(const std::vector<std::string>& name, CLI::App& command, const Json& request) {
    if (!request.is_object()) throw io::InputError("request: a JSON object is due");
    for (auto end = name.begin(); end != name.end();) items_.push_back(item({name.begin(), ++end}, "++"));
    std::map<std::string, CLI::Option*> options;
    for (CLI::Option* option : command.get_options()) options[key_of(*option)] = option;
    for (const auto& [key, value] : request.items()) {
      const auto option = options.find(key);
      if (option == options.end() || key == "help" || key == "json")
        throw io::InputError("request: \"{}\" is no option of {}", key, command.get_name());
      CLI::ConfigItem one = item(name, name_of(*option->second));
      add_texts(value, schema_of(*option->second), key, one.inputs);
      option->second->delimiter('\0')->allow_extra_args(false);
      if (value != false) items_.push_back(one);
    }
    if (options.contains("json")) {
      items_.push_back(item(name, "json"));
      items_.back().inputs = {"true"};
    }
  }
  std::vector<CLI::ConfigItem> from_config(std::istream&) const override { return items_; }
  std::string to_config(const CLI::App*, bool, bool, std::string) const override { return {}; }

 private:
  static CLI::ConfigItem item(std::vector<std::string> parents, const std::string& name) {
    CLI::ConfigItem out;
    out.parents = std::move(parents);
    out.name = name;
    return out;
  }
  std::vector<CLI::ConfigItem> items_;
};

std::vector<std::string> words_of(const std::string& name) {
  std::istringstream words(name);
  return {std::istream_iterator<std::string>(words), {}};
}

void run(const Options& o) {
  if (o.schema) return print(io::dump(job_schema(o.name)));
  if (o.name.empty()) {
    io::serve(false, [](const std::string& name, const Json& request, const io::Event& event) {
      return run_job(words_of(name), request, event);
    });
    return;
  }
  const auto say = [](const Json& line) {
    JobOutput* const output = std::exchange(job_output, nullptr);
    print(io::dump_line(line) + "\n");
    job_output = output;
    return true;
  };
  const Json answer =
      io::answer([&] { return run_job(o.name, io::parse_json(io::read_file("-"), "request"), say); });
  say(answer);
  throw JobEnded{status_of(answer)};
}

void add(CLI::App& app) {
  const auto [o, command] =
      add_command(app, "job",
                  "A command for other programs: its options as one JSON object on standard input, one JSON "
                  "object a line on standard output: progress, warning, and last result or error. Without a "
                  "name: any number of jobs, each a line {\"job\": NAME, \"arguments\": {...}}",
                  run);
  command->add_option("name", o->name, "identify, score, twin record, ...");
  command->add_flag("--schema", o->schema, "print the JSON Schema of the job's request");
}

}  // namespace job_command

int status_of(const Json& answer) {
  if (answer.contains("result")) return 0;
  const std::string kind = answer.at("error").at("kind");
  return kind == "job" ? 1 : kind == "input" ? 2 : 3;
}

Json job_schema(const std::vector<std::string>& name) {
  CLI::App app;
  add_commands(app);
  return job_command::schema_of(job_command::command_of(app, name));
}

Json run_job(const std::vector<std::string>& name, const Json& request, const io::Event& event) {
  using namespace job_command;
  CLI::App app;  // every command once more: the request fills the options of one
  add_commands(app);
  CLI::App* command = &app;
  (void)command_of(app, name);
  for (const std::string& word : name) command = command->get_subcommand(word)->configurable();
  app.allow_config_extras(CLI::config_extras_mode::error);
  app.config_formatter(std::make_shared<Request>(name, *command, request));
  JobOutput output{event, {}};
  struct Until {
    ~Until() { job_output = nullptr; }
  } const until;
  job_output = &output;
  const auto result = [&output] {
    const Json json = Json::parse(output.result, nullptr, false);
    return json.is_discarded() ? Json(io::to_utf8(output.result)) : json;
  };
  try {
    std::istringstream nothing;
    app.parse_from_stream(nothing);
  } catch (const CLI::ParseError& error) {
    throw io::InputError("request: {}", error.what());
  } catch (const io::Doubt&) {
    if (!output.result.empty()) (void)event({{"partial", result()}});
    throw;
  }
  return result();
}

}  // namespace flexor::cli
