#include "host/report/render.hpp"

#include <algorithm>
#include <regex>

#include "host/io/io.hpp"
#include "host/report/kinds.hpp"

namespace flexor::report {
namespace {

struct Kind {
  std::string_view name;
  void (*summarize)(Page&, const Json&);
  void (*render)(const Saved&);
};
#define FLEXOR_REPORT(kind) {#kind, summarize_##kind, render_##kind},
constexpr Kind kKinds[] = {FLEXOR_REPORTS(FLEXOR_REPORT)};
#undef FLEXOR_REPORT

}  // namespace

void render(const std::filesystem::path& folder, bool draws_files) {
  const Saved saved(folder, draws_files);
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
        "{}: results of another version of flexor, or changed by hand ({}); run the job again",
        (folder / "results.json").string(), why);
  }
  throw io::InputError("{}: results of an unknown job \"{}\"", folder.string(), wanted);
}

std::string summary(const std::string& kind, const Json& results) {
  Page page("");
  std::ranges::find(kKinds, kind, &Kind::name)->summarize(page, results);
  return page.text();
}

void clear_hand(const std::filesystem::path& folder) {
  static const std::regex kFiles(
      "results\\.json|(joint|samples|covariance)-[0-9]+\\.(html|csv)|(holdout|curve|errors|error_correlation)"
      "_[0-9]+\\.(svg|pdf)");
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
