#include "host/report/render.hpp"

#include <fmt/format.h>

#include <regex>

#include "host/io/io.hpp"
#include "host/report/saved.hpp"

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
  std::string why;
  for (const Kind& kind : kKinds) {
    if (wanted != kind.name) continue;
    try {
      kind.render(saved);
      return;
    } catch (const Json::exception& error) {
      why = error.what();
    } catch (const std::logic_error& error) {  // a number that is none, a table without a column
      why = error.what();
    }
    throw io::InputError(
        fmt::format("{}: results of another version of flexor, or changed by hand ({}); run the job again",
                    (folder / "results.json").string(), why));
  }
  throw io::InputError(fmt::format("{}: results of an unknown job \"{}\"", folder.string(), wanted));
}

void clear_hand(const std::filesystem::path& folder) {
  static const std::regex kFiles(
      "results\\.json|(joint|samples|covariance)-[0-9]+\\.(html|csv)|"
      "(holdout|curve|errors|error_correlation)_[0-9]+\\.(svg|pdf)");
  std::error_code ignored;
  std::vector<std::filesystem::path> old;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    if (!std::regex_match(entry.path().filename().string(), kFiles)) continue;
    io::require_writable(entry.path());  // not this command's input
    old.push_back(entry.path());
  }
  for (const std::filesystem::path& path : old) std::filesystem::remove(path, ignored);
}

}  // namespace flexor::report
