// What the build for Windows has no command for yet.

#include "apps/cli/commands.hpp"
#include "host/io/io.hpp"

namespace flexor::cli {
namespace {

CLI::App& add_absent(CLI::App& app, const char* name) {
  CLI::App* command = app.add_subcommand(name, "not in the build for Windows yet: use it in WSL2");
  command->set_help_flag();
  command->prefix_command();
  command->callback([command] {
    throw io::JobError("the build for Windows has no command {} yet: use Flexor for Linux in WSL2",
                       command->get_name());
  });
  return *command;
}

}  // namespace

#define FLEXOR_ABSENT(name) \
  void name##_command::add(CLI::App& app) { (void)add_absent(app, #name); }
FLEXOR_ABSENT(live)
FLEXOR_ABSENT(monitor)
FLEXOR_ABSENT(ports)
FLEXOR_ABSENT(record)
FLEXOR_ABSENT(track)
FLEXOR_ABSENT(flash)
FLEXOR_ABSENT(pair)
FLEXOR_ABSENT(send)
FLEXOR_ABSENT(job)
#undef FLEXOR_ABSENT
void wear_command::add(CLI::App& twin) { (void)add_absent(twin, "wear"); }
void camera_command::add(CLI::App& app) {
  CLI::App& camera = add_absent(app, "camera");
  for (const char* part : {"calibrate", "film"}) (void)add_absent(camera, part);
}
nlohmann::ordered_json track_video(io::Worker&, const TrackOptions&, const std::function<bool()>&) {
  throw io::JobError("the build for Windows reads no videos yet: use Flexor for Linux in WSL2");
}

}  // namespace flexor::cli
