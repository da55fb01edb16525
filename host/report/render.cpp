#include "host/report/render.hpp"

#include <fmt/format.h>

#include "host/io/io.hpp"
#include "host/report/jobs.hpp"

namespace flexor::report {
namespace {

struct Kind {
  const char* name;
  void (*render)(const Saved&);
};
constexpr Kind kKinds[] = {{"hand", render_hand},
                           {"experiment", render_experiment},
                           {"tracking", render_tracking},
                           {"deployment", render_deployment},
                           {"latency", render_latency}};

}  // namespace

void render(const std::filesystem::path& folder, const std::atomic<bool>* stop, bool draws_files) {
  const Saved saved(folder, stop, draws_files);
  const std::string wanted = saved.text("kind");
  for (const Kind& kind : kKinds) {
    if (wanted != kind.name) continue;
    try {
      kind.render(saved);
    } catch (const Json::exception& error) {
      throw io::InputError(
          fmt::format("{}: results of another version of flexor, or changed by hand ({}); run the job again",
                      (folder / "results.json").string(), error.what()));
    } catch (const std::out_of_range&) {
      throw io::InputError(
          fmt::format("{}: a table beside results.json lacks a column; run the job again", folder.string()));
    }
    return;
  }
  throw io::InputError(fmt::format("{}: results of an unknown job \"{}\"", folder.string(), wanted));
}

}  // namespace flexor::report
