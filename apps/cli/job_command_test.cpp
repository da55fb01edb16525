#include "apps/cli/command_test.hpp"
#include "apps/cli/commands.hpp"
#include "apps/cli/job.hpp"

namespace flexor::cli {
namespace job_command_test {

Json run(const std::vector<std::string>& name, const Json& request) {
  return run_job(name, request, [](const Json&) { return true; });
}

std::string refused(const std::vector<std::string>& name, const Json& request) {
  try {
    (void)run(name, request);
  } catch (const io::InputError& error) {
    return error.what();
  }
  return "not refused";
}

void for_each_command(const CLI::App& app, std::vector<std::string> name,
                      const std::function<void(const CLI::App&, const std::vector<std::string>&)>& work) {
  for (const CLI::App* command : app.get_subcommands({})) {
    name.push_back(command->get_name());
    if (command->get_subcommands({}).empty() && command->get_name() != "job") work(*command, name);
    for_each_command(*command, name, work);
    name.pop_back();
  }
}

TEST(Job, EveryCommandHasASchemaThatItKeepsTo) {
  CLI::App app;
  add_commands(app);
  for_each_command(app, {}, [](const CLI::App& command, const std::vector<std::string>& name) {
    const Json schema = job_schema(name);
    const std::string options = command.help();
    for (const auto& [key, type] : schema.at("properties").items()) {
      EXPECT_NE(CLI::detail::to_lower(options).find(key), std::string::npos) << name.back() << " " << key;
      const Json wrong = type.at("type") == "string" ? Json(1) : Json("x");
      EXPECT_NE(refused(name, {{key, wrong}}).find("\"" + key + "\" must be "), std::string::npos)
          << name.back() << " " << key;
    }
    EXPECT_EQ(refused(name, {{"surprise", 1}}),
              "request: \"surprise\" is no option of " + command.get_name());
  });
}

TEST(Job, ARequestIsTypedAndTheKeyIsNamed) {
  EXPECT_EQ(refused({"identify"}, {{"rate", "20"}}), "request: \"rate\" must be of the type number");
  EXPECT_EQ(refused({"experiment"}, {{"trials", 1.5}}), "request: \"trials\" must be of the type integer");
  EXPECT_EQ(refused({"identify"}, {{"pair", {"a.csv", "b.csv"}}}),
            "request: \"pair\" must be a list of two; where several may be given, of such lists");
  EXPECT_EQ(refused({"identify"}, Json::array()), "request: a JSON object is due");
  EXPECT_NE(refused({"recalibrate"}, Json::object()).find("required"), std::string::npos);
  EXPECT_NE(refused({"identify"}, {{"leave-out", "half"}}).find("leave-out"), std::string::npos);
  EXPECT_EQ(refused({"fly"}, Json::object()), "no job is called \"fly\"");
}

TEST(Job, NothingIsSplitAtCommas) {
  EXPECT_NE(refused({"show"}, {{"model", "/none/a,b.json"}}).find("/none/a,b.json"), std::string::npos);
  EXPECT_NE(
      refused({"experiment"}, {{"compensators", {"raw", "/none/[a,b].json"}}}).find("\"/none/[a,b].json\""),
      std::string::npos);
}

class JobProgram : public Command {
 protected:
  // Of `flexor job NAME`: its lines.
  std::vector<Json> lines_of(const std::string& name, const std::string& request, int exit) const {
    write("request.json", request);
    const Finished r = run("job " + name, path("request.json"));
    EXPECT_EQ(r.exit, exit) << r.out << r.err;
    std::vector<Json> out;
    std::istringstream text(r.out);
    for (std::string line; std::getline(text, line);) out.push_back(Json::parse(line));
    return out;
  }
};

TEST_F(JobProgram, ProgressComesBeforeAResultThatIsWhatJsonPrints) {
  make(FLEXOR_SIMULATE);
  Json request = {{"sensor", path("simulated_glove.csv")}, {"reference", path("simulated_camera.csv")}};
  const std::vector<Json> lines = lines_of("identify", request.dump(), 0);
  EXPECT_TRUE(std::ranges::any_of(lines, [](const Json& line) {
    return line.contains("progress") && line.at("progress").at("fraction").is_number();
  }));
  EXPECT_TRUE(lines.back().at("result").contains("joints"));
  request["time-limit"] = 0.001;
  const std::vector<Json> stopped = lines_of("identify", request.dump(), 3);
  EXPECT_TRUE(stopped.at(stopped.size() - 2).at("partial").contains("joints"));
  EXPECT_EQ(lines_of("protocol", "{}", 0).back().at("result"), Json::parse(run("protocol --json").out));
}

TEST_F(JobProgram, AnErrorHasAKindAndAnExitStatus) {
  for (const char* request : {R"({"model": 1})", "[", R"({"model": "/none/there.json"})"})
    EXPECT_EQ(lines_of("show", request, 2).back().at("error").at("kind"), "input");
  EXPECT_EQ(run("job --schema").exit, 2) << "of which job?";
}

}  // namespace job_command_test
}  // namespace flexor::cli
