#include <fmt/format.h>

#include <cstdlib>

#include "apps/cli/commands.hpp"
#include "apps/live/sessions.hpp"
#include "host/io/json.hpp"

namespace flexor::cli {
namespace sessions_command {

struct Options {
  std::string folder;
  bool json = false;
};

void run(const Options& o) {
  const std::filesystem::path folder = sessions_folder(o.folder);
  if (!std::filesystem::is_directory(folder))
    throw io::InputError(
        fmt::format("{}: there are no sessions yet: flexor live makes them", folder.string()));
  const std::vector<live::Session> sessions = live::Sessions(folder).list();
  if (sessions.size() == live::Sessions::kMostListed)
    log_note(fmt::format("the newest {} sessions are listed", sessions.size()));
  if (o.json) {
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (const live::Session& s : sessions) {
      list.push_back({{"folder", (folder / s.name).string()},
                      {"person", s.person},
                      {"side", s.side},
                      {"glove", s.glove},
                      {"made", s.made},
                      {"seconds", s.seconds},
                      {"model", s.model},
                      {"files", s.files}});
    }
    return print(io::dump({{"sessions", list}, {"version", FLEXOR_VERSION}}));
  }
  if (sessions.empty()) print(fmt::format("{}: no sessions yet: flexor live makes them\n", folder.string()));
  for (const live::Session& s : sessions) {
    print(fmt::format("{}  {:>5.0f} s  {}{}\n", io::one_line((folder / s.name).string()), s.seconds,
                      s.person.empty() ? "" : io::one_line(s.person + ", " + s.side + " hand  "),
                      s.model.empty() ? "" : io::one_line("model " + s.model)));
    for (const std::string& file : s.files) print(fmt::format("    {}\n", io::one_line(file)));
  }
}

}  // namespace sessions_command

std::filesystem::path sessions_folder(const std::string& given) {
  using namespace sessions_command;
  if (!given.empty()) return given;
  const char* home = std::getenv("HOME");
  if (home == nullptr || *home == '\0')
    throw io::InputError("--sessions: say where, there is no home folder");
  return std::filesystem::path(home) / "flexor";
}

void add_sessions(CLI::App& app) {
  using namespace sessions_command;
  const auto [o, command] = add_command(
      app, "sessions", "Recordings, models and reports that flexor live keeps, newest first", run);
  command->add_option("--sessions", o->folder, "their folder (default: flexor in the home folder)");
}

}  // namespace flexor::cli
